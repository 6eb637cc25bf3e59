"""The arm's action `follow_joint_trajectory`: the actionlib protocol on five topics.

A goal that the arm cannot follow is rejected immediately, with the reason in its result. An accepted goal gives
feedback ten times a second. It ends succeeded, aborted (outside its tolerances) or preempted (cancelled or replaced).
"""

from typing import Any

from cellwright.cell.devices.arm import Arm
from cellwright.cell.devices.trajectory_controller import RejectedTrajectoryError
from cellwright.cell.devices.trajectory_goal import GoalRequest, GoalResult, TrajectoryGoal
from cellwright.cell.interface.commands import trajectory_of
from cellwright.cell.interface.rows import FOLLOW
from cellwright.engine.clock import NANOSECONDS, seconds
from cellwright.engine.simulation import Device, State
from cellwright.middleware.interface.binding import Output
from cellwright.middleware.interface.table import Endpoint
from cellwright.middleware.messages import control_msgs
from cellwright.middleware.messages.conversions import header, nanoseconds, stamp, trajectory_point
from cellwright.middleware.messages.standard import GoalID, GoalStatus, GoalStatusArray

ACTIVE, REJECTED = 1, 5
"""Status codes of actionlib_msgs/GoalStatus."""

REMEMBERED = 5 * NANOSECONDS
"""Time [ns] for which the status of an ended goal is still published (the default of actionlib's server)."""

MAX_REMEMBERED = 50
"""Largest number of ended goals in a status message, so that a flood of bad goals does not swell every message."""

MAX_ID_LENGTH = 255
"""Largest length [characters] of a goal's identifier, which is stored and part of every status."""

_MAX_TEXT_LENGTH = 500


class TrajectoryAction(Device):
    """Action server of one arm.

    Like the original, it remembers its goals. They are part of the state, because the effect of a cancellation depends
    on them.
    """

    def __init__(self, arm: Arm) -> None:
        super().__init__(FOLLOW)
        self._arm = arm
        self._statuses: dict[str, tuple[GoalStatus, int | None]] = {}
        arm.on_goal_ended.append(self._publish_ended)

    def reset(self) -> None:
        """Forget all goals."""
        self._statuses = {}

    def get_state(self) -> dict[str, Any]:
        """Return the remembered goals, with stamps in the time of the run."""
        offset = self.simulation.clock.offset
        return {
            "goals": [
                [name, nanoseconds(status.goal_id.stamp) - offset, status.status, status.text, ended]
                for name, (status, ended) in self._recent().items()
            ]
        }

    def set_state(self, state: State) -> None:
        """Restore the state that `get_state` returned."""
        offset = self.simulation.clock.offset
        self._statuses = {
            name: (GoalStatus(GoalID(stamp(stamp_ns + offset), name), code, text), ended)
            for name, stamp_ns, code, text, ended in state["goals"]
        }

    def take_goal(self, _row: Endpoint, message: control_msgs.FollowJointTrajectoryActionGoal, node: str) -> None:
        """Follow a goal, or reject it with a result."""
        now = self._message_time()
        if len(message.goal_id.id) > MAX_ID_LENGTH:
            raise RejectedTrajectoryError(
                GoalResult.INVALID_GOAL,
                f"goal id may have at most {MAX_ID_LENGTH} characters (got {len(message.goal_id.id)})",
            )
        # as in actionlib: an empty identifier or stamp is filled in, so that the goal can still be cancelled
        name = message.goal_id.id or self._generated_id(node)
        goal_id = GoalID(stamp(nanoseconds(message.goal_id.stamp) or now), name)
        current = self._arm.controller.goal
        if current is not None and current.active and current.goal_id == name:
            raise RejectedTrajectoryError(GoalResult.INVALID_GOAL, f"goal {name!r} is already active; send another id")
        try:
            goal = message.goal
            trajectory = trajectory_of(goal.trajectory, self.simulation.clock.offset)
            goal_time = nanoseconds(goal.goal_time_tolerance)
            self._arm.accept(GoalRequest(name, trajectory, goal.path_tolerance, goal.goal_tolerance, goal_time))
        except RejectedTrajectoryError as error:
            reason = str(error)[:_MAX_TEXT_LENGTH]  # it may contain names from outside
            self._note(GoalStatus(goal_id, REJECTED, reason), ended=True)
            self._publish_result(name, int(error.result), reason)
            raise  # counted and reported with the other refusals
        self._note(GoalStatus(goal_id, ACTIVE, ""), ended=False)

    def take_cancel(self, _row: Endpoint, message: GoalID, _node: str) -> None:
        """Cancel by identifier, by time (all goals up to it), or everything when both are empty."""
        goal = self._current()
        if goal is None:
            return
        until = nanoseconds(message.stamp)
        stamp_ns = nanoseconds(self._statuses[goal.goal_id][0].goal_id.stamp)
        everything = not message.id and until == 0
        if everything or message.id == goal.goal_id or (until and stamp_ns <= until):
            self._arm.cancel()

    def goal_status(self, output: Output) -> None:
        """Status of the goals."""
        self._status = output.sample(
            lambda: GoalStatusArray(header("", self._message_time()), [each for each, _ in self._recent().values()])
        )

    def goal_feedback(self, output: Output) -> None:
        """Feedback on the active goal, if there is one."""
        output.sample(self._progress)

    def goal_result(self, output: Output) -> None:
        """Result of each goal."""
        self._result = output.advertise()

    def _publish_ended(self, goal: TrajectoryGoal) -> None:
        if goal.goal_id not in self._statuses:
            return  # set directly on the arm, not through the topic
        goal_id = self._statuses[goal.goal_id][0].goal_id
        self._note(GoalStatus(goal_id, int(goal.status), goal.reason), ended=True)
        self._publish_result(goal.goal_id, 0 if goal.result is None else int(goal.result), goal.reason)

    def _publish_result(self, name: str, code: int, reason: str) -> None:
        now = self._message_time()
        status = self._statuses[name][0]
        self._result.publish(
            control_msgs.FollowJointTrajectoryActionResult(
                header("", now), status, control_msgs.FollowJointTrajectoryResult(code, reason)
            )
        )

    def _progress(self) -> control_msgs.FollowJointTrajectoryActionFeedback | None:
        goal = self._current()
        if goal is None:
            return None
        now = self._message_time()
        points = (trajectory_point(*each) for each in self._arm.following())
        content = control_msgs.FollowJointTrajectoryFeedback(
            header("", now), list(self._arm.controller.joint_names), *points
        )
        return control_msgs.FollowJointTrajectoryActionFeedback(
            header("", now), self._statuses[goal.goal_id][0], content
        )

    def _current(self) -> TrajectoryGoal | None:
        """Return the active goal if it came on the topic."""
        goal = self._arm.controller.goal
        return goal if goal is not None and goal.active and goal.goal_id in self._statuses else None

    def _note(self, status: GoalStatus, *, ended: bool) -> None:
        self._statuses.pop(status.goal_id.id, None)
        self._statuses = self._recent()
        self._statuses[status.goal_id.id] = (status, self.simulation.now if ended else None)
        self._status.publish()

    def _recent(self) -> dict[str, tuple[GoalStatus, int | None]]:
        """Return the active goal and those that ended recently."""
        now = self.simulation.now
        recent = {
            name: (status, ended)
            for name, (status, ended) in self._statuses.items()
            if ended is None or now - ended <= REMEMBERED
        }
        ended_ones = [name for name, (_, ended) in recent.items() if ended is not None]
        for name in ended_ones[:-MAX_REMEMBERED]:
            del recent[name]
        return recent

    def _message_time(self) -> int:
        return self.simulation.clock.message_time()

    def _generated_id(self, node: str) -> str:
        """Generate an identifier in actionlib's form: node, number, time."""
        number, time = 1, seconds(self._message_time())
        while (name := f"{node}-{number}-{time:.9f}") in self._statuses:
            number += 1
        return name
