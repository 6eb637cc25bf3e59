"""Links of a parallel gripper in a description: the same places as in the engine."""

import mujoco
import pytest

from cellwright import Cell
from cellwright.config.gripper import ParallelGripperSettings
from cellwright.config.gripper_links import GripperNames, gripper_links, palm_T_grasp
from cellwright.config.layout.arm_models import chain_in_engine, home_of, joints_of
from cellwright.config.robot.model import link_poses
from tests.cell.arm_cells import finger_cell


def test_joints_of_the_fingers_open_by_half_each() -> None:
    links, (palm, *fingers) = gripper_links(ParallelGripperSettings(opening=0.08), GripperNames("a_"), "flange", 0.05)
    assert [*links] == ["a_gripper_palm", "a_left_finger", "a_right_finger"]
    assert (palm.parent, palm.origin.position) == ("flange", (0.0, 0.0, 0.05))
    assert [each.limits.upper for each in fingers] == [0.04, 0.04]
    assert [each.axis for each in fingers] == [(0.0, 1.0, 0.0), (0.0, -1.0, 0.0)]
    # a rod reaches back to the flange
    assert [each.kind for each in links["a_gripper_palm"].shapes] == ["box", "cylinder"]


def test_links_are_where_the_engine_has_them() -> None:
    cell = Cell(finger_cell("{kind: parallel, length: 0.15}"))
    (arm,) = cell.trial.arms
    home = home_of(arm, joints_of(arm, cell.trial.arm_models))
    positions = {arm.prefix + name: value for name, value in home.items()} | dict.fromkeys(
        arm.gripper_names.joints, 0.05
    )
    chain = chain_in_engine(arm, cell.trial.arm_models)
    poses = link_poses(chain, positions)
    data = cell.simulation.data
    mujoco.mj_kinematics(cell.simulation.model, data)
    names = arm.gripper_names
    for name in (names.palm, *names.fingers):
        found = arm.pose @ poses[name]
        assert data.body(name).xpos.tolist() == pytest.approx(list(found.position), abs=1e-9)
    tip_T_grasp = poses[f"{arm.prefix}tool0"].inverse() @ poses[names.palm] @ palm_T_grasp(ParallelGripperSettings())
    assert tip_T_grasp.position == pytest.approx((0.0, 0.0, 0.15), abs=1e-12)
