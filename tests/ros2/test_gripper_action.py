"""Actions of a parallel gripper with clients of ROS 2: they grip and open, replace each other, are refused."""

from pathlib import Path
from typing import Any

import pytest

from cellwright.middleware.ros2.host.installation import PYTHON_VARIABLE
from tests.ros2.ground import Ground
from tests.ros2.requirement import installation_of

pytest_plugins = ["tests.ros2.fixtures"]
pytestmark = pytest.mark.ros2

CELL = Path(__file__).parents[1] / "data" / "fingers.yaml"
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""Codes of action_msgs/GoalStatus."""


def program(names: list[str]) -> dict[str, Any]:
    """Work with both actions; return what became of the goals."""
    from control_msgs.action import GripperCommand, ParallelGripperCommand
    from control_msgs.msg import GripperCommand as Command
    from rclpy_node import Node

    fingers = ["left_finger_joint", "right_finger_joint"]

    def width_goal(width: float, effort: float = 0.0) -> Any:
        return GripperCommand.Goal(command=Command(position=width, max_effort=effort))

    def joint_goal(position: float, names: list[str] = fingers[:1], **limits: float) -> Any:
        made = ParallelGripperCommand.Goal()
        made.command.name, made.command.position = names, [position] * len(names)
        for field, value in limits.items():
            setattr(made.command, field, [value])
        return made

    with Node() as me:
        states = me.listen("/ariac/gripper/state", "osrf_gear/VacuumGripperState")
        plain = me.action_client(names[0], "control_msgs/GripperCommand")
        joints = me.action_client(names[1], "control_msgs/ParallelGripperCommand")
        feedback: list[Any] = []

        def done(client: Any, goal: Any) -> Any:
            sent = me.act(client.send_goal_async, goal, feedback_callback=feedback.append)
            return me.act(sent.get_result_async)

        def of_joints(ended: Any) -> list[Any]:
            state = ended.result.state
            return [
                ended.status,
                list(state.name),
                list(state.position),
                ended.result.stalled,
                ended.result.reached_goal,
            ]

        gripped = done(plain, width_goal(0.0, 12.0))
        me.wait(lambda: states[-1].attached, "a part")
        opened = done(joints, joint_goal(0.05, fingers))
        me.wait(lambda: not states[-1].attached, "no part")
        by_joints = done(joints, joint_goal(0.0, effort=5.0, velocity=0.02))
        first = me.act(plain.send_goal_async, width_goal(0.1))
        replacing = me.act(joints.send_goal_async, joint_goal(0.045))
        replaced = me.act(first.get_result_async)
        me.act(replacing.cancel_goal_async)
        cancelled = me.act(replacing.get_result_async)
        bad = [(plain, width_goal(0.2)), (plain, width_goal(float("nan"))), (plain, width_goal(0.05, -1.0))]
        bad += [(joints, joint_goal(0.02, ["elbow"])), (joints, joint_goal(0.02, [])), (joints, joint_goal(0.5))]
        return {
            "gripped": [gripped.status, gripped.result.position, gripped.result.stalled, gripped.result.reached_goal],
            "opened": of_joints(opened),
            "by_joints": of_joints(by_joints),
            "feedback": [list(each.feedback.state.position) for each in feedback if hasattr(each.feedback, "state")],
            "replaced": replaced.status,
            "cancelled": cancelled.status,
            "accepted": [me.act(client.send_goal_async, goal).accepted for client, goal in bad],
        }


@pytest.mark.parametrize(
    ("names", "actions"),
    [
        ("both", ["/ariac/gripper/gripper_cmd", "/ariac/gripper/parallel_gripper_cmd"]),
        ("ros2_control", ["/gripper_controller/gripper_cmd", "/parallel_gripper_controller/gripper_cmd"]),
    ],
)
def test_program_grips_with_the_standard_actions(domain: Ground, names: str, actions: list[str]) -> None:
    cell = domain.serve(str(CELL), "-d", "--ros2-names", names)
    check(domain.client(program, actions).value())
    cell.wait_for("joints must be left_finger_joint or right_finger_joint, each once .got elbow")


@pytest.mark.slow
@pytest.mark.parametrize(("of_cell", "of_client"), [("kilted", "kilted"), ("jazzy", "kilted"), ("kilted", "jazzy")])
def test_client_of_distribution_grips_in_cell_of_distribution(domain: Ground, of_cell: str, of_client: str) -> None:
    bridge, client = installation_of(of_cell), installation_of(of_client)
    domain.serve(str(CELL), "-d", **{PYTHON_VARIABLE: bridge.python})
    names = ["/ariac/gripper/gripper_cmd", "/ariac/gripper/parallel_gripper_cmd"]
    check(domain.client(program, names, under=client).value())


def check(found: dict[str, Any]) -> None:
    """Check what became of the goals of `program`."""
    status, width, *flags = found["gripped"]
    assert (status, flags) == (SUCCEEDED, [True, False])
    assert width == pytest.approx(0.04, abs=0.001)
    status, joints, positions, *flags = found["opened"]
    assert (status, joints, flags) == (SUCCEEDED, ["left_finger_joint", "right_finger_joint"], [False, True])
    assert positions == pytest.approx([0.05, 0.05], abs=0.001)
    status, _, positions, *flags = found["by_joints"]
    assert (status, flags) == (SUCCEEDED, [True, False])
    assert positions == pytest.approx([0.02, 0.02], abs=0.001)
    assert found["feedback"]
    assert (found["replaced"], found["cancelled"]) == (ABORTED, CANCELED)
    assert found["accepted"] == [False] * 6
