"""Action of the arm: goals of ROS 2 succeed, are cancelled, also at once, replaced and rejected."""

from typing import Any

import pytest

from tests.ros2.ground import Ground

pytest_plugins = ["tests.ros2.fixtures"]
pytestmark = pytest.mark.ros2

SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""Codes of action_msgs/GoalStatus."""


def send_goals(name: str) -> dict[str, Any]:
    """Send goals to the arm's action; return what became of them."""
    from control_msgs.action import FollowJointTrajectory
    from rclpy_node import Node
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    joints = ["linear_arm_actuator_joint", "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"]
    joints += ["wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]

    def goal(rail: float, seconds: int, names: list[str] = joints) -> Any:
        made = FollowJointTrajectory.Goal()
        point = JointTrajectoryPoint(positions=[rail, 3.14, -1.13, 1.51, 3.77, -1.51, 0.0][: len(names)])
        point.time_from_start.sec = seconds
        made.trajectory = JointTrajectory(joint_names=names, points=[point])
        return made

    with Node() as me:
        client = me.action_client(name, "control_msgs/FollowJointTrajectory")
        feedback: list[Any] = []
        first = me.act(client.send_goal_async, goal(0.3, 1), feedback_callback=feedback.append)
        done = me.act(first.get_result_async)
        second = me.act(client.send_goal_async, goal(0.0, 30))
        cancelled = me.act(second.cancel_goal_async)  # at once: it may not be executed yet
        ended = me.act(second.get_result_async)
        third = me.act(client.send_goal_async, goal(0.0, 30))
        fourth = me.act(client.send_goal_async, goal(0.1, 1))
        replaced = me.act(third.get_result_async)
        unknown = me.act(client.send_goal_async, goal(0.0, 1, ["nonsense"]))
        multi = goal(0.0, 1)
        multi.multi_dof_trajectory.joint_names = ["base"]
        return {
            "done": [done.status, done.result.error_code],
            "feedback": list(feedback[-1].feedback.desired.positions),
            "cancelled": [len(cancelled.goals_canceling), ended.status],
            "replaced": [replaced.status, me.act(fourth.get_result_async).status],
            "accepted": [unknown.accepted, me.act(client.send_goal_async, multi).accepted],
        }


@pytest.mark.parametrize(
    ("names", "action"),
    [("both", "/ariac/arm/follow_joint_trajectory"), ("ros2_control", "/arm_controller/follow_joint_trajectory")],
)
def test_goals_succeed_are_cancelled_replaced_and_rejected(domain: Ground, names: str, action: str) -> None:
    cell = domain.serve("lesson", "-d", "--ros2-names", names)
    found = domain.client(send_goals, action).value()
    assert found["done"] == [SUCCEEDED, 0]
    assert found["feedback"][1] == pytest.approx(3.14, abs=0.05)
    assert found["cancelled"] == [1, CANCELED]
    assert found["replaced"] == [ABORTED, SUCCEEDED]
    assert found["accepted"] == [False, False]
    cell.wait_for("unknown joint 'nonsense'")
    cell.wait_for("multi_dof_trajectory is not supported here")


def cancel_at_once(count: int) -> dict[str, list[Any]]:
    """Send goals, and cancel each at once, in two ways in turn; return final states, and how far the rail went [m].

    Either when the goal is accepted, or without this, by a request to cancel all goals right behind it.
    """
    from action_msgs.srv import CancelGoal
    from control_msgs.action import FollowJointTrajectory
    from rclpy_node import Node
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    name = "/ariac/arm/follow_joint_trajectory"
    joints = ["linear_arm_actuator_joint", "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"]
    joints += ["wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]
    with Node() as me:
        heard = me.listen("/ariac/joint_states", "sensor_msgs/JointState")
        client = me.action_client(name, "control_msgs/FollowJointTrajectory")
        cancels = me.node.create_client(CancelGoal, f"{name}/_action/cancel_goal")
        assert cancels.wait_for_service(60.0)
        me.wait(lambda: heard, "joint states")

        def rail() -> float:
            return float(heard[-1].position[list(heard[-1].name).index(joints[0])])

        found: dict[str, list[Any]] = {"states": [], "moved": []}
        for number in range(count):
            before = rail()
            target = -0.5 if number % 4 < 2 else 0.5
            point = JointTrajectoryPoint(positions=[target, 3.14, -1.13, 1.51, 3.77, -1.51, 0.0])
            point.time_from_start.sec = 5
            goal = FollowJointTrajectory.Goal(trajectory=JointTrajectory(joint_names=joints, points=[point]))
            if number % 2:
                handle = me.act(client.send_goal_async, goal)
                me.act(handle.cancel_goal_async)
            else:
                sent = me.result(me.executor.create_task(lambda goal=goal: client.send_goal_async(goal)))
                cancelled = cancels.call_async(CancelGoal.Request())
                handle = me.result(sent)
                if not me.result(cancelled).goals_canceling:  # the client knows then that nothing was cancelled
                    found["missed"] = [*found.get("missed", []), number]
                    me.act(handle.cancel_goal_async)
            found["states"].append(me.act(handle.get_result_async).status)
            found["moved"].append(abs(rail() - before))
        return found


def test_goals_that_are_cancelled_at_once_do_not_move_arm(domain: Ground) -> None:
    domain.serve("lesson", "-d")
    found = domain.client(cancel_at_once, 20).value()
    assert found["states"] == [CANCELED] * 20
    assert max(found["moved"]) < 0.1  # of 0.5 m and more
