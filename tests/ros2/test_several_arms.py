"""Cell with two arms over ROS 2: each has a controller, an action, frames and joint states of its own."""

from pathlib import Path
from typing import Any

import pytest

from tests.ros2.ground import Ground

pytest_plugins = ["tests.ros2.fixtures"]
pytestmark = pytest.mark.ros2

CELL = Path(__file__).parents[1] / "data" / "two_arms.yaml"
SUCCEEDED = 4
"""Code of action_msgs/GoalStatus."""


def program() -> dict[str, Any]:
    from control_msgs.action import FollowJointTrajectory
    from rclpy_node import Node
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    def goal(rail: float) -> Any:
        joints = ["linear_arm_actuator_joint", "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"]
        joints += ["wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]
        point = JointTrajectoryPoint(positions=[rail, 3.14, -1.13, 1.51, 3.77, -1.51, 0.0])
        point.time_from_start.sec = 1
        return FollowJointTrajectory.Goal(trajectory=JointTrajectory(joint_names=joints, points=[point]))

    with Node() as me:
        states = me.listen("/joint_states", "sensor_msgs/JointState")
        own = me.listen("/ariac/arm2/joint_states", "sensor_msgs/JointState")
        tf = me.listen("/tf", "tf2_msgs/TFMessage")
        kind = "control_msgs/FollowJointTrajectory"
        arms = {arm: me.action_client(f"/{arm}_controller/follow_joint_trajectory", kind) for arm in ("arm1", "arm2")}
        sent = {arm: me.act(arms[arm].send_goal_async, goal(rail)) for arm, rail in (("arm1", -1.0), ("arm2", 1.0))}
        done = {arm: me.act(each.get_result_async).status for arm, each in sent.items()}
        me.wait(lambda: states and own and tf, "joint states and frames")
        listed = me.call("/controller_manager/list_controllers", "controller_manager_msgs/ListControllers")
        places = dict(zip(states[-1].name, states[-1].position, strict=True))
        return {
            "done": done,
            "rails": [places[f"{arm}_linear_arm_actuator_joint"] for arm in arms],
            "own": list(own[-1].name)[:2],
            "frames": [each.child_frame_id for message in tf for each in message.transforms],
            "controllers": [each.name for each in listed.controller],
        }


def test_program_moves_two_arms_by_their_controllers(domain: Ground) -> None:
    domain.serve(str(CELL), "-d")
    found = domain.client(program).value()
    assert found["done"] == {"arm1": SUCCEEDED, "arm2": SUCCEEDED}
    assert found["rails"] == pytest.approx([-1.0, 1.0], abs=0.02)
    assert found["own"] == ["elbow_joint", "linear_arm_actuator_joint"]
    assert {"arm1_forearm_link", "arm2_forearm_link"} <= {*found["frames"]}
    assert found["controllers"] == ["arm1_controller", "arm2_controller", "joint_state_broadcaster"]
