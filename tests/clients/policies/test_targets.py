"""Targets from actions: scales, steps, polarity of grippers, and poses of the tool through inverse kinematics."""

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright import load_trial
from cellwright.cell.interface.commands import layout_json
from cellwright.clients.policies.key_map import KeyMap, Part, Skip, ToChannels, ToGripper, ToTool
from cellwright.clients.policies.targets import Targets, ToolArm
from cellwright.config.control import Channel, ControlSpace
from cellwright.config.layout.data import value_of
from cellwright.motion.chain import Chain
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose, quaternion_from_rpy

TRIAL = load_trial("lesson")
SPACE = ControlSpace.of(TRIAL)
CHAIN: Chain = value_of(Chain, json.loads(layout_json(TRIAL))["chains"]["arm"], "chain")
BASE = TRIAL.arms[0].pose
ARM = ToolArm(CHAIN, BASE, tuple(range(7)))
HOME = [0.0, 3.14, -1.13, 1.51, 3.77, -1.51, 0.0, 0.0]
WIDTH = Channel("width", "width", "m", 0.0, 0.08)


def targets(*parts: Part, space: ControlSpace = SPACE) -> Targets:
    found = Targets(KeyMap({}, parts), space, {"arm": ARM})
    found.begin(HOME[: len(space.channels)])
    return found


def take(made: Targets, *numbers: float) -> list[float]:
    return made.take(np.array(numbers))


def test_absolute_numbers_are_scaled_and_moved() -> None:
    made = targets(ToChannels(("elbow_joint",), scale=2.0, offset=0.5), Skip(2))
    assert take(made, 0.25, 9.0, 9.0)[3] == 1.0
    assert take(made, 0.25, 9.0, 9.0)[:3] == HOME[:3]


def test_steps_go_on_from_the_last_targets() -> None:
    made = targets(ToChannels(("elbow_joint",), steps=True, scale=0.1))
    assert take(made, 1.0)[3] == pytest.approx(1.61)
    assert take(made, 1.0)[3] == pytest.approx(1.71)
    assert take(made, 0.0)[3] == pytest.approx(1.71)


def test_targets_stay_within_their_ranges_and_steps_do_not_add_up_beyond() -> None:
    made = targets(ToChannels(("linear_arm_actuator_joint",), steps=True))
    assert take(made, 99.0)[0] == SPACE.channels[0].high
    assert take(made, -1.0)[0] == pytest.approx(SPACE.channels[0].high - 1.0)


@pytest.mark.parametrize(
    ("part", "number", "value"),
    [
        (ToGripper("suction"), 0.6, 1.0),
        (ToGripper("suction"), 0.5, 0.0),
        (ToGripper("suction", 0.0), 1.0, 1.0),  # LIBERO: -1 open, +1 closed
        (ToGripper("suction", 0.5, closes_above=False), 0.4, 1.0),  # 1 open, as in OpenVLA
    ],
)
def test_gripper_closes_by_threshold_and_side(part: ToGripper, number: float, value: float) -> None:
    assert take(targets(part), number)[7] == value


def test_fingers_that_close_have_no_width() -> None:
    made = targets(ToGripper("width"), space=ControlSpace((WIDTH,)))
    assert (take(made, 1.0), take(made, 0.0)) == ([0.0], [0.08])


def test_another_count_of_numbers_is_refused() -> None:
    with pytest.raises(UsageError, match=r"must have 1 numbers \(got 2\)"):
        take(targets(ToGripper("suction")), 1.0, 2.0)


def test_no_rotation_is_refused() -> None:
    with pytest.raises(UsageError, match="rot6d"):
        take(targets(ToTool("arm", "rot6d")), 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def tool(values: list[float]) -> Pose:
    return BASE @ ARM.base_T_tool(values)


def distance(a: Pose, b: Pose) -> float:
    return math.dist(a.position, b.position)


def test_step_of_the_tool_along_the_world_moves_it_there_and_turns_nothing() -> None:
    before = tool(HOME)
    after = tool(take(targets(ToTool("arm", steps=True, frame="world", scale=0.05)), 0, 0, -1, 0, 0, 0))
    assert np.subtract(after.position, before.position) == pytest.approx((0.0, 0.0, -0.05), abs=1e-5)
    assert before.relative(after).rpy == pytest.approx((0.0, 0.0, 0.0), abs=1e-5)


def test_turn_of_the_tool_about_the_world_keeps_its_place() -> None:
    before = tool(HOME)
    after = tool(take(targets(ToTool("arm", steps=True, frame="world", turn_scale=0.1)), 0, 0, 0, 0, 0, 1))
    turn = Pose((0.0, 0.0, 0.0), quaternion_from_rpy(0.0, 0.0, 0.1))
    expected = Pose((0.0, 0.0, 0.0), before.quaternion)
    assert distance(before, after) < 1e-5
    assert (turn @ expected).relative(Pose(quaternion=after.quaternion)).rpy == pytest.approx((0, 0, 0), abs=1e-5)


def test_step_in_the_frame_of_the_tool_goes_along_its_own_axis() -> None:
    before = tool(HOME)
    after = tool(take(targets(ToTool("arm", "none", steps=True, frame="tool", scale=0.02)), 1, 0, 0))
    assert before.relative(after).position == pytest.approx((0.02, 0.0, 0.0), abs=1e-5)


@given(
    x=st.floats(-0.1, 0.1), y=st.floats(-0.1, 0.1), z=st.floats(-0.1, 0.1), yaw=st.floats(-0.3, 0.3),
    frame=st.sampled_from(("base", "world")),
)  # fmt: skip
@settings(max_examples=25)
def test_absolute_pose_is_reached(x: float, y: float, z: float, yaw: float, frame: str) -> None:
    frame_T = Pose() if frame == "base" else BASE
    present = frame_T @ ARM.base_T_tool(HOME)
    px, py, pz = present.position
    goal = Pose((px + x, py + y, pz + z), (Pose(quaternion=quaternion_from_rpy(0, 0, yaw)) @ present).quaternion)
    w, qx, qy, qz = goal.quaternion
    made = targets(ToTool("arm", "quaternion_xyzw", frame=frame))
    reached = frame_T @ ARM.base_T_tool(take(made, *goal.position, qx, qy, qz, w))
    assert distance(reached, goal) < 1e-4
    assert goal.relative(reached).rpy == pytest.approx((0.0, 0.0, 0.0), abs=1e-4)


def test_pose_out_of_reach_leaves_the_joints_within_their_limits() -> None:
    made = targets(ToTool("arm", "none", frame="world"))
    found = take(made, 50.0, 0.0, 1.0)
    assert all(math.isfinite(value) for value in found)
    for channel, value in zip(SPACE.channels, found, strict=True):
        assert channel.low <= value <= channel.high
