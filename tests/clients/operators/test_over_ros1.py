"""Operators over ROS 1: at the node of a robot of ours, and at another vendor's that knows only joints."""

from __future__ import annotations

import json
from typing import Any

import pytest

from cellwright.cli.operate.connection import AddressArguments, NodeConnection
from cellwright.clients.client.ros1_transport import Ros1Transport
from cellwright.clients.client.session import NodeClient
from cellwright.clients.operators.keyboard import Jog, Keyboard
from cellwright.clients.operators.robot import JOINT_STATES, JointLimits, OperatedRobot, ServiceCaller
from cellwright.config.robot.robots import load_robot
from tests.ros1.ground import Ground
from tests.ros1.requirement import ros_python
from tests.support.waiting import TIMEOUT

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1


def minimal_node() -> None:
    """Run the simplest node: joints creep to their targets; no clock, no status, nothing else."""
    import rospy
    from sensor_msgs.msg import JointState

    rospy.init_node("minimal_node")
    position, target = [0.1, 0.2], [0.1, 0.2]
    names = ["head", "elbow"]

    def take(message: Any) -> None:
        for name, value in zip(message.name, message.position):  # noqa: B905
            target[names.index(name)] = value

    rospy.Subscriber("/io_teleop/joint_cmd", JointState, take, queue_size=1)
    publisher = rospy.Publisher("/io_teleop/joint_states", JointState, queue_size=1)
    rate = rospy.Rate(100)
    while not rospy.is_shutdown():
        for number in range(2):
            position[number] += 0.25 * (target[number] - position[number])
        message = JointState(name=names, position=position)
        message.header.stamp = rospy.Time.now()
        publisher.publish(message)
        try:
            rate.sleep()  # stands for no condition: it is such a node's pace
        except rospy.ROSInterruptException:
            return


def signal(master: Ground, *arguments: str) -> dict[str, Any]:
    """Return the result of a test signal."""
    quick = ("--frequency", "1", "--duration", "1", "--amplitude", "0.2", "--json", "--ros1")
    process = master.cellwright("operate", "signal", *arguments, *quick)
    assert process.finish() == 0, process.err
    found: dict[str, Any] = json.loads(process.out)
    return found


def test_signal_over_ros1_moves_joint_of_minimal_node(master: Ground) -> None:
    process = master.client(minimal_node)
    (elbow,) = signal(master, "elbow")["joints"]
    assert elbow["start"] == pytest.approx(0.2, abs=1e-6)
    assert elbow["delay"] > 0.01  # a quarter of the way every 10 ms, and the way through ROS
    assert elbow["state_rate"] > 0.0
    assert process.running
    process.interrupt()


def test_keyboard_over_ros1_drives_robot_and_stops_it_on_way_home(
    master: Ground, monkeypatch: pytest.MonkeyPatch
) -> None:
    master.teleop("tandem")

    def session(node: str) -> NodeClient:
        python, environment = str(ros_python()), master.environment
        return NodeClient(Ros1Transport(python, node=node, environment=environment, sign=JOINT_STATES))

    robot = OperatedRobot(session("/operator"))
    operator = Keyboard(robot, Jog(robot, JointLimits()), ServiceCaller(lambda: session("/operator_services")))
    assert len(robot.tips) == len(robot.grippers) == 2
    for name, value in master.ros.items():
        monkeypatch.setenv(name, value)
    limits = NodeConnection(AddressArguments(ros1=True)).limits(robot)
    assert limits.source == "robot_description"
    assert limits.joints == JointLimits.of(load_robot("tandem", print).robot).joints
    start, wait = robot.tips[0].position, robot.session.wait_until
    assert operator.take("++zc")
    assert wait(lambda: robot.tips[0].position[2] - start[2] > 0.015 and robot.grippers[0] > 0.9, TIMEOUT)
    assert operator.take("/" + robot.joints[0] + "\r" + "\x1b[C\x1b[C")
    assert operator.take("H")
    assert wait(lambda: robot.status.resetting, TIMEOUT)
    assert operator.take(" ")
    assert wait(lambda: robot.status.emergency_stop, TIMEOUT)
    assert wait(lambda: operator.take("") and operator.message.startswith("home: "), TIMEOUT)
    assert "refused" in operator.message
    operator.services.close()
    robot.session.close()
