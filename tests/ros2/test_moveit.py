"""MoveIt's calls in a cell: state monitor, controller manager, and goals as it sends them."""

from functools import cache
from typing import Any

import pytest

from cellwright import load_trial
from cellwright.cell.export.description import cell_description
from cellwright.cell.export.moveit import planned_cell
from cellwright.cell.model.build import build_world
from cellwright.middleware.ros2.packages.contents import MOVEIT
from cellwright.middleware.ros2.packages.moveit import PlannedCell
from tests.ros2.ground import Ground

pytest_plugins = ["tests.ros2.fixtures"]
pytestmark = pytest.mark.ros2

SUCCEEDED = 4
"""Code of action_msgs/GoalStatus."""

GOAL_MARGIN, DURATION_SCALING = 0.5, 1.1
"""MoveIt stops a trajectory that lasts longer than its duration by this factor and this time [s]."""

RECENT = 1.0
"""MoveIt waits for a state that is at most this old [s], by its own clock."""


@cache
def lesson() -> PlannedCell:
    trial = load_trial("lesson")
    return planned_cell(trial, cell_description(trial, build_world(trial), MOVEIT))


def plan_and_execute(moves: list[list[float]], limits: list[list[float]]) -> dict[str, Any]:
    """Do what MoveIt does before and while it executes; return what it got.

    Args:
        moves: way of each joint in each trajectory [rad; m], in the controller's order.
        limits: maximum velocities and accelerations.
    """
    from control_msgs.action import FollowJointTrajectory
    from rclpy.parameter import Parameter
    from rclpy_node import LATCHED, MANY, Node
    from sensor_msgs.msg import JointState
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    MOVING = 0.05  # [rad/s; m/s]

    def profile(move: list[float]) -> tuple[float, list[list[list[float]]]]:
        """Return duration, and time, positions, velocities, accelerations of points 0.1 s apart, as fast as allowed."""
        share = [abs(way) for way in move]
        velocity = min(limit / way for limit, way in zip(limits[0], share, strict=True) if way)
        acceleration = min(limit / way for limit, way in zip(limits[1], share, strict=True) if way)
        velocity = min(velocity, acceleration**0.5)
        rise = velocity / acceleration
        duration = rise + 1.0 / velocity
        rows = []
        for number in range(int(duration / 0.1) + 2):
            now = min(0.1 * number, duration)
            if now < rise:
                s, v, a = acceleration * now**2 / 2, acceleration * now, acceleration
            elif now < duration - rise:
                s, v, a = velocity * (now - rise / 2), velocity, 0.0
            else:
                left = duration - now
                s, v, a = 1.0 - acceleration * left**2 / 2, acceleration * left, -acceleration
            rows.append([[now], *([each * way for way in move] for each in (s, v, a))])
        return duration, rows

    def seconds(stamp: Any) -> float:
        return float(stamp.sec + stamp.nanosec * 1e-9)

    with Node() as me:
        me.node.set_parameters([Parameter("use_sim_time", value=True)])
        description = me.listen("/robot_description", "std_msgs/String", LATCHED)
        clock = me.listen("/clock", "rosgraph_msgs/Clock", MANY)
        ages: list[float] = []
        states: list[Any] = []

        def take(state: Any) -> None:
            if now := me.node.get_clock().now().nanoseconds:  # 0 until it has heard /clock
                ages.append(abs(now * 1e-9 - seconds(state.header.stamp)))
                states.append(state)

        me.node.create_subscription(JointState, "/joint_states", take, 10)
        me.wait(lambda: description and len(states) > 20, "description and states")

        listed = me.call("/controller_manager/list_controllers", "controller_manager_msgs/ListControllers").controller
        (controller,) = [
            each for each in listed if each.type == "joint_trajectory_controller/JointTrajectoryController"
        ]
        joints = [each.split("/")[0] for each in controller.claimed_interfaces]
        required = [each.split("/")[0] for each in controller.required_command_interfaces]
        action = f"/{controller.name}/follow_joint_trajectory"
        client = me.action_client(action, "control_msgs/FollowJointTrajectory")
        results = []
        for move in moves:
            before = states[-1]
            present = [before.position[list(before.name).index(joint)] for joint in joints]
            duration, rows = profile(move)
            goal = FollowJointTrajectory.Goal(trajectory=JointTrajectory(joint_names=joints))
            for (now,), way, velocities, accelerations in rows:
                point = JointTrajectoryPoint(velocities=velocities, accelerations=accelerations)
                point.positions = [start + part for start, part in zip(present, way, strict=True)]
                point.time_from_start.sec, point.time_from_start.nanosec = divmod(int(now * 1e9), 10**9)
                goal.trajectory.points.append(point)
            first = len(states)
            handle = me.act(client.send_goal_async, goal)
            answer = me.act(handle.get_result_async) if handle.accepted else None
            me.wait(lambda: max(map(abs, states[-1].velocity)) < MOVING, "arm at rest")
            moving = [each.header.stamp for each in states[first:] if max(map(abs, each.velocity)) > MOVING]
            lasted = seconds(moving[-1]) - seconds(moving[0])
            after = [states[-1].position[list(states[-1].name).index(joint)] for joint in joints]
            end = goal.trajectory.points[-1].positions
            left = max(abs(one - other) for one, other in zip(after, end, strict=True))
            code = answer.result.error_code if answer else None
            results.append([handle.accepted, answer and answer.status, code, duration, lasted, left])
        return {
            "description": description[0].data[:60],
            "joints": joints,
            "required": required,
            "state": controller.state,
            "age": sorted(ages)[len(ages) // 2],
            "off": max(
                min(abs(seconds(state.header.stamp) - seconds(each.clock)) for each in clock) for state in states[5:20]
            ),
            "lengths": [len(states[0].name), len(states[0].position), len(states[0].velocity), len(states[0].effort)],
            "names": list(states[0].name),
            "results": results,
        }


MOVES = [
    [0.4, 1.2, -0.3, 0.5, -0.6, 0.4, 1.5],
    [-0.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.4, -1.2, 0.3, -0.5, 0.6, -0.4, -4.5],
]
"""Ways of the joints from the home posture that meet nothing."""


def test_goals_as_moveit_sends_them_succeed_at_full_speed_and_in_time(domain: Ground) -> None:
    domain.serve("lesson", "-d")
    cell = lesson()
    (arm,) = cell.arms
    limits = [[each[joint] for joint in arm.joints] for each in (arm.max_velocity, arm.max_acceleration)]
    found = domain.client(plan_and_execute, MOVES, limits).value()
    assert found["joints"] == found["required"] == list(arm.joints)
    assert found["state"] == "active"
    assert set(found["names"]) >= {*arm.joints, *cell.passive_joints}, "a state of all moving joints"
    assert len(set(found["lengths"])) == 1
    assert found["off"] < 0.1
    assert found["age"] < RECENT
    for accepted, status, code, duration, lasted, left in found["results"]:
        assert (accepted, status, code) == (True, SUCCEEDED, 0)
        assert 0.8 * duration < lasted < DURATION_SCALING * duration + GOAL_MARGIN
        assert left < 0.1, "the controller's tolerance"
    partial = domain.client(send_goal_of, cell.groups["arm"]).value()
    assert partial == [False, None], "the original allows none"


def send_goal_of(joints: list[str]) -> list[Any]:
    """Send a goal for these joints, to where they are; return whether it was accepted, and its status."""
    from control_msgs.action import FollowJointTrajectory
    from rclpy_node import Node
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    with Node() as me:
        states = me.listen("/joint_states", "sensor_msgs/JointState")
        client = me.action_client("/arm_controller/follow_joint_trajectory", "control_msgs/FollowJointTrajectory")
        me.wait(lambda: states, "states")
        present = [states[-1].position[list(states[-1].name).index(joint)] for joint in joints]
        goal = FollowJointTrajectory.Goal(trajectory=JointTrajectory(joint_names=joints))
        for seconds in (0, 1):
            point = JointTrajectoryPoint(positions=present, velocities=[0.0] * len(joints))
            point.time_from_start.sec = seconds
            goal.trajectory.points.append(point)
        handle = me.act(client.send_goal_async, goal)
        status = me.act(handle.get_result_async).status if handle.accepted else None
        return [handle.accepted, status]


def test_group_without_rail_executes_where_partial_goals_are_allowed(domain: Ground) -> None:
    domain.serve("lesson", "-d", "--set", "cellwright.arm.allow_partial_joints_goal=true")
    assert domain.client(send_goal_of, lesson().groups["arm"]).value() == [True, SUCCEEDED]
