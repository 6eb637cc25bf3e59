"""Reasons on /rosout: what a robot or a cell refuses or ignores, under the names that its callers use."""

from __future__ import annotations

import re
from typing import Any

import pytest

from tests.ros2.ground import Ground

pytest_plugins = ["tests.ros2.fixtures"]
pytestmark = pytest.mark.ros2

IN_NAMESPACE = ("--ros-args", "-r", "__ns:=/left")


def err_at_cell() -> list[Any]:
    """Err on both names of a topic, a service and an action; return node and text of the warnings."""
    from control_msgs.action import FollowJointTrajectory
    from rclpy_node import Node
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    with Node() as me:
        heard = me.listen("/rosout", "rcl_interfaces/Log", 100)

        def warnings() -> list[Any]:
            return [[each.name, each.msg] for each in heard if each.level == 30]

        for name in ("/left/ariac/arm/command", "/left/arm_controller/joint_trajectory"):
            publisher = me.publisher(name, "trajectory_msgs/JointTrajectory")

            def is_said(name: str = name, publisher: Any = publisher) -> bool:
                publisher.publish(
                    JointTrajectory(joint_names=["no_joint"], points=[JointTrajectoryPoint(positions=[0.0])])
                )
                return any(name in text for _, text in warnings())

            me.wait(is_said, f"reason for {name}")
        client = me.action_client("/left/arm_controller/follow_joint_trajectory", "control_msgs/FollowJointTrajectory")
        goal = FollowJointTrajectory.Goal(trajectory=JointTrajectory(joint_names=["no_joint"]))
        assert not me.act(client.send_goal_async, goal).accepted
        me.wait(lambda: any("follow_joint" in text for _, text in warnings()), "reason of the rejected goal")
        return warnings()


@pytest.mark.slow
def test_reasons_of_cell_reach_rosout_under_callers_names(domain: Ground) -> None:
    domain.serve("lesson", *IN_NAMESPACE)
    warnings = domain.client(err_at_cell).value()
    assert {node for node, _ in warnings} == {"left.cellwright"}
    assert {re.match(r"refused (\S+): \S", text)[1] for _, text in warnings} == {  # type: ignore[index]
        "/left/ariac/arm/command",
        "/left/arm_controller/joint_trajectory",
        "/left/arm_controller/follow_joint_trajectory",
    }


def err_at_robot() -> list[str]:
    """Command a joint that the robot lacks; return the warnings."""
    from rclpy_node import Node
    from sensor_msgs.msg import JointState

    with Node() as me:
        heard = me.listen("/rosout", "rcl_interfaces/Log", 100)
        publisher = me.publisher("/left/io_teleop/joint_cmd", "sensor_msgs/JointState")

        sent: list[str] = []

        def warnings() -> list[str]:
            sent.append(f"no_joint_{len(sent)}")  # each is said once, maybe before this node hears /rosout
            publisher.publish(JointState(name=[sent[-1]], position=[0.0]))
            return [each.msg for each in heard if "no_joint" in each.msg]

        me.wait(warnings, "warning")
        return warnings()


def test_ignored_joint_of_robot_reaches_rosout_under_callers_name(domain: Ground) -> None:
    domain.teleop("tandem", *IN_NAMESPACE)
    warnings = domain.client(err_at_robot).value()
    assert {re.sub(r"joint_\d+", "joint", text) for text in warnings} == {
        "/left/io_teleop/joint_cmd: 'no_joint' is not a joint of this robot; ignored (logged once)"
    }
