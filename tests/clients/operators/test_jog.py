"""Keys as orders, to a fake robot."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.operators.keyboard import JOINT_STEPS, TIP_STEPS, Jog
from cellwright.clients.operators.robot import Ask, JointLimits, MoveGrippers, MoveJoints, MoveTips, Now, OperatedRobot
from cellwright.config.robot.model import Limits
from cellwright.util.pose import Pose

KEYS = [*"xXyYzZrRpPwW/tf-+=oc,.Hed uqj", "up", "down", "left", "right", "pageup", "pagedown", "home", "end"]
KEYS += ["enter", "escape", "backspace", "tab", "ctrl-c"]


@dataclass
class FakeRobot:
    """A robot of four joints, as its operator sees it."""

    joints: tuple[str, ...] = ("head_yaw", "arm_r_1", "arm_r_2", "slide")
    positions: dict[str, float] = field(
        default_factory=lambda: {"head_yaw": 0.0, "arm_r_1": 1.0, "arm_r_2": -0.5, "slide": 0.2}
    )
    grippers: tuple[float, ...] = (0.3, 0.0)
    tips: tuple[Pose, ...] = (Pose((0.5, -0.2, 0.3)), Pose.from_rpy((0.5, 0.2, 0.3), (0.0, 0.0, math.pi / 2)))
    reason: str = ""
    applied: dict[str, float] = field(default_factory=dict)

    def why_not(self) -> str:
        return self.reason


LIMITS = JointLimits({"head_yaw": Limits(-0.04, 1.5), "slide": Limits(0.0, 0.4)}, "test")


@pytest.fixture
def robot() -> FakeRobot:
    return FakeRobot()


@pytest.fixture
def jog(robot: FakeRobot) -> Jog:
    return Jog(cast("OperatedRobot", robot), LIMITS)


def near(value: float) -> float:
    """Return a number that equals all close to it."""
    return cast("float", pytest.approx(value))


def pressed(jog: Jog, *keys: str) -> list[object]:
    return [jog.press(key) for key in keys]


@pytest.mark.parametrize("key", KEYS)
def test_node_without_joints_is_noted_for_any_key(key: str, jog: Jog, robot: FakeRobot) -> None:
    names, robot.joints = robot.joints, ()
    order = jog.press(key)
    assert not isinstance(order, MoveJoints)
    assert jog.joint == ""
    assert jog.note == "the node publishes no joints" or key not in ("left", "right")
    robot.joints = names
    assert jog.joint == names[0]


def test_first_step_starts_at_measured_position_and_next_at_target(jog: Jog, robot: FakeRobot) -> None:
    assert pressed(jog, "down", "right") == [None, MoveJoints({"arm_r_1": 1.02})]
    robot.positions["arm_r_1"] = 1.01  # on its way
    assert jog.press("right") == MoveJoints({"arm_r_1": near(1.04)})
    assert jog.press("left") == MoveJoints({"arm_r_1": near(1.02)})


def test_step_after_forget_starts_at_measured_position(jog: Jog, robot: FakeRobot) -> None:
    pressed(jog, "down", "right", "right")
    robot.positions["arm_r_1"] = -0.7
    jog.forget()
    assert jog.press("right") == MoveJoints({"arm_r_1": near(-0.68)})


def test_target_of_blocked_joint_stays_near_it(jog: Jog) -> None:
    jog.press("down")
    orders = [jog.press("right") for _ in range(40)]
    assert orders[-1] == MoveJoints({"arm_r_1": near(1.2)})
    assert jog.note == "arm_r_1 is blocked at 1.000"
    assert jog.press("left") == MoveJoints({"arm_r_1": near(1.18)})


def test_target_stays_within_known_limits(jog: Jog) -> None:
    assert pressed(jog, "left", "left", "left")[-1] == MoveJoints({"head_yaw": -0.04})
    assert jog.note == "head_yaw is at its limit"


def test_largest_step_is_tenth_of_range(jog: Jog) -> None:
    pressed(jog, "end", "+", "+", "+")
    assert jog.joint == "slide"
    assert JOINT_STEPS[jog.size] == 0.2
    assert jog.press("right") == MoveJoints({"slide": near(0.24)})


def test_step_size_has_minimum_and_maximum(jog: Jog) -> None:
    pressed(jog, *9 * "-")
    assert jog.size == 0
    pressed(jog, *9 * "+", "=")
    assert jog.size == len(JOINT_STEPS) - 1


def test_joint_of_unknown_position_is_not_moved(jog: Jog, robot: FakeRobot) -> None:
    del robot.positions["head_yaw"]
    assert jog.press("right") is None
    assert jog.note == "the node publishes no position of head_yaw"


def test_joints_are_selected_by_arrows_and_search(jog: Jog) -> None:
    pressed(jog, "up")
    assert jog.joint == "head_yaw"
    pressed(jog, "pagedown")
    assert jog.joint == "slide"
    pressed(jog, "/", "R", "_", "2")
    assert (jog.joint, jog.search) == ("arm_r_2", "R_2")
    assert jog.press("q") is None  # a letter like any other, here
    assert jog.note == "no joint has 'R_2q' in its name"
    pressed(jog, "backspace", "backspace", "1", "enter")
    assert (jog.joint, jog.search) == ("arm_r_2", None)  # "R1" is in no name
    assert jog.press("q") is Now.QUIT


def test_tip_moves_along_base_axes_and_other_tip_stays(jog: Jog, robot: FakeRobot) -> None:
    order = jog.press("z")
    assert order == MoveTips((Pose((0.5, -0.2, near(0.305))), robot.tips[1]))
    robot.tips = (Pose((0.51, -0.2, 0.302)), Pose((0.9, 0.9, 0.9)))  # noise, on the way
    order = jog.press("X")
    assert isinstance(order, MoveTips)
    assert order.tips[0].position == pytest.approx((0.495, -0.2, 0.305))
    assert order.tips[1].position == (0.5, 0.2, 0.3)


def test_tip_moves_along_its_own_axes_after_frame_key(jog: Jog) -> None:
    order = pressed(jog, "t", "f", "x")[-1]
    assert isinstance(order, MoveTips)
    assert order.tips[1].position == pytest.approx((0.5, 0.2 + TIP_STEPS[1], 0.3))


@pytest.mark.parametrize(("key", "axis"), [("r", 0), ("p", 1), ("w", 2)])
def test_tip_turns_about_axis_and_back(key: str, axis: int, jog: Jog, robot: FakeRobot) -> None:
    there = jog.press(key)
    assert isinstance(there, MoveTips)
    assert there.tips[0].rpy[axis] == pytest.approx(JOINT_STEPS[1])
    assert there.tips[0].position == robot.tips[0].position
    back = jog.press(key.upper())
    assert isinstance(back, MoveTips)
    assert back.tips[0].quaternion == pytest.approx(robot.tips[0].quaternion, abs=1e-12)


def test_target_of_blocked_tip_stays_near_it(jog: Jog) -> None:
    orders = pressed(jog, *60 * "x")
    assert orders[-1] is None
    assert jog.note == "the tip is blocked, or the pose is out of reach"
    last = [order for order in orders if order is not None][-1]
    assert isinstance(last, MoveTips)
    assert last.tips[0].position[0] <= 0.6 + 1e-9


def test_joint_steps_and_tip_steps_reset_each_other(jog: Jog, robot: FakeRobot) -> None:
    pressed(jog, "down", "right", "right")
    jog.press("x")
    robot.positions["arm_r_1"] = 0.5
    assert jog.press("right") == MoveJoints({"arm_r_1": near(0.52)})
    robot.tips = (Pose((0.1, 0.1, 0.1)), robot.tips[1])
    order = jog.press("x")
    assert isinstance(order, MoveTips)
    assert order.tips[0].position == pytest.approx((0.105, 0.1, 0.1))


def test_grippers_open_close_and_step_within_range(jog: Jog) -> None:
    assert jog.press("c") == MoveGrippers((1.0, 0.0))
    assert jog.press(",") == MoveGrippers((0.95, 0.0))
    assert jog.press("o") == MoveGrippers((0.0, 0.0))
    assert pressed(jog, "t", ".", ".")[-1] == MoveGrippers((0.0, near(0.1)))


def test_unpublished_tips_and_grippers_are_not_moved(jog: Jog, robot: FakeRobot) -> None:
    robot.tips, robot.grippers = (), ()
    assert pressed(jog, "t", "x") == [None, None]
    assert "state_ee_poses" in jog.note
    assert jog.press("c") is None
    assert "gripper_states" in jog.note


def test_keys_call_services(jog: Jog) -> None:
    assert pressed(jog, *"Hedu") == [Ask.HOME, Ask.ENABLE, Ask.DISABLE, Ask.CLEAR_STOP]


def test_node_that_takes_no_commands_gets_none(jog: Jog, robot: FakeRobot) -> None:
    jog.press("right")
    robot.reason = "the emergency stop is active"
    assert pressed(jog, "right", "x", "c") == [None, None, None]
    assert jog.note == "not sent: the emergency stop is active"
    assert jog.press("u") is Ask.CLEAR_STOP
    robot.reason, robot.positions["head_yaw"] = "", 0.5
    assert jog.press("right") == MoveJoints({"head_yaw": near(0.52)})


def test_emergency_stop_key_works_in_every_state(jog: Jog, robot: FakeRobot) -> None:
    robot.reason = "it is not enabled"
    pressed(jog, "/", "a")
    assert jog.press(" ") is Now.STOP
    assert jog.search is None
    assert pressed(jog, "/", "ctrl-c")[-1] is Now.QUIT


@given(keys=st.lists(st.sampled_from(KEYS), max_size=60))
def test_any_keys_keep_targets_within_limits_and_near_robot(keys: list[str]) -> None:
    robot = FakeRobot()
    jog = Jog(cast("OperatedRobot", robot), LIMITS)
    for key in keys:
        order = jog.press(key)
        if isinstance(order, MoveJoints):
            for name, target in order.targets.items():
                assert LIMITS.clamped(name, target) == target
                assert abs(target - robot.positions[name]) <= 0.6 + 1e-9
        elif isinstance(order, MoveTips):
            assert all(
                math.dist(tip.position, at.position) <= 0.151 for tip, at in zip(order.tips, robot.tips, strict=True)
            )
            assert all(math.hypot(*tip.quaternion) == pytest.approx(1.0) for tip in order.tips)
        elif isinstance(order, MoveGrippers):
            assert all(0.0 <= closed <= 1.0 for closed in order.closed)
