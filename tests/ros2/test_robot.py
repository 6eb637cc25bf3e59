"""Robot's controller node in ROS 2: commands of best-effort publishers, bursts of them, states, reset."""

import os
import signal
from typing import Any

import pytest

from tests.ros2.ground import Ground, bridge_pid
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros2.fixtures"]
pytestmark = pytest.mark.ros2


def drive(joint: str, target: float) -> dict[str, Any]:
    """Drive a joint as adopters do, with best effort; return where it went, and the answer to a reset."""
    from rclpy_node import BEST_EFFORT, LATCHED, Node
    from sensor_msgs.msg import JointState

    with Node() as me:
        states = me.listen("/io_teleop/joint_states", "sensor_msgs/JointState", BEST_EFFORT)
        applied = me.listen("/io_teleop/applied_joint_cmd", "sensor_msgs/JointState")
        status = me.listen("/io_teleop/status", "cellwright_msgs/TeleopStatus", LATCHED)
        publisher = me.publisher("/io_teleop/joint_cmd", "sensor_msgs/JointState", BEST_EFFORT)

        def is_there() -> bool:
            publisher.publish(JointState(name=[joint], position=[target]))
            if not states:
                return False
            newest = states[-1]
            return bool(abs(newest.position[list(newest.name).index(joint)] - target) < 0.02)

        me.wait(is_there, "arrival")
        nodes = [name for name, space in me.node.get_node_names_and_namespaces()]
        reset = me.call("/io_teleop_reset_robot", "std_srvs/Trigger")
        return {
            "joints": len(states[-1].name),
            "stamped": states[-1].header.stamp.sec > 10**9,
            "applied": len(applied) > 0,
            "status": len(status) > 0,
            "nodes": nodes,
            "reset": [reset.success, reset.message],
        }


def test_robot_follows_best_effort_commands_and_goes_home(domain: Ground) -> None:
    robot = domain.teleop("qinglong")
    found = domain.client(drive, "J_arm_r_04", 1.2).value()
    assert found["joints"] == 75
    assert (found["stamped"], found["applied"], found["status"]) == (True, True, True)
    assert "sim_robot_controller_node" in found["nodes"]
    assert found["reset"][0]
    assert "refused" not in robot.said


JOINTS = [f"J_arm_{side}_0{number}" for side in "rl" for number in range(1, 8)]


def command_in_bursts(joints: list[str], bursts: int) -> list[int]:
    """Send bursts of messages with one joint each, from publishers of depth 1; return the numbers sent and taken."""
    import contextlib

    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from rclpy_node import LATCHED, Node
    from sensor_msgs.msg import JointState

    with Node() as me:
        status = me.listen("/io_teleop/status", "cellwright_msgs/TeleopStatus", LATCHED)
        publishers = [
            me.publisher("/io_teleop/joint_cmd", "sensor_msgs/JointState", QoSProfile(depth=1, reliability=each))
            for each in (ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT)
        ]
        me.wait(lambda: status, "status")
        for publisher in publishers:  # the first messages of a new publisher may be lost: these are only ignored
            before = status[-1].ignored

            def is_heard(publisher: Any = publisher, before: int = before) -> bool:
                publisher.publish(JointState(name=["nobody"], position=[0.0]))
                return bool(status[-1].ignored > before)

            me.wait(is_heard, "robot that hears")
        for burst in range(bursts):
            publisher = publishers[burst % len(publishers)]
            for joint in joints:
                publisher.publish(JointState(name=[joint], position=[0.001 * burst]))
        sent = bursts * len(joints)
        with contextlib.suppress(AssertionError):  # the test compares the numbers
            me.wait(lambda: status[-1].taken >= sent, "all messages")
        return [sent, status[-1].taken]


def test_partial_commands_in_bursts_are_all_taken(domain: Ground) -> None:
    robot = domain.teleop("qinglong")
    sent, taken = domain.client(command_in_bursts, JOINTS, 20).value()
    assert taken == sent == 280
    assert "lost" not in robot.said
    assert "dropped" not in robot.said


def flood(joint: str, count: int, folder: str) -> int:
    """Send messages while the bridge is stopped, as files in the folder tell; return their number."""
    import pathlib

    from rclpy_node import BEST_EFFORT, Node
    from sensor_msgs.msg import JointState

    heard, stopped, sent = (pathlib.Path(folder, name) for name in ("heard", "stopped", "sent"))
    with Node() as me:
        publisher = me.publisher("/io_teleop/joint_cmd", "sensor_msgs/JointState", BEST_EFFORT)
        applied = me.listen("/io_teleop/applied_joint_cmd", "sensor_msgs/JointState")

        def is_at(target: float) -> bool:
            publisher.publish(JointState(name=[joint], position=[target]))
            return bool(applied) and abs(applied[-1].position[applied[-1].name.index(joint)] - target) < 1e-6

        me.wait(lambda: is_at(0.1), "robot that hears")
        heard.touch()
        me.wait(stopped.exists, "bridge that is stopped")
        for _ in range(count):
            publisher.publish(JointState(name=[joint], position=[0.2]))
        sent.touch()
        me.wait(lambda: is_at(0.3), "bridge that goes on")
        return count


def test_commands_lost_before_stopped_bridge_are_counted(domain: Ground) -> None:
    robot = domain.teleop("qinglong")
    folder = domain.folder
    client = domain.client(flood, JOINTS[0], 3000, str(folder))
    wait_until((folder / "heard").exists, "client that is heard")
    bridge = bridge_pid(robot)
    os.kill(bridge, signal.SIGSTOP)
    try:
        (folder / "stopped").touch()
        wait_until((folder / "sent").exists, "flood")
    finally:
        os.kill(bridge, signal.SIGCONT)
    client.value()
    robot.wait_for(r"\d+ messages on /io_teleop/joint_cmd lost before the bridge read them")
