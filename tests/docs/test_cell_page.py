"""The figures of the page on the cell are those of the model and of the transform tree."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cellwright import Cell, load_trial
from cellwright.cell.model.parts import part_type
from cellwright.clients.client import Client
from cellwright.util.pose import Pose

PAGE = (Path(__file__).parents[2] / "docs" / "cell.md").read_text(encoding="utf-8")


def rows(heading: str) -> list[list[str]]:
    """The cells of the last table below a heading, without its head."""
    section = PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    (*_, table) = re.findall(r"(?:^\|.*\n)+", section, re.MULTILINE)
    return [[cell.strip(" `") for cell in line.strip("|").split("|")] for line in table.splitlines()[2:]]


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"-?\d+\.?\d*", text)]


@pytest.fixture(scope="module")
def cell() -> Cell:
    return Cell(load_trial("lesson"))


def corners(cell: Cell, geom: int) -> np.ndarray:
    """Lower and upper corner [m] of the box around a shape of the model, in the world."""
    model, data = cell.simulation.model, cell.simulation.data
    turn = np.abs(data.geom_xmat[geom].reshape(3, 3))
    centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
    middle = data.geom_xpos[geom] + data.geom_xmat[geom].reshape(3, 3) @ centre
    return np.array([middle - turn @ half, middle + turn @ half])


def around(cell: Cell, body: str) -> np.ndarray:
    """Lower and upper corner [m] of the box around a body of the model, in the world."""
    first, count = cell.simulation.model.body(body).geomadr[0], cell.simulation.model.body(body).geomnum[0]
    found = np.array([corners(cell, geom) for geom in range(first, first + count)])
    return np.array([found[:, 0].min(axis=0), found[:, 1].max(axis=0)])


def near(one: Any, other: Any, within: float = 6e-4) -> bool:
    return bool(np.allclose(sorted(np.ravel(one)), sorted(np.ravel(other)), atol=within))


def test_table_of_places_equals_model(cell: Cell) -> None:
    documented = {row[0]: row[1:] for row in rows("Places")}
    bin5, bin1 = (around(cell, name) for name in ("bin5", "bin1"))
    floor = corners(cell, int(cell.simulation.model.body("bin5").geomadr[0]))
    height = numbers(documented["bins 5 to 8: where parts lie"][2])
    assert near(height, [floor[1][2], bin5[1][2]])
    assert near(numbers(documented["bins 5 to 8: where parts lie"][0]), floor[:, 0])
    assert near(numbers(documented["bins 5 to 8: where parts lie"][1])[0], (floor[1][1] - floor[0][1]) / 2)
    assert near(np.array(numbers(documented["bins 1 to 4"][0])) - floor[:, 0], [bin1[0][0] - bin5[0][0]] * 2)
    belt = around(cell, "conveyor_belt")
    assert near(numbers(documented["belt"][0]), belt[:, 0])
    assert near(numbers(documented["belt"][1]), belt[:, 1])
    assert near(numbers(documented["belt"][2]), belt[1][2])
    wall = corners(cell, int(cell.simulation.model.geom("deletion_wall").id))
    assert near(numbers(documented["parts leave the belt"][0]), wall[:, 0])
    assert near(numbers(documented["parts leave the belt"][1]), wall[1][1])
    plates = [corners(cell, int(cell.simulation.model.geom(f"kit_tray_{number}_plate").id)) for number in (1, 2)]
    what = documented["trays, at the load points"]
    assert near(numbers(what[0]), plates[0][:, 0], 1e-3)
    assert near(numbers(what[1]), np.concatenate([plates[0][:, 1], plates[1][:, 1]]), 1e-3)
    rim = around(cell, "agv1::kit_tray_1::kit_tray_1::tray")[1][2]
    assert near(numbers(what[2]), [plates[0][1][2], rim])
    beam = corners(cell, int(cell.simulation.model.body("linear_arm_actuator").geomadr[0]))
    assert near([numbers(cell_) for cell_ in documented["beam of the rail"]], beam.T)
    posts = [around(cell, f"camera_frame_{number}") for number in (2, 1)]
    what = documented["rows of posts, 0.05 thick"]
    assert near(numbers(what[0]), [post[:, 0].mean() for post in posts], 6e-3)
    assert near(numbers(what[1]), [posts[0][0][1] + 0.025, posts[0][1][1] - 0.025], 3e-3)
    assert near(numbers(what[2])[1], posts[0][1][2] - 0.025)
    fence = around(cell, "conveyor_frame")
    assert near(numbers(documented["fence, 0.05 thick"][0]), fence[:, 0].mean(), 2e-3)
    assert near(numbers(documented["fence, 0.05 thick"][2])[0], fence[1][2])


def test_table_of_frames_equals_published_transforms(cell: Cell) -> None:
    sent: dict[str, Pose] = {}

    def take(message: Any) -> None:
        for transform in message.transforms:
            p, q = transform.transform.translation, transform.transform.rotation
            if transform.header.frame_id == "world":
                sent[transform.child_frame_id] = Pose((p.x, p.y, p.z), (q.w, q.x, q.y, q.z))

    client = Client.in_process(cell)
    for topic in ("/tf", "/tf_static"):
        client.subscribe(topic, take)
    client.sleep(0.2)
    documented = rows("Frames")
    own = {f"{sensor.name}_frame" for sensor in cell.trial.sensors}
    assert {row[0] for row in documented} == {
        name for name in sent if name not in own and "quality_control" not in name
    }
    for name, *figures in documented:
        assert near([float(figure) for figure in figures[:3]], sent[name].position), name
        assert float(figures[3]) == pytest.approx(abs(sent[name].yaw), abs=6e-4), name


def test_table_of_parts_equals_part_types() -> None:
    for name, mass, size, ends, top in rows("Parts"):
        kind = part_type(name)
        lower, upper = (np.array(corner) * 1e3 for corner in kind.box)
        assert float(mass) == kind.mass, name
        assert near(numbers(size), upper - lower, 0.06), name
        assert near(numbers(ends), [*lower[:2], *upper[:2]], 0.06), name
        assert numbers(top) == pytest.approx([upper[2]], abs=0.06), name
