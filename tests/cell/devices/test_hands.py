"""Hands of a robot that hold parts."""

import numpy as np
import pytest

from cellwright import Cell
from cellwright.cell.devices.hands import HoldingHand
from cellwright.cell.model.build import WorldPart
from cellwright.middleware.messages.conversions import joint_state
from cellwright.util.pose import Pose
from tests.cell.robot_cells import AT_BIN, tandem_cell

WITH_HANDS = AT_BIN.replace("namespace: left}", "namespace: left, hands: {reach: 0.03}}")


def go(cell: Cell, seconds: float) -> None:
    cell.simulation.step_until(cell.simulation.now + round(seconds * 1e9))


def close(cell: Cell, right: float, left: float = 0.0) -> None:
    cell.bus.publish("/left/target_gripper_status", joint_state(["", ""], [right, left], time=0))


def tip(cell: Cell) -> Pose:
    cell.simulation.refresh()
    body = cell.simulation.data.body("tandem/right_tip")
    return Pose(tuple(body.xpos.tolist()), tuple(body.xquat.tolist()))


def hand(cell: Cell) -> HoldingHand:
    found = cell.simulation.device("hand tandem/right")
    assert isinstance(found, HoldingHand)
    return found


@pytest.fixture
def cell() -> Cell:
    return Cell(tandem_cell(WITH_HANDS))


def put(cell: Cell, below: float) -> WorldPart:
    """Put a part below the grasp point by a distance [m] from its top."""
    part = cell.parts.all[0]
    x, y, z = tip(cell).position
    cell.parts.place(part, Pose((x, y, z - below - 0.0124)))
    return part


def test_part_in_reach_is_held_while_the_hand_is_closed(cell: Cell) -> None:
    part = put(cell, 0.01)
    close(cell, 1.0)
    go(cell, 0.5)
    assert hand(cell).part == part.name
    before = tip(cell).inverse() @ cell.parts.pose(part)
    cell.bus.publish("/left/joint_cmd", joint_state(["lift"], [0.25], time=0))
    go(cell, 3.0)
    after = tip(cell).inverse() @ cell.parts.pose(part)
    assert after.position == pytest.approx(before.position, abs=1e-3)
    height = cell.parts.pose(part).position[2]
    close(cell, 0.0)
    go(cell, 0.5)
    assert hand(cell).part is None
    assert cell.parts.pose(part).position[2] < height - 0.2


def test_part_out_of_reach_is_not_held(cell: Cell) -> None:
    part = put(cell, 0.06)
    close(cell, 1.0)
    go(cell, 0.5)
    assert hand(cell).part is None
    assert cell.parts.pose(part).position[2] < tip(cell).position[2] - 0.1


def test_closed_hand_does_not_take_a_part_that_comes_near(cell: Cell) -> None:
    close(cell, 1.0)
    go(cell, 0.1)
    put(cell, 0.01)
    go(cell, 0.1)
    assert hand(cell).part is None


def test_nearest_part_is_held(cell: Cell) -> None:
    near, far = cell.parts.all[:2]
    x, y, z = tip(cell).position
    cell.parts.place(far, Pose((x, y, z - 0.035)))
    cell.parts.place(near, Pose((x, y, z - 0.02)))
    close(cell, 1.0)
    go(cell, 0.02)
    assert hand(cell).part == near.name


def test_part_that_is_placed_elsewhere_is_no_longer_held(cell: Cell) -> None:
    part = put(cell, 0.01)
    close(cell, 1.0)
    go(cell, 0.1)
    cell.parts.take_from_cup(part)
    go(cell, 0.3)
    assert hand(cell).part is None
    assert cell.parts.pose(part).position[2] < tip(cell).position[2] - 0.1


def test_held_part_is_held_after_a_restore(cell: Cell) -> None:
    part = put(cell, 0.01)
    close(cell, 1.0)
    go(cell, 0.2)
    kept = cell.snapshot()
    close(cell, 0.0)
    go(cell, 0.2)
    cell.restore(kept)
    assert hand(cell).part == part.name
    go(cell, 0.2)
    relative = tip(cell).inverse() @ cell.parts.pose(part)
    assert np.linalg.norm(relative.position) < 0.05


def test_robot_without_hands_only_pushes() -> None:
    cell = Cell(tandem_cell())
    assert not any(name.startswith("hand ") for name in cell.simulation.devices)
    assert all(not part.grips for part in cell.parts.all)
