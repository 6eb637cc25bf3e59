"""Robot's controller node in ROS 2: commands of best-effort publishers, states, reset."""

from typing import Any

import pytest

from tests.ros2.ground import Ground

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
