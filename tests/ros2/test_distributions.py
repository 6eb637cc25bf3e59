"""Clients of Jazzy and Kilted at a cell: messages, a latched order, a command, services and the arm's action."""

from typing import Any

import pytest

from cellwright.middleware.ros2.host.installation import PYTHON_VARIABLE
from tests.ros2.ground import Ground, bridge_pid
from tests.ros2.requirement import installation_of
from tests.support.processes import name_of

pytest_plugins = ["tests.ros2.fixtures"]
pytestmark = pytest.mark.ros2

SUCCEEDED, CANCELED = 4, 5
"""Codes of action_msgs/GoalStatus."""


def work() -> dict[str, Any]:
    """Start the competition, move the arm by a command and by goals, and switch the gripper; return what was seen."""
    from control_msgs.action import FollowJointTrajectory
    from rclpy_node import LATCHED, Node
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    joints = ["linear_arm_actuator_joint", "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"]
    joints += ["wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]

    def trajectory(rail: float, seconds: int) -> Any:
        point = JointTrajectoryPoint(positions=[rail, 3.14, -1.13, 1.51, 3.77, -1.51, 0.0])
        point.time_from_start.sec = seconds
        return JointTrajectory(joint_names=joints, points=[point])

    def goal(rail: float, seconds: int) -> Any:
        return FollowJointTrajectory.Goal(trajectory=trajectory(rail, seconds))

    with Node() as me:
        started = me.call("/ariac/start_competition", "std_srvs/Trigger")
        states = me.listen("/ariac/joint_states", "sensor_msgs/JointState")
        grips = me.listen("/ariac/gripper/state", "osrf_gear/VacuumGripperState")
        orders = me.listen("/ariac/orders", "osrf_gear/Order", LATCHED)
        me.wait(lambda: orders, "order")
        late = me.listen("/ariac/orders", "osrf_gear/Order", LATCHED)
        me.publisher("/ariac/arm/command", "trajectory_msgs/JointTrajectory").publish(trajectory(0.2, 1))

        def rail() -> float:
            return float(states[-1].position[list(states[-1].name).index(joints[0])]) if states else 0.0

        me.wait(lambda: abs(rail() - 0.2) < 0.01, "arm where the command leads it")
        me.wait(lambda: late, "order of the late subscriber")
        gripper = me.call("/ariac/gripper/control", "osrf_gear/VacuumGripperControl", enable=True)
        me.wait(lambda: grips and grips[-1].enabled, "gripper switched on")
        client = me.action_client("/ariac/arm/follow_joint_trajectory", "control_msgs/FollowJointTrajectory")
        feedback: list[Any] = []
        done = me.act(client.send_goal_async, goal(0.3, 1), feedback_callback=feedback.append)
        ended = me.act(done.get_result_async)
        arrived = rail()
        again = me.act(client.send_goal_async, goal(0.0, 30))
        cancelled = me.act(again.cancel_goal_async)
        return {
            "started": started.success,
            "order": [len(orders), len(late), late[0].order_id, len(late[0].kits[0].objects) > 0],
            "gripper": gripper.success,
            "goal": [ended.status, ended.result.error_code],
            "arrived": arrived,
            "feedback": feedback[-1].feedback.desired.positions[0] if feedback else None,
            "has_index": hasattr(FollowJointTrajectory.Feedback(), "index"),
            "cancelled": [len(cancelled.goals_canceling), me.act(again.get_result_async).status],
        }


@pytest.mark.slow
@pytest.mark.parametrize(("of_cell", "of_client"), [("kilted", "kilted"), ("jazzy", "kilted"), ("kilted", "jazzy")])
def test_client_of_distribution_works_cell_of_distribution(domain: Ground, of_cell: str, of_client: str) -> None:
    bridge, client = installation_of(of_cell), installation_of(of_client)
    cell = domain.serve("lesson", "-d", **{PYTHON_VARIABLE: bridge.python})
    assert name_of(bridge_pid(cell)).startswith(bridge.python)
    found = domain.client(work, under=client).value()
    assert found["started"]
    assert found["order"] == [1, 1, "order_0", True]
    assert found["gripper"]
    assert found["goal"] == [SUCCEEDED, 0]
    assert found["arrived"] == pytest.approx(0.3, abs=0.01)
    assert found["has_index"] == (of_client == "kilted")
    if of_cell == of_client:  # the feedback is the one message that has other fields in Kilted
        assert found["feedback"] == pytest.approx(0.3, abs=0.05)
    assert found["cancelled"] == [1, CANCELED]
