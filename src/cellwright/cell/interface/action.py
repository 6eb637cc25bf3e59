"""Actions of a cell: `follow_joint_trajectory` of each arm, and those of its gripper.

An accepted trajectory ends aborted if the arm leaves its tolerances.
"""

from collections.abc import Iterator
from typing import Any

from cellwright.cell.devices.arm import Arm
from cellwright.cell.devices.finger_gripper import FingerGripper
from cellwright.cell.interface.action_server import ActionServer
from cellwright.cell.interface.commands import trajectory_of, warn_of_wall_time
from cellwright.cell.interface.devices import CellDevices
from cellwright.cell.interface.gripper_action import GripperAction, ParallelGripperAction
from cellwright.cell.interface.rows import FOLLOW
from cellwright.mechanism.trajectory_controller import RejectedTrajectoryError
from cellwright.mechanism.trajectory_goal import GoalRequest, GoalResult, TrajectoryGoal
from cellwright.middleware.bus import Refusals
from cellwright.middleware.messages import Message
from cellwright.middleware.messages.control_msgs import (
    FollowJointTrajectoryActionFeedback,
    FollowJointTrajectoryActionResult,
    FollowJointTrajectoryFeedback,
    FollowJointTrajectoryGoal,
    FollowJointTrajectoryResult,
)
from cellwright.middleware.messages.conversions import nanoseconds, trajectory_point
from cellwright.middleware.messages.standard import GoalStatus, Header


def actions_of(cell: CellDevices) -> Iterator[ActionServer]:
    """Yield the action servers of a cell's arms, then those of their parallel grippers."""
    subjects = {arm.name: arm.namespace or None for arm in cell.trial.arms}
    for name, subject in subjects.items():
        yield TrajectoryAction(cell.arms[name], cell.bus.refusals, subject)
    for name, gripper in cell.grippers.items():
        if isinstance(gripper, FingerGripper):
            yield GripperAction(gripper, subjects[name])
            yield ParallelGripperAction(gripper, subjects[name])


class TrajectoryAction(ActionServer):
    """Action server of one arm; `subject` is that of its rows."""

    def __init__(self, arm: Arm, refusals: Refusals, subject: str | None = None) -> None:
        super().__init__(FOLLOW, subject)
        self._arm = arm
        self._refusals = refusals
        arm.on_goal_ended.append(self._take_end)

    def _accept(self, name: str, goal: FollowJointTrajectoryGoal, source: str) -> None:
        trajectory = trajectory_of(goal.trajectory, self.simulation.clock.offset)
        goal_time = nanoseconds(goal.goal_time_tolerance)
        self._arm.accept(GoalRequest(name, trajectory, goal.path_tolerance, goal.goal_tolerance, goal_time))
        warn_of_wall_time(self._refusals, source, trajectory)

    def _cancel(self) -> None:
        self._arm.cancel()

    def _active(self) -> str | None:
        goal = self._arm.controller.goal
        return goal.goal_id if goal is not None and goal.active else None

    def _take_end(self, goal: TrajectoryGoal) -> None:
        self._note_end(goal.goal_id, int(goal.status), goal.reason, goal.result)

    def _make_result(self, head: Header, status: GoalStatus, outcome: Any) -> Message:
        found = outcome.result if isinstance(outcome, RejectedTrajectoryError) else outcome
        code = int(found) if isinstance(found, GoalResult) else 0
        return FollowJointTrajectoryActionResult(head, status, FollowJointTrajectoryResult(code, status.text))

    def _make_feedback(self, head: Header, status: GoalStatus) -> Message:
        points = (trajectory_point(*each) for each in self._arm.following())
        content = FollowJointTrajectoryFeedback(head, list(self._arm.controller.joint_names), *points)
        return FollowJointTrajectoryActionFeedback(head, status, content)
