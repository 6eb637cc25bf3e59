"""Actions of a parallel gripper, as the gripper controllers of ros2_control have them where stalling is allowed.

A goal succeeds when the pads are at their distance, and when something between them keeps them from it. Both actions
and the topic `command` move the same fingers: each ends a goal of another.
"""

from dataclasses import replace
from typing import Any

from cellwright.cell.devices.finger_gripper import FingerGripper
from cellwright.cell.interface.action_server import ActionServer
from cellwright.cell.interface.rows import GRIP, PARALLEL_GRIP
from cellwright.mechanism.gripper_goal import (
    GripperGoal,
    GripperReport,
    GripperRequest,
    JointCommand,
    request_of_joints,
)
from cellwright.middleware.messages import Message
from cellwright.middleware.messages.control_msgs import (
    GripperCommandActionFeedback,
    GripperCommandActionResult,
    GripperCommandFeedback,
    GripperCommandResult,
    ParallelGripperCommandActionFeedback,
    ParallelGripperCommandActionResult,
    ParallelGripperCommandFeedback,
    ParallelGripperCommandResult,
)
from cellwright.middleware.messages.conversions import joint_state
from cellwright.middleware.messages.standard import GoalStatus, Header, JointState


class GripperAction(ActionServer):
    """Action `GripperCommand` of one gripper; `subject` is that of its rows."""

    def __init__(self, gripper: FingerGripper, subject: str | None = None, action: str = GRIP) -> None:
        super().__init__(action, subject)
        self._gripper = gripper
        gripper.goals.on_ended.append(self._take_end)

    def _accept(self, name: str, goal: Any, _source: str) -> None:
        self._gripper.goals.accept(GripperRequest(name, goal.command.position, goal.command.max_effort))

    def _cancel(self) -> None:
        self._gripper.goals.cancel()

    def _active(self) -> str | None:
        goal = self._gripper.goals.active
        return None if goal is None else goal.goal_id

    def _take_end(self, goal: GripperGoal) -> None:
        self._note_end(goal.goal_id, int(goal.status), goal.reason, goal.result)

    def _make_result(self, head: Header, status: GoalStatus, outcome: Any) -> Message:
        report = self._report(outcome)
        result = GripperCommandResult(report.position, report.effort, report.stalled, report.reached_goal)
        return GripperCommandActionResult(head, status, result)

    def _make_feedback(self, head: Header, status: GoalStatus) -> Message:
        report = self._gripper.goals.report()
        content = GripperCommandFeedback(report.position, report.effort, report.stalled, report.reached_goal)
        return GripperCommandActionFeedback(head, status, content)

    def _report(self, outcome: Any) -> GripperReport:
        """Return the gripper at the end of a goal; one that never ran was not reached."""
        if isinstance(outcome, GripperReport):
            return outcome
        return replace(self._gripper.goals.report(), stalled=False, reached_goal=False)


class ParallelGripperAction(GripperAction):
    """Action `ParallelGripperCommand` of one gripper, which commands joints of fingers."""

    def __init__(self, gripper: FingerGripper, subject: str | None = None) -> None:
        super().__init__(gripper, subject, PARALLEL_GRIP)

    def _accept(self, name: str, goal: Any, _source: str) -> None:
        state, (left, right) = goal.command, self._gripper.arm.finger_joints
        command = JointCommand(state.name, state.position, state.velocity, state.effort)
        self._gripper.goals.accept(request_of_joints(name, command, (left, right)))

    def _make_result(self, head: Header, status: GoalStatus, outcome: Any) -> Message:
        report = self._report(outcome)
        result = ParallelGripperCommandResult(self._state(), report.stalled, report.reached_goal)
        return ParallelGripperCommandActionResult(head, status, result)

    def _make_feedback(self, head: Header, status: GoalStatus) -> Message:
        return ParallelGripperCommandActionFeedback(head, status, ParallelGripperCommandFeedback(self._state()))

    def _state(self) -> JointState:
        """Return the present state of the finger joints, as in joint states."""
        gripper = self._gripper
        return joint_state(gripper.arm.finger_joints, *gripper.joints(), time=self._message_time())
