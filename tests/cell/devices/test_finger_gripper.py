"""Parallel gripper of an arm in a cell: it takes a part from a bin, holds it and lets go of it."""

from __future__ import annotations

import math
from functools import cache

import pytest

from cellwright import Cell
from cellwright.cell.devices.finger_gripper import FingerGripper
from cellwright.config.layout.arms import Arm, original_mount
from cellwright.running.run.collisions import CollisionWatch
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose
from tests.cell.arm_cells import finger_cell
from tests.cell.test_own_arm import Worker

CUBE = "bin1|cube_1"
MM = 1e-3


def gripper_of(cell: Cell) -> FingerGripper:
    assert isinstance(cell.gripper, FingerGripper)
    return cell.gripper


def palm_T_part(cell: Cell) -> Pose:
    cell.simulation.refresh()
    palm = cell.simulation.data.body("arm/gripper_palm")
    pose = Pose(tuple(palm.xpos.tolist()), tuple(palm.xquat.tolist()))
    return pose.inverse() @ cell.parts.pose(cell.parts.part(CUBE))


def pick(tool: str = "{kind: parallel}", mass: float = 0.5) -> Worker:
    """Return a worker whose gripper has closed on a cube in the bin."""
    worker = Worker(Cell(finger_cell(tool, mass)))
    worker.client.start_competition()
    worker.client.sleep(0.5)
    x, y, z = worker.cell.parts.pose(worker.cell.parts.part(CUBE)).position
    worker.go(x, y, z + 0.15, 1.5)
    worker.go(x, y, z + 0.02, 1.0)
    worker.client.control_gripper(True)
    worker.client.sleep(1.0)
    return worker


def carry(tool: str) -> tuple[str | None, float, str]:
    """Lift a cube of 1 kg and swing it for 5 s; return what is held then, its slip [mm] and the state hash."""
    worker = pick(tool, 1.0)
    cell = worker.cell
    worker.go(0.1, 0.6, 0.8, 1.0)
    before = palm_T_part(cell)
    for x in (-0.1, 0.1, -0.1, 0.1):
        worker.go(x, 0.6, 0.8, 0.95)
    slip = math.dist(before.position, palm_T_part(cell).position) / MM
    return gripper_of(cell).part, slip, cell.state_hash()


@cache
def carried(tool: str) -> tuple[str | None, float, str]:
    return carry(tool)


@pytest.mark.parametrize(("holds", "slip"), [("weld", 0.05), ("friction", 1.0)])
def test_cube_of_1_kg_is_carried_without_slipping(holds: str, slip: float) -> None:
    part, found, _ = carried(f"{{kind: parallel, holds: {holds}}}")
    assert part == CUBE
    assert found < slip


def test_same_run_ends_in_the_same_state() -> None:
    tool = "{kind: parallel, holds: friction}"
    assert carry(tool) == carried(tool)


def test_part_of_the_bin_is_placed_on_the_tray_and_handled_by_the_competition() -> None:
    worker = pick()
    cell = worker.cell
    watch = CollisionWatch(cell)
    worker.go(0.0, 0.6, 0.75, 1.0)
    worker.go(0.4, 0.0, 0.8, 1.5)
    worker.go(0.0, -0.6, 0.75, 1.5)
    worker.go(0.0, -0.6, 0.48, 1.0)
    assert gripper_of(cell).part == CUBE
    worker.client.control_gripper(False)
    worker.client.sleep(1.0)
    assert gripper_of(cell).lost_reason == "released"
    worker.go(0.0, -0.6, 0.75, 1.0)
    worker.client.sleep(1.0)
    tray = cell.trays[1]
    assert [each.name for each in cell.competition.tray_objects(tray)] == [CUBE]
    assert watch.end() == []
    assert worker.worst < 0.01


def test_run_goes_on_alike_from_a_snapshot_while_a_part_is_held() -> None:
    worker = pick()
    cell = worker.cell
    assert gripper_of(cell).attached
    before = cell.snapshot()
    ends = []
    for _ in range(2):
        cell.restore(before)
        cell.simulation.step_until(cell.simulation.now + 300_000_000)
        ends.append((gripper_of(cell).part, cell.state_hash()))
    assert ends[0] == ends[1]
    assert ends[0][0] == CUBE


def test_part_heavier_than_friction_bears_falls() -> None:
    worker = pick("{kind: parallel, force: 4}", 1.0)
    cell = worker.cell
    worker.go(0.0, 0.6, 0.75, 1.0)
    assert (gripper_of(cell).part, gripper_of(cell).lost_reason) == (None, "overload")
    assert cell.parts.pose(cell.parts.part(CUBE)).position[2] < 0.5


def test_part_that_is_placed_elsewhere_is_no_longer_held() -> None:
    cell = pick().cell
    cell.parts.place(cell.parts.part(CUBE), Pose((1.0, 1.0, 0.1)))
    assert (gripper_of(cell).attached, gripper_of(cell).lost_reason) == (False, "taken away")


def test_drop_region_makes_it_drop_the_part_where_it_says() -> None:
    cell = pick().cell
    target = Pose((0.2, 0.6, 0.46))
    gripper_of(cell).drop_target = lambda _name, _pose: target
    cell.simulation.step_until(cell.simulation.now + 20_000_000)
    assert (gripper_of(cell).attached, gripper_of(cell).lost_reason) == (False, "forced drop")
    assert math.dist(cell.parts.pose(cell.parts.part(CUBE)).position, target.position) < 5 * MM


def test_messages_have_both_fingers_behind_the_joints_of_the_arm() -> None:
    worker = Worker(Cell(finger_cell("{kind: parallel, opening: 0.06}")))
    worker.client.sleep(0.1)
    positions = worker.client.joint_positions
    assert [*positions][-2:] == ["left_finger_joint", "right_finger_joint"]
    assert positions["left_finger_joint"] == pytest.approx(0.03)
    assert "left_finger_joint" not in worker.cell.trial.joints
    states = [worker.client.gripper_enabled]
    worker.client.control_gripper(True)
    worker.client.sleep(1.0)
    assert [*states, worker.client.gripper_enabled] == [False, True]
    assert worker.client.joint_positions["right_finger_joint"] == pytest.approx(0.0, abs=0.3 * MM)


def test_arm_with_another_tool_is_refused() -> None:
    cell = Cell(finger_cell())
    with pytest.raises(UsageError, match="has no parallel gripper"):
        FingerGripper(cell.parts, Arm("arm", original_mount(Pose())))
