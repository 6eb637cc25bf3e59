"""Acceptance: a robot's node beside a real roscore, driven by unmodified programs of ROS 1."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeAlias

import pytest

from cellwright.middleware.messages import TYPES
from tests.ros1.ground import Ground, ground
from tests.ros1.handshake import publisher_header, service_header
from tests.support.waiting import TIMEOUT, wait_until

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

NODE = "/sim_robot_controller_node"
HOME = "/io_teleop_reset_robot"
JOINTS = json.loads((Path(__file__).parents[1] / "data" / "qinglong_joints.json").read_text())
Command: TypeAlias = tuple[str, list[str], list[float]]
"""Topic, names and positions."""

RIGHT_HAND, LEFT_HAND = ("rh_FFJ2", "rh_LFJ1", "rh_THJ2"), ("lh_FFJ2", "lh_LFJ1", "lh_THJ2")


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory, ros1_messages: Path) -> Iterator[Ground]:
    """The QingLong beside a whole roscore."""
    with ground(tmp_path_factory.mktemp("teleop"), ros1_messages, roscore=True) as made:
        made.teleop("qinglong")
        yield made


def test_rostopic_list_shows_topics_of_robot(robot: Ground) -> None:
    topics = robot.tool("rostopic", "list").split()
    assert {
        "/io_teleop/joint_cmd",
        "/io_teleop/joint_states",
        "/io_teleop/target_gripper_status",
        "/io_teleop/target_joint_from_vr",
    } <= set(topics)
    assert "/clock" not in topics
    assert NODE in robot.tool("rosnode", "list").split()
    assert not robot.ask("hasParam", "/use_sim_time")


def test_robot_topics_have_types_and_checksums_of_ros(robot: Ground) -> None:
    types = dict(robot.ask("getTopicTypes"))
    joints = ["/io_teleop/joint_states", "/io_teleop/joint_cmd", "/io_teleop/target_joint_from_vr"]
    assert {types[name] for name in [*joints, "/io_teleop/target_gripper_status"]} == {"sensor_msgs/JointState"}
    assert publisher_header(robot, "/io_teleop/joint_states", NODE)["md5sum"] == TYPES.md5("sensor_msgs/JointState")
    found = service_header(robot, HOME)
    assert (found["type"], found["md5sum"]) == ("std_srvs/Trigger", TYPES.md5("std_srvs/Trigger"))


def test_robot_description_is_global_and_own_parameter(robot: Ground) -> None:
    text = robot.ask("getParam", "/robot_description")
    assert text == robot.ask("getParam", f"{NODE}/robot_description")
    assert '<robot name="QingLong">' in text


def listen(count: int) -> dict[str, Any]:
    """Return a number of joint states, and the wall time of each [s]."""
    import time

    import rospy
    from sensor_msgs.msg import JointState

    rospy.init_node("listener", anonymous=True)
    came = []
    rospy.Subscriber(
        "/io_teleop/joint_states", JointState, lambda message: came.append((time.time(), message)), tcp_nodelay=True
    )
    begin = time.time()
    wait_until(lambda: len(came) >= count, "joint states")
    newest = came[-1][1]
    return {
        "begin": begin,
        "came": [then for then, _ in came],
        "stamps": [message.header.stamp.to_sec() for _, message in came],
        "numbers": [message.header.seq for _, message in came],
        "names": newest.name,
        "lengths": [len(newest.position), len(newest.velocity), len(newest.effort)],
    }


def test_joint_states_are_consecutive_with_wall_time(robot: Ground) -> None:
    """`test_a_node_that_is_killed_in_mid_motion_leaves_nothing` checks their rate, in simulation time."""
    found = robot.client(listen, 100).value()
    assert found["stamps"] == sorted(set(found["stamps"]))
    assert found["stamps"][-1] > found["begin"]
    for stamp, came in zip(found["stamps"], found["came"], strict=True):
        assert stamp < came + 0.005
    assert found["numbers"] == list(range(found["numbers"][0], found["numbers"][0] + len(found["numbers"])))
    assert found["names"] == [joint["joint"] for joint in JOINTS if joint["type"] != "fixed"]
    assert found["lengths"] == [75, 75, 75]


def drive(commands: list[Command], goals: list[dict[str, float]]) -> dict[str, list[float]]:
    """From home, send each command; return the joints before, and after each, once those of its goal have arrived."""
    import rospy
    from sensor_msgs.msg import JointState
    from std_srvs.srv import Trigger

    rospy.init_node("driver", anonymous=True)
    rospy.ServiceProxy("/io_teleop_reset_robot", Trigger)()
    publishers = {topic: rospy.Publisher(topic, JointState, queue_size=10) for topic, _, _ in commands}
    states: list[Any] = []
    rospy.Subscriber("/io_teleop/joint_states", JointState, states.append)
    wait_until(lambda: states and all(each.get_num_connections() for each in publishers.values()), "connections")

    def at() -> dict[str, float]:
        return dict(zip(states[-1].name, states[-1].position))  # noqa: B905 - the Python of ROS may be an old one

    seen = [at()]
    for (topic, names, positions), goal in zip(commands, goals):  # noqa: B905
        publishers[topic].publish(JointState(name=names, position=positions))
        wait_until(lambda: all(abs(at()[name] - goal[name]) < 0.005 for name in goal), "posture", seen=at)  # noqa: B023
        seen.append(at())
    return {name: [positions[name] for positions in seen] for name in seen[0]}


def moved(found: dict[str, list[float]]) -> set[str]:
    return {name for name, seen in found.items() if max(seen) - min(seen) > 0.01}


def test_commands_may_name_any_joints_in_any_order(robot: Ground) -> None:
    commands: list[Command] = [
        ("/io_teleop/joint_cmd", ["J_arm_l_04", "J_arm_r_04", "J_waist_yaw"], [1.2, 2.0, 0.2]),
        ("/io_teleop/target_joint_from_vr", ["J_head_yaw", "no_such_joint", "J_head_pitch"], [0.4, 1.0, -0.3]),
    ]
    first = {"J_arm_l_04": 1.2, "J_arm_r_04": 2.0, "J_waist_yaw": 0.2}
    found = robot.client(drive, commands, [first, {**first, "J_head_yaw": 0.4, "J_head_pitch": -0.3}]).value()
    ends = {name: (seen[0], seen[-1]) for name, seen in found.items()}
    assert ends["J_arm_l_04"] == pytest.approx((1.7, 1.2), abs=0.01)
    assert ends["J_arm_r_04"] == pytest.approx((1.7, 2.0), abs=0.01)
    assert ends["J_waist_yaw"] == pytest.approx((0.0, 0.2), abs=0.01)
    assert ends["J_head_yaw"] == pytest.approx((0.0, 0.4), abs=0.01)
    assert ends["J_head_pitch"] == pytest.approx((0.0, -0.3), abs=0.01), "what stands behind an unknown name counts"
    assert moved(found) == {"J_arm_l_04", "J_arm_r_04", "J_waist_yaw", "J_head_yaw", "J_head_pitch"}


def test_gripper_command_has_order_right_left(robot: Ground) -> None:
    right: Command = ("/io_teleop/target_gripper_status", ["whatever"], [1.0, 0.0])
    left: Command = ("/io_teleop/target_gripper_status", [], [0.0, 0.5])
    upper = {joint["joint"]: joint["upper"] for joint in JOINTS}
    closed, opened = {name: upper[name] for name in RIGHT_HAND}, dict.fromkeys(RIGHT_HAND, 0.0)
    half = {name: upper[name] / 2 for name in LEFT_HAND}
    found = robot.client(drive, [right, left], [closed, {**opened, **half}]).value()
    for name in RIGHT_HAND:
        assert found[name] == pytest.approx([0.0, upper[name], 0.0], abs=0.03)
    for name in LEFT_HAND:
        assert found[name] == pytest.approx([0.0, 0.0, upper[name] / 2], abs=0.03)
    assert {name[:3] for name in moved(found)} == {"rh_", "lh_"}


def reset_in_mid_motion(count: int) -> dict[str, Any]:
    """Send the arm far away, and home again during the motion, while commands keep coming.

    Returns:
        For each motion to home: the answer, and the joint states between the request and the answer.
    """
    import threading
    import time

    import rospy
    from sensor_msgs.msg import JointState
    from std_srvs.srv import Trigger

    rospy.init_node("resetter", anonymous=True)
    commands = rospy.Publisher("/io_teleop/joint_cmd", JointState, queue_size=10)
    states: list[Any] = []
    rospy.Subscriber("/io_teleop/joint_states", JointState, states.append, tcp_nodelay=True)
    reset = rospy.ServiceProxy("/io_teleop_reset_robot", Trigger)
    reset.wait_for_service(TIMEOUT)
    wait_until(lambda: states and commands.get_num_connections(), "connections")
    place = states[-1].name.index("J_arm_r_01")
    away = JointState(name=["J_arm_r_01"], position=[2.5])
    is_over = threading.Event()

    def insist() -> None:
        while not is_over.wait(0.01):  # like a program that commands a hundred times a second
            commands.publish(away)

    pressing = threading.Thread(target=insist)
    found = []
    for _ in range(count):
        commands.publish(away)
        wait_until(lambda: states[-1].velocity[place] >= 1.0, "motion")
        if not pressing.ident:
            pressing.start()
        before = len(states)
        answer = reset()
        answered = time.time()
        wait_until(lambda: states[-1].header.stamp.to_sec() > answered, "joint state after the answer")  # noqa: B023
        meanwhile = [each for each in states[before:] if each.header.stamp.to_sec() < answered + 0.005]
        found.append(
            {
                "success": answer.success,
                "message": answer.message,
                "at": [each.position[place] for each in meanwhile],
                "numbers": [each.header.seq for each in meanwhile],
            }
        )
    is_over.set()
    pressing.join()
    return {"resets": found}


def test_reset_during_motion_ignores_commands_and_reaches_home(robot: Ground) -> None:
    for reset in robot.client(reset_in_mid_motion, 2).value()["resets"]:
        assert (reset["success"], reset["message"]) == (True, "Service successfully triggered!")
        assert min(abs(at - 0.20) for at in reset["at"]) < 0.05, "it was at home when it said so"
        begin = reset["numbers"][0]
        assert reset["numbers"] == list(range(begin, begin + len(reset["numbers"]))), "joint states went on meanwhile"
        assert len(reset["numbers"]) >= 5


def sweep(joint: str, to: float) -> float:
    """Let one joint follow targets, a new one with each joint state; return its final position."""
    import rospy
    from sensor_msgs.msg import JointState

    rospy.init_node("sweeper", anonymous=True)
    commands = rospy.Publisher("/io_teleop/joint_cmd", JointState, queue_size=1, tcp_nodelay=True)
    states: list[Any] = []
    rospy.Subscriber("/io_teleop/joint_states", JointState, states.append)
    wait_until(lambda: states and commands.get_num_connections(), "connections")

    def at() -> float:
        return float(states[-1].position[states[-1].name.index(joint)])

    begin = at()
    for step in range(1, 101):
        before = len(states)
        commands.publish(JointState(name=[joint], position=[begin + (to - begin) * step / 100]))
        wait_until(lambda: len(states) > before, "joint state")  # noqa: B023
    wait_until(lambda: abs(at() - to) < 0.005, "arrival", seen=at)
    return at()


def test_two_programs_drive_their_joints_at_once(robot: Ground) -> None:
    right, left = robot.client(sweep, "J_arm_r_02", -0.2), robot.client(sweep, "J_arm_l_02", -0.4)
    assert right.value() == pytest.approx(-0.2, abs=0.01)
    assert left.value() == pytest.approx(-0.4, abs=0.01)


def raise_hand(height: float) -> list[list[float]]:
    """From home, raise the right hand by a height [m], and send nonsense; return both hands before and after."""
    import copy

    import rospy
    from geometry_msgs.msg import PoseArray
    from std_srvs.srv import Trigger

    rospy.init_node("hands", anonymous=True)
    rospy.ServiceProxy("/io_teleop_reset_robot", Trigger)()
    command = rospy.Publisher("/io_teleop/target_ee_poses", PoseArray, queue_size=10)
    states: list[Any] = []
    rospy.Subscriber("/io_teleop/state_ee_poses", PoseArray, states.append)
    wait_until(lambda: states and command.get_num_connections(), "connections")
    begin = states[-1]
    target = copy.deepcopy(begin)
    target.poses[0].position.z += height
    command.publish(target)
    command.publish(PoseArray())

    def risen() -> float:
        return float(states[-1].poses[0].position.z - begin.poses[0].position.z)

    wait_until(lambda: abs(risen() - height) < 5e-4, "hand at its height", seen=risen)
    end = states[-1]
    return [[pose.position.z for pose in poses.poses] for poses in (begin, end)]


def test_hand_pose_moves_hand_to_it(robot: Ground) -> None:
    begin, end = robot.client(raise_hand, 0.1).value()
    assert end[0] - begin[0] == pytest.approx(0.1, abs=1e-3)
    assert end[1] - begin[1] == pytest.approx(0.0, abs=1e-3)
