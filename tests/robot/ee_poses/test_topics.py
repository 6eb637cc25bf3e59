import math
from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.middleware.messages.conversions import header, pose_message
from cellwright.middleware.messages.standard import Point, PoseArray, Quaternion
from cellwright.middleware.messages.standard import Pose as PoseMessage
from cellwright.robot.node import RobotNode, RobotSettings
from cellwright.robot.safety import SafetySettings
from cellwright.util.errors import RejectedCommandError
from cellwright.util.pose import Pose
from tests.robot.bundled import apart, tips
from tests.robot.robots import two_arms

COMMAND, STATE = "/io_teleop/target_ee_poses", "/io_teleop/state_ee_poses"
NAN, INFINITE = math.nan, math.inf


@pytest.fixture(scope="module")
def shared() -> RobotNode:
    return RobotNode(two_arms())


@pytest.fixture
def node(shared: RobotNode) -> RobotNode:
    shared.simulation.reset()
    return shared


def pose_array(poses: list[Pose], frame: str = "") -> PoseArray:
    return PoseArray(header(frame), [pose_message(pose) for pose in poses])


def raw_pose(*numbers: float) -> PoseMessage:
    return PoseMessage(Point(*numbers[:3]), Quaternion(*numbers[3:]))


def received_messages(node: RobotNode, seconds: float = 0.02) -> list[Any]:
    found: list[Any] = []
    subscription = node.bus.subscribe(STATE, found.append)
    node.simulation.step_until(node.simulation.now + round(seconds * 1e9))
    subscription.cancel()
    return found


def test_ee_poses_are_published_at_100_hz_and_equal_kinematics(node: RobotNode) -> None:
    messages = received_messages(node, 0.5)
    assert len(messages) == 50
    assert messages[0].header.frame_id == "base"
    assert messages[0].header.stamp.nanosec == pytest.approx(10_000_000, abs=5_000_000)
    for message, expected in zip(messages[-1].poses, tips(node.config, node.config.start), strict=True):
        p, q = message.position, message.orientation
        assert apart(Pose((p.x, p.y, p.z), (q.w, q.x, q.y, q.z)), expected) == pytest.approx((0.0, 0.0), abs=1e-6)


def test_published_poses_sent_as_command_do_not_move_arms(node: RobotNode) -> None:
    before = node.servos.read().positions
    node.bus.publish(COMMAND, received_messages(node)[-1])
    node.simulation.step_until(node.simulation.now + 200_000_000)
    assert node.servos.read().positions == pytest.approx(before, abs=1e-6)
    assert node.ee_poses.targets[0] is not None


def test_poses_are_relative_to_moved_base(node: RobotNode) -> None:
    before = node.ee_poses.poses()
    node.bus.publish(COMMAND, pose_array(before))
    joints = node.servos.read().positions
    node.base.command([0.5, 0.3])
    node.simulation.step_until(node.simulation.now + 300_000_000)
    assert node.servos.read().positions == pytest.approx(joints, abs=1e-6)
    for pose, expected in zip(node.ee_poses.poses(), before, strict=True):
        assert apart(pose, expected) == pytest.approx((0.0, 0.0), abs=1e-6)


@pytest.mark.parametrize(
    ("count", "why"),
    [(0, "poses must have 2 poses, right, left .got 0."), (1, "got 1"), (3, "got 3"), (5000, "got 5000")],
)
def test_wrong_number_of_poses_is_refused(node: RobotNode, count: int, why: str) -> None:
    with pytest.raises(RejectedCommandError, match=why.replace("(", r"\(").replace(")", r"\)")):
        node.bus.publish(COMMAND, pose_array([Pose()] * count))
    assert node.ee_poses.targets == (None, None)


def test_robot_with_one_arm_takes_one_pose() -> None:
    config = two_arms()
    one = replace(config, arms=config.arms[:1], command_links=("tip_right",), reference_links=("torso",))
    node = RobotNode(one)
    tip_poses = node.ee_poses.poses()
    node.bus.publish(COMMAND, pose_array([Pose((0.01, 0.0, 0.0)) @ tip_poses[0]]))
    with pytest.raises(RejectedCommandError, match=r"poses must have 1 pose .got 2."):
        node.bus.publish(COMMAND, pose_array(tip_poses * 2))
    assert len(received_messages(node)[0].poses) == 1


@pytest.mark.parametrize(
    ("numbers", "why"),
    [
        ((NAN, 0, 0, 0, 0, 0, 1), r"poses\[1\] must be finite"),
        ((0, INFINITE, 0, 0, 0, 0, 1), r"poses\[1\] must be finite"),
        ((0, 0, 0, 0, 0, 0, NAN), r"poses\[1\] must be finite"),
        ((0, 0, 0, 0, 0, 0, 0), r"poses\[1\].orientation must be a quaternion"),
        ((0, 0, 0, 0, 0, 0, 1e-300), r"poses\[1\].orientation must be a quaternion"),
        ((0, 0, 1e300, 0, 0, 0, 1), r"poses\[1\].position must be within 1000 m"),
    ],
)
def test_invalid_pose_is_refused_with_whole_message(node: RobotNode, numbers: tuple[float, ...], why: str) -> None:
    good = pose_message(node.ee_poses.poses()[0])
    message = PoseArray(header(), [good, raw_pose(*map(float, numbers))])
    with pytest.raises(RejectedCommandError, match=why):
        node.bus.publish(COMMAND, message)
    assert node.ee_poses.targets == (None, None)


finite = st.floats(allow_nan=True, allow_infinity=True)


@given(numbers=st.lists(finite, min_size=14, max_size=14))
@settings(max_examples=40, deadline=None)
def test_random_poses_keep_joints_finite(shared: RobotNode, numbers: list[float]) -> None:
    message = PoseArray(header(), [raw_pose(*numbers[:7]), raw_pose(*numbers[7:])])
    try:
        shared.bus.publish(COMMAND, message)
    except RejectedCommandError:
        return
    for _ in range(5):
        shared.simulation.step()
    assert all(map(math.isfinite, shared.servos.read().positions.tolist()))


def test_quaternion_of_other_length_is_normalized(node: RobotNode) -> None:
    right, left = (pose_message(pose) for pose in node.ee_poses.poses())
    q = right.orientation
    longer = PoseMessage(right.position, Quaternion(*(7.0 * value for value in (q.x, q.y, q.z, q.w))))
    node.bus.publish(COMMAND, PoseArray(header(), [longer, left]))
    target = node.ee_poses.targets[0]
    assert target is not None
    assert math.hypot(*target.quaternion) == pytest.approx(1.0)


def test_frame_id_of_link_applies_and_others_are_ignored(node: RobotNode) -> None:
    begin = node.ee_poses.poses()
    ahead = Pose((0.01, 0.0, 0.0))
    node.bus.publish(COMMAND, pose_array([ahead, ahead], "tip_right"))  # in the frame of the tool, as for jogging
    right = node.ee_poses.targets[0]
    assert right is not None
    assert apart(right, begin[0] @ ahead) == pytest.approx((0.0, 0.0), abs=1e-9)
    for frame in ("", "world", "nowhere/at all"):
        node.bus.publish(COMMAND, pose_array(begin, frame))
        for target, pose in zip(node.ee_poses.targets, begin, strict=True):
            assert target is not None
            assert apart(target, pose) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_poses_are_ignored_while_disabled(node: RobotNode) -> None:
    ignored = node.commander.ignored
    node.commander.set_enabled(False)
    node.bus.publish(COMMAND, pose_array(node.ee_poses.poses()))
    assert node.ee_poses.targets == (None, None)
    assert node.commander.ignored == ignored + 1


def test_arms_hold_without_poses_and_resume_with_next() -> None:
    guarded_node = RobotNode(two_arms(), RobotSettings(safety=SafetySettings(silence=0.1, tip_speed=0.1)))
    far = pose_array([Pose((-0.2, 0.0, 0.0)) @ pose for pose in guarded_node.ee_poses.poses()])
    guarded_node.bus.publish(COMMAND, far)
    guarded_node.simulation.step_until(300_000_000)
    assert guarded_node.ee_poses.targets == (None, None)
    held = guarded_node.servos.read().positions
    guarded_node.simulation.step_until(400_000_000)
    assert guarded_node.servos.read().positions == pytest.approx(held, abs=1e-3)
    guarded_node.bus.publish(COMMAND, far)
    guarded_node.simulation.step_until(480_000_000)
    assert guarded_node.servos.read().positions != pytest.approx(held, abs=2e-3)


def test_tip_speed_limits_tip() -> None:
    node = RobotNode(two_arms(), RobotSettings(safety=SafetySettings(tip_speed=0.1), timestep=Fraction(1, 240)))
    begin = node.ee_poses.poses()
    node.bus.publish(COMMAND, pose_array([Pose((-0.1, 0.0, 0.0)) @ pose for pose in begin]))
    node.simulation.step_until(500_000_000)
    distance, _ = apart(node.ee_poses.poses()[0], begin[0])
    assert 0.03 < distance < 0.051
