"""Arms of a cell on their mounts."""

import math
from dataclasses import replace

import pytest

import cellwright
from cellwright.config.layout.arms import Mount, Tool
from cellwright.config.trial.trial import Trial
from cellwright.mechanism.mounted_arm import MountedArm, mounted_arm
from cellwright.motion.joints import Joints
from cellwright.motion.kinematics import COMFORTABLE, face, forward
from cellwright.motion.mounts import FixedMount, RailMount
from cellwright.motion.ur_solver import UrSolver
from cellwright.util.pose import Pose
from tests.cell.arm_cells import PEDESTAL, ur5_cell


def arm_of(trial: Trial) -> MountedArm:
    return mounted_arm(trial.arms[0], trial.arm_models)


def test_arm_of_2017_is_that_of_the_kinematics() -> None:
    arm = arm_of(cellwright.load_trial("lesson"))
    assert isinstance(arm.mount, RailMount)
    assert isinstance(arm.solver, UrSolver)
    q = (0.3, -1.1, 1.4, 3.9, -1.5, 0.2)
    place = next(each for each in arm.mount.places(Pose(), 0.7) if each.position == 0.7)
    tool = place.world_T_base @ arm.chain.tool(q)
    gripper = forward(Joints(0.7, *q))
    assert tool.position == pytest.approx(face(gripper), abs=1e-9)
    down, up = tool.rotate((0.0, 0.0, 1.0)), gripper.rotate((0.0, 0.0, 1.0))
    assert down == pytest.approx([-each for each in up], abs=1e-9)
    assert arm.mount.comfortable == pytest.approx(COMFORTABLE, abs=0.003)
    assert arm.joints(0.7, q)["linear_arm_actuator_joint"] == 0.7
    assert [*arm.joints(0.7, q)][1:] == [joint.name for joint in arm.chain.joints]


def test_arm_on_a_pedestal_stands_where_its_mount_is() -> None:
    arm = arm_of(ur5_cell())
    assert isinstance(arm.mount, FixedMount)
    assert arm.rail == ""
    assert arm.mount.world_T_base.position == (0.0, 0.0, 0.5)
    assert arm.home == (0.0, -1.2, 1.6, -2.0, -1.57, 0.0)
    assert arm.joints(0.0, arm.home).keys() == {joint.name for joint in arm.chain.joints}


def test_tool_is_the_face_of_the_cup_or_else_the_tip() -> None:
    trial = ur5_cell()
    (arm,) = trial.arms
    tips = {
        kind: mounted_arm(replace(arm, tool=Tool(kind, 0.1)), trial.arm_models).chain.base_T_tool
        for kind in ("vacuum", "none")
    }
    assert tips["none"].transform((0.0, 0.0, 0.1)) == pytest.approx(tips["vacuum"].position, abs=1e-9)
    ahead = (0.0, 0.0, 1.0)
    assert tips["none"].rotate(ahead) == pytest.approx(tips["vacuum"].rotate(ahead), abs=1e-9)


def test_tool_of_fingers_is_the_middle_between_their_pads() -> None:
    text = PEDESTAL.replace("      tip: tool0\n", "      tip: tool0\n      tool: {{kind: parallel, length: 0.1}}\n")
    fingers, cup = arm_of(ur5_cell(text)), arm_of(ur5_cell())
    assert fingers.chain.base_T_tool.position == pytest.approx(cup.chain.base_T_tool.position, abs=1e-9)
    assert [joint.name for joint in fingers.chain.joints] == [joint.name for joint in cup.chain.joints]


def test_rail_of_an_own_arm_lies_along_its_axis() -> None:
    trial = ur5_cell()
    mount = Mount("rail", Pose.from_rpy((1.0, 0.0, 0.5), (0.0, 0.0, math.pi / 2)), axis="x", range=(-0.5, 0.8))
    arm = mounted_arm(replace(trial.arms[0], mount=mount), trial.arm_models)
    assert arm.rail == "rail_joint"
    ends = sorted(arm.mount.places(Pose(), arm.position))
    assert (ends[0].position, ends[-1].position) == (-0.5, 0.8)
    assert ends[0].world_T_base.position == pytest.approx((1.0, -0.5, 0.5))
    assert ends[-1].world_T_base.position == pytest.approx((1.0, 0.8, 0.5))
