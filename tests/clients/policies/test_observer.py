"""Observations by a map: joined numbers, poses of the tool, texts, and pictures as they are wanted."""

from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from cellwright import Cell, Client
from cellwright.clients.policies.cell_workplace import CellWorkplace
from cellwright.clients.policies.key_map import Cell as Names
from cellwright.clients.policies.key_map import (
    Channels,
    Constant,
    Grip,
    KeyMap,
    Picture,
    Source,
    ToChannels,
    ToolPose,
    Words,
)
from cellwright.clients.policies.observer import Observer, digest_of
from cellwright.clients.policies.pictures import fitted
from cellwright.config.sensors import PictureCameraConfig
from cellwright.util.pose import Pose
from tests.support.cells import ARM_ONLY

EYE = PictureCameraConfig(
    "eye", "rgb_camera", Pose((2.0, 0.0, 2.0), (0.0, 0.0, 0.0, 1.0)), width=16, height=12, rate=20
)
SEEN = replace(ARM_ONLY, sensors=(EYE,))


def observed(cell: Cell, observation: dict[str, Source]) -> tuple[Observer, Client, Names]:
    client = Client.in_process(cell)
    place = CellWorkplace(client)
    key_map = KeyMap(observation, (ToChannels(place.names.space.names),))
    observer = Observer(place, key_map, "pick the gear")
    assert client.wait_until(observer.is_complete, 1.0)
    return observer, client, place.names


def test_numbers_are_joined_and_the_pose_is_that_of_the_cup() -> None:
    cell = Cell(ARM_ONLY)
    fingers = Grip("suction", (0.04, -0.04), (0.0, 0.0))
    sources = (ToolPose("arm", "none", "world"), Channels(("suction",)), Constant((5.0,)), fingers)
    observer, client, _ = observed(cell, {"state": sources, "prompt": Words("Task: {sentence}.")})
    client.control_gripper(True)
    client.sleep(0.02)
    found = observer.observation()
    cup = cell.simulation.data.body("vacuum_gripper_link").xpos
    assert found["state"] == pytest.approx([*cup, 1.0, 5.0, 0.0, 0.0], abs=1e-3)
    assert found["state"].dtype == np.float32
    assert found["prompt"] == "Task: pick the gear."


def test_pictures_are_turned_fitted_and_planar() -> None:
    cell = Cell(SEEN)
    with closing(cell.simulation):
        sources: dict[str, Source] = {
            "plain": Picture("eye"),
            "turned": Picture("eye", turned=True),
            "mirrored": Picture("eye", mirrored=True),
            "upside_down": Picture("eye", turned=True, mirrored=True),
            "images": {"planar": Picture("eye", (8, 8), is_planar=True)},
        }
        observer, client, names = observed(cell, sources)
        plain = client.camera("eye").message
        assert plain is not None
        assert plain.colour is not None
        assert names.cameras == ["eye"]
        found = observer.observation()
        assert (found["plain"] == plain.colour).all()
        assert (found["turned"] == plain.colour[::-1, ::-1]).all()
        assert (found["mirrored"] == plain.colour[:, ::-1]).all()
        assert (found["upside_down"] == plain.colour[::-1]).all()
        planar = found["images"]["planar"]
        assert planar.shape == (3, 8, 8)
        assert (planar.transpose(1, 2, 0) == fitted(plain.colour, (8, 8))).all()
        assert observer.exposed()["/ariac/eye"] == plain.time_ns < client.transport.now()


def test_digest_depends_on_all_values_and_not_on_the_order_of_names() -> None:
    a, b = np.zeros(2, np.float32), np.zeros((2, 2, 3), np.uint8)
    same = digest_of({"a": a, "b": {"c": b}, "t": "x"})
    assert digest_of({"t": "x", "b": {"c": b}, "a": a}) == same
    changed = b.copy()
    changed[1, 1, 2] = 1
    others = [
        {"a": a, "b": {"c": changed}, "t": "x"},
        {"a": a, "b": {"c": b}, "t": "y"},
        {"a": a, "b": {"d": b}, "t": "x"},
    ]
    assert same not in {digest_of(each) for each in others}
