"""The seed's acceptance: a robot's node beside a real roscore, driven by unmodified programs of ROS 1."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeAlias

import pytest

from cellwright.messages import md5
from tests.ros1.ground import Ground, ground
from tests.ros1.handshake import publisher_header, service_header

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


def test_rostopic_lists_what_the_seed_asks_for(robot: Ground) -> None:
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


def test_types_and_checksums_are_those_of_ros(robot: Ground) -> None:
    types = dict(robot.ask("getTopicTypes"))
    joints = ["/io_teleop/joint_states", "/io_teleop/joint_cmd", "/io_teleop/target_joint_from_vr"]
    assert {types[name] for name in [*joints, "/io_teleop/target_gripper_status"]} == {"sensor_msgs/JointState"}
    assert publisher_header(robot, "/io_teleop/joint_states", NODE)["md5sum"] == md5("sensor_msgs/JointState")
    found = service_header(robot, HOME)
    assert (found["type"], found["md5sum"]) == ("std_srvs/Trigger", md5("std_srvs/Trigger"))


def test_rviz_finds_the_robot(robot: Ground) -> None:
    text = robot.ask("getParam", "/robot_description")
    assert text == robot.ask("getParam", f"{NODE}/robot_description")
    assert '<robot name="QingLong">' in text


def listen(seconds: float) -> dict[str, Any]:
    """What comes on the joint states in some seconds, and when [s] of wall time."""
    import time

    import rospy
    from sensor_msgs.msg import JointState

    rospy.init_node("listener", anonymous=True)
    came = []
    rospy.Subscriber(
        "/io_teleop/joint_states", JointState, lambda message: came.append((time.time(), message)), tcp_nodelay=True
    )
    while len(came) < 10:
        time.sleep(0.01)
    time.sleep(seconds)
    wall, stamps = [each for each, _ in came], [message.header.stamp.to_sec() for _, message in came]
    ages = [then - message.header.stamp.to_sec() for then, message in came]
    newest = came[-1][1]
    return {
        "rate": (len(came) - 1) / (stamps[-1] - stamps[0]),
        "came": (len(came) - 1) / (wall[-1] - wall[0]),
        "ages": [min(ages), max(ages)],
        "numbers": [message.header.seq for _, message in came],
        "names": newest.name,
        "lengths": [len(newest.position), len(newest.velocity), len(newest.effort)],
    }


def test_joint_states_come_a_hundred_times_a_second_with_the_wall_s_time(robot: Ground) -> None:
    found = robot.client(listen, 2.5).value()
    assert found["rate"] == pytest.approx(100.0, rel=0.01)
    assert found["came"] == pytest.approx(100.0, rel=0.01)
    assert found["numbers"] == list(range(found["numbers"][0], found["numbers"][0] + len(found["numbers"])))
    assert -0.005 < found["ages"][0] < 0.05
    assert found["ages"][1] < 0.5
    assert found["names"] == [joint["joint"] for joint in JOINTS if joint["type"] != "fixed"]
    assert found["lengths"] == [75, 75, 75]


def drive(commands: list[Command], seconds: list[float]) -> dict[str, list[float]]:
    """From home, send each command; where the joints were before, and after each and some seconds [s]."""
    import time

    import rospy
    from sensor_msgs.msg import JointState
    from std_srvs.srv import Trigger

    rospy.init_node("driver", anonymous=True)
    rospy.ServiceProxy("/io_teleop_reset_robot", Trigger)()
    publishers = {topic: rospy.Publisher(topic, JointState, queue_size=10) for topic, _, _ in commands}
    states: list[Any] = []
    rospy.Subscriber("/io_teleop/joint_states", JointState, states.append)
    while not states or any(each.get_num_connections() == 0 for each in publishers.values()):
        time.sleep(0.01)
    seen = [states[-1].position]
    for (topic, names, positions), pause in zip(commands, seconds):  # noqa: B905 - the Python of ROS may be an old one
        publishers[topic].publish(JointState(name=names, position=positions))
        time.sleep(pause)
        seen.append(states[-1].position)
    return {name: [positions[place] for positions in seen] for place, name in enumerate(states[-1].name)}


def moved(found: dict[str, list[float]]) -> set[str]:
    return {name for name, seen in found.items() if max(seen) - min(seen) > 0.01}


def test_commands_may_name_any_joints_in_any_order(robot: Ground) -> None:
    commands: list[Command] = [
        ("/io_teleop/joint_cmd", ["J_arm_l_04", "J_arm_r_04", "J_waist_yaw"], [1.2, 2.0, 0.2]),
        ("/io_teleop/target_joint_from_vr", ["J_head_yaw", "no_such_joint", "J_head_pitch"], [0.4, 1.0, -0.3]),
    ]
    found = robot.client(drive, commands, [0.0, 1.0]).value()
    ends = {name: (seen[0], seen[-1]) for name, seen in found.items()}
    assert ends["J_arm_l_04"] == pytest.approx((1.7, 1.2), abs=0.01)
    assert ends["J_arm_r_04"] == pytest.approx((1.7, 2.0), abs=0.01)
    assert ends["J_waist_yaw"] == pytest.approx((0.0, 0.2), abs=0.01)
    assert ends["J_head_yaw"] == pytest.approx((0.0, 0.4), abs=0.01)
    assert ends["J_head_pitch"] == pytest.approx((0.0, -0.3), abs=0.01), "what stands behind an unknown name counts"
    assert moved(found) == {"J_arm_l_04", "J_arm_r_04", "J_waist_yaw", "J_head_yaw", "J_head_pitch"}


def test_grippers_close_in_the_order_right_left(robot: Ground) -> None:
    right: Command = ("/io_teleop/target_gripper_status", ["whatever"], [1.0, 0.0])
    left: Command = ("/io_teleop/target_gripper_status", [], [0.0, 0.5])
    found = robot.client(drive, [right, left], [1.5, 1.5]).value()
    upper = {joint["joint"]: joint["upper"] for joint in JOINTS}
    for name in RIGHT_HAND:
        assert found[name] == pytest.approx([0.0, upper[name], 0.0], abs=0.03)
    for name in LEFT_HAND:
        assert found[name] == pytest.approx([0.0, 0.0, upper[name] / 2], abs=0.03)
    assert {name[:3] for name in moved(found)} == {"rh_", "lh_"}


def reset_in_mid_motion(count: int) -> dict[str, Any]:
    """Send the arm far away, and home again on its way, while commands keep coming."""
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
    reset.wait_for_service(10.0)
    while not states or commands.get_num_connections() == 0:
        time.sleep(0.01)
    place = states[-1].name.index("J_arm_r_01")
    away = JointState(name=["J_arm_r_01"], position=[2.5])
    is_over = threading.Event()

    def insist() -> None:
        while not is_over.wait(0.01):
            commands.publish(away)

    pressing = threading.Thread(target=insist)
    found = []
    for _ in range(count):
        commands.publish(away)
        before = len(states)
        while states[-1].velocity[place] < 1.0:
            time.sleep(0.005)
        if not pressing.ident:
            pressing.start()
        begin = time.monotonic()
        answer = reset()
        found.append(
            {
                "success": answer.success,
                "message": answer.message,
                "took": time.monotonic() - begin,
                "at": states[-1].position[place],
                "states": len(states) - before,
            }
        )
    is_over.set()
    pressing.join()
    return {"resets": found}


def test_reset_in_mid_motion_with_commands_meanwhile(robot: Ground) -> None:
    for reset in robot.client(reset_in_mid_motion, 2).value()["resets"]:
        assert (reset["success"], reset["message"]) == (True, "Service successfully triggered!")
        assert 0.05 < reset["took"] < 5.0
        assert reset["at"] == pytest.approx(0.20, abs=0.05), "it was at home when it said so"
        assert reset["states"] >= 100 * reset["took"] * 0.9, "joint states went on meanwhile"


def sweep(joint: str, to: float) -> float:
    """Have one joint follow targets at 100 Hz; where it is in the end."""
    import time

    import rospy
    from sensor_msgs.msg import JointState

    rospy.init_node("sweeper", anonymous=True)
    commands = rospy.Publisher("/io_teleop/joint_cmd", JointState, queue_size=1, tcp_nodelay=True)
    states: list[Any] = []
    rospy.Subscriber("/io_teleop/joint_states", JointState, states.append)
    while not states or commands.get_num_connections() == 0:
        time.sleep(0.01)
    begin, rate = states[-1].position[states[-1].name.index(joint)], rospy.Rate(100)
    for step in range(1, 101):
        commands.publish(JointState(name=[joint], position=[begin + (to - begin) * step / 100]))
        rate.sleep()
    time.sleep(0.5)
    return float(states[-1].position[states[-1].name.index(joint)])


def test_two_programs_at_once_drive_what_each_names(robot: Ground) -> None:
    right, left = robot.client(sweep, "J_arm_r_02", -0.2), robot.client(sweep, "J_arm_l_02", -0.4)
    assert right.value() == pytest.approx(-0.2, abs=0.01)
    assert left.value() == pytest.approx(-0.4, abs=0.01)


def raise_hand(height: float) -> list[list[float]]:
    """From home, bring the right hand up by a height [m], and send nonsense; where both hands were, and are."""
    import copy
    import time

    import rospy
    from geometry_msgs.msg import PoseArray
    from std_srvs.srv import Trigger

    rospy.init_node("hands", anonymous=True)
    rospy.ServiceProxy("/io_teleop_reset_robot", Trigger)()
    command = rospy.Publisher("/io_teleop/target_ee_poses", PoseArray, queue_size=10)
    states: list[Any] = []
    rospy.Subscriber("/io_teleop/state_ee_poses", PoseArray, states.append)
    while not states or command.get_num_connections() == 0:
        time.sleep(0.01)
    begin = states[-1]
    target = copy.deepcopy(begin)
    target.poses[0].position.z += height
    command.publish(target)
    command.publish(PoseArray())
    time.sleep(1.0)
    end = states[-1]
    return [[pose.position.z for pose in poses.poses] for poses in (begin, end)]


def test_a_hand_goes_where_its_pose_says(robot: Ground) -> None:
    begin, end = robot.client(raise_hand, 0.1).value()
    assert end[0] - begin[0] == pytest.approx(0.1, abs=1e-3)
    assert end[1] - begin[1] == pytest.approx(0.0, abs=1e-3)
