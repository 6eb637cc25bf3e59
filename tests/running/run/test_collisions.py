"""Tests of the collision monitor: it reports contacts of the arm, and affects nothing."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.client import Client
from cellwright.config.arm import ARM_JOINTS
from cellwright.config.trial.trial import BeltPart
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.standard import String
from cellwright.recording.format.format import PANEL
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.format.run_log import RunLog
from cellwright.running.run import RecordOptions, RunOptions, run_cell
from cellwright.running.run.collisions import MAX_SHOWN, Collision, CollisionWatch
from cellwright.util.pose import Pose
from tests.cell.model.arm_poses import ABOVE_BIN
from tests.cell.robot_cells import AT_BIN, BESIDE_ARM, tandem_cell
from tests.support.cells import ARM_ONLY


def positions(rail: float) -> list[float]:
    """Return joint positions in which the arm reaches out over the bins, with the rail at this place [m]."""
    return [rail, *(ABOVE_BIN[name] for name in ARM_JOINTS[1:])]


class IntoThePost:
    """Drives along the bins with the arm reaching out, against the post at y 1.5 m, and back."""

    def run(self, client: Client) -> None:
        client.start_competition()
        client.send_arm([positions(0.25), positions(1.9)], [2.0, 5.0], joints=ARM_JOINTS)
        client.sleep(8.0)
        client.send_arm([positions(0.25)], [2.0], joints=ARM_JOINTS)
        client.sleep(3.0)


@pytest.mark.slow
def test_arm_held_up_by_post_is_reported(tmp_path: Path) -> None:
    log = RunLog(tmp_path / "run.jsonl")
    cell = Cell(ARM_ONLY)
    result = run_cell(cell, IntoThePost(), RunOptions(ends_when_done=False), record=RecordOptions(log=log))
    collisions = [each for each in result.collisions if each.deviation > 0.02]
    assert {each.obstacle for each in collisions} == {"camera frame 2"}
    (first, *_) = collisions
    assert 2.0 < first.begin < 6.0
    assert first.begin + 1.0 < first.end < 11.0
    assert first.sentence().startswith(f"{first.link} against camera frame 2, {first.begin:.1f} to {first.end:.1f} s; ")
    assert first.sentence().endswith(f"held up {first.deviation * 1e3:.0f} mm from its goal")
    lines = [json.loads(line) for line in (tmp_path / "run.jsonl").read_text().splitlines()]
    logged = [line for line in lines if line["kind"] == "collision"]
    assert [line["obstacle"] for line in logged] == [each.obstacle for each in result.collisions]
    assert logged[0]["deviation"] == result.collisions[0].deviation


@pytest.mark.slow
def test_recorded_panel_has_collisions_and_outcome(tmp_path: Path) -> None:
    result = run_cell(Cell(ARM_ONLY), IntoThePost(), RunOptions(ends_when_done=False), record=tmp_path / "run.mcap")
    with RecordingFile(tmp_path / "run.mcap") as recording:
        panels = [json.loads(TYPES.from_cdr(each.data, String).data) for each in recording.messages((PANEL,))]
    counts = [panel["collisions"]["count"] for panel in panels[1:]]  # the first one is from before the run
    assert counts[0] == 0
    assert counts[-1] == len(result.collisions) > 0
    assert any(each["end"] is None for panel in panels[1:] for each in panel["collisions"]["latest"]), "while it lasted"
    assert [panel["result"] for panel in panels[:-1]] == [None] * (len(panels) - 1)
    assert panels[-1]["result"]["state_hash"] == result.state_hash


def test_panel_shows_newest_collisions_and_counts_all() -> None:
    watch = CollisionWatch(Cell(ARM_ONLY))
    assert watch.panel() == {"count": 0, "latest": []}
    watch.collisions = [Collision("arm", "forearm_link", "bin7", float(at), at + 0.5, 0.01234) for at in range(30)]
    shown = watch.panel()
    assert (shown["count"], len(shown["latest"])) == (30, MAX_SHOWN)
    assert shown["latest"][-1] == {
        "owner": "arm",
        "link": "forearm_link",
        "obstacle": "bin7",
        "begin": 29.0,
        "end": 29.5,
        "deviation": 0.012,
    }


class Nowhere:
    """Stays where it is."""

    def run(self, client: Client) -> None:
        client.start_competition()
        client.sleep(1.0)


def test_arm_without_contact_has_no_collision() -> None:
    assert run_cell(Cell(ARM_ONLY), Nowhere()).collisions == ()


def test_obstacle_that_is_a_clone_has_its_name() -> None:
    cell = Cell(replace(ARM_ONLY, belt_parts=(BeltPart(1.0, "pulley_part", Pose()),)))
    watch = CollisionWatch(cell)
    place = Pose(tuple(cell.simulation.data.body("forearm_link").xpos.tolist()))
    for _ in range(25):
        for _ in range(10):
            cell.parts.appear("populate_conveyor|pulley_part_clone_0", place)
            cell.step()
    assert "populate_conveyor|pulley_part_clone_0" in {each.obstacle for each in watch.end()}


def test_arm_held_up_by_a_robot_is_reported_once_for_each_pair_of_links() -> None:
    cell = Cell(tandem_cell(BESIDE_ARM))
    client, watch = Client.in_process(cell), CollisionWatch(cell)
    client.sleep(0.1)
    joints = {name: value for name, value in client.joint_positions.items() if name in ARM_JOINTS}
    client.send_arm([list((joints | {"linear_arm_actuator_joint": 1.5}).values())], [2.0], joints=[*joints])
    client.sleep(3.0)
    found = watch.end()
    assert ("forearm_link", "tandem_torso") in {(each.link, each.obstacle) for each in found}
    assert len({(each.link, each.obstacle) for each in found}) == len(found)
    assert all(each.deviation > 0.02 for each in found)
    assert watch.nearest is not None
    assert watch.nearest.distance < 0.0


@pytest.mark.parametrize(("link", "counts"), [("torso", True), ("right_upper_arm", True), ("right_hand", False)])
def test_robot_that_touches_a_part_is_reported_but_for_its_hands(link: str, counts: bool) -> None:
    cell = Cell(tandem_cell())
    watch, part = CollisionWatch(cell), cell.parts.all[0]
    model, data = cell.simulation.model, cell.simulation.data
    shape = next(geom for geom in range(model.ngeom) if model.body(int(model.geom_bodyid[geom])).name.endswith(link))
    place = Pose(tuple(data.geom_xpos[shape].tolist()))
    for _ in range(150):
        cell.parts.place(part, place)
        cell.step()
        assert data.ncon
    assert ((f"tandem_{link}", part.name) in {(each.link, each.obstacle) for each in watch.end()}) == counts


def test_what_a_robot_stands_on_is_no_obstacle() -> None:
    stands, floats = ("at: [0.0, 0.0, -0.0005]", "at: [0.0, 0.0, 0.5]")
    for place in (stands, floats):
        cell = Cell(tandem_cell(AT_BIN.replace("at: [0.0, 0.0, 0.0]", place)))
        watch = CollisionWatch(cell)
        cell.simulation.step_until(500_000_000)
        assert watch.end() == []
