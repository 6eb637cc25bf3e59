"""The arm's action `follow_joint_trajectory`: the actionlib protocol on five topics.

A goal that the arm cannot follow is rejected immediately, with the reason in its result. An accepted goal gives
feedback ten times a second. It ends succeeded, aborted (outside its tolerances) or preempted (cancelled or replaced).

Goals and cancellations come on two topics, whose order ROS 1 does not keep. So the server remembers, as actionlib's
does: a cancellation that arrives before its goal, the newest stamp up to which goals were cancelled, and the
identifiers of ended goals. A goal that was cancelled before it arrived is recalled: it never moves the arm.
"""

from typing import Any

from cellwright.cell.devices.arm import Arm
from cellwright.cell.interface.commands import trajectory_of, warn_of_wall_time
from cellwright.cell.interface.rows import FOLLOW
from cellwright.engine.clock import NANOSECONDS, seconds
from cellwright.engine.device import Device, State
from cellwright.mechanism.trajectory_controller import RejectedTrajectoryError
from cellwright.mechanism.trajectory_goal import GoalRequest, GoalResult, TrajectoryGoal
from cellwright.middleware.bus import Refusals
from cellwright.middleware.interface.binding import Output
from cellwright.middleware.interface.table import Endpoint
from cellwright.middleware.messages import control_msgs
from cellwright.middleware.messages.conversions import header, nanoseconds, trajectory_point, wrapped_stamp
from cellwright.middleware.messages.standard import GoalID, GoalStatus, GoalStatusArray
from cellwright.util.errors import RejectedCommandError

ACTIVE, REJECTED, RECALLING, RECALLED = 1, 5, 7, 8
"""Status codes of actionlib_msgs/GoalStatus; RECALLING is a cancellation whose goal has not arrived yet."""

REMEMBERED = 5 * NANOSECONDS
"""Time [ns] for which an ended goal, or a cancellation without its goal, is remembered (actionlib's default)."""

MAX_REMEMBERED = 1000
"""Largest number of ended goals that are remembered, and of cancellations without their goals: a bound of memory."""

MAX_PUBLISHED = 50
"""Largest number of them in a status message, so that a flood of bad goals does not swell every message."""

MAX_ID_LENGTH = 255
"""Largest length [characters] of a goal's identifier, which is stored and part of every status."""

_MAX_TEXT_LENGTH = 500


class TrajectoryAction(Device):
    """Action server of one arm; `subject` is that of its rows.

    Like the original, it remembers its goals. They are part of the state, because the effect of a cancellation depends
    on them.
    """

    def __init__(self, arm: Arm, refusals: Refusals, subject: str | None = None) -> None:
        super().__init__(FOLLOW if subject is None else f"{FOLLOW} {subject}")
        self.subject = subject
        self._arm = arm
        self._refusals = refusals
        self._statuses: dict[str, tuple[GoalStatus, int | None]] = {}
        """Status of each goal, and the time of its end [ns]; None while it is active."""
        self._last_cancel = 0
        """Newest stamp up to which goals were cancelled [ns]; 0 for none."""
        arm.on_goal_ended.append(self._publish_ended)

    def reset(self) -> None:
        """Forget all goals and cancellations."""
        self._statuses, self._last_cancel = {}, 0

    def get_state(self) -> dict[str, Any]:
        """Return the remembered goals, with stamps in the time of the run."""
        offset = self.simulation.clock.offset
        state: dict[str, Any] = {
            "goals": [
                [name, nanoseconds(status.goal_id.stamp) - offset, status.status, status.text, ended]
                for name, (status, ended) in self._recent().items()
            ]
        }
        # absent in recordings without such a cancellation, as in those of earlier versions
        if self._last_cancel:
            state["last cancel"] = self._last_cancel - offset
        return state

    def set_state(self, state: State) -> None:
        """Restore the state that `get_state` returned."""
        offset = self.simulation.clock.offset
        self._statuses = {
            name: (GoalStatus(GoalID(wrapped_stamp(stamp_ns + offset), name), code, text), ended)
            for name, stamp_ns, code, text, ended in state["goals"]
        }
        self._last_cancel = state["last cancel"] + offset if "last cancel" in state else 0

    def take_goal(self, row: Endpoint, message: control_msgs.FollowJointTrajectoryActionGoal, node: str) -> None:
        """Follow a goal, reject it with a result, or recall it if it was cancelled before.

        Raises:
            RejectedTrajectoryError: it is rejected, or its identifier is that of another goal.
        """
        _check_id(message.goal_id.id)
        # as in actionlib: an empty identifier or stamp is filled in, so that the goal can still be cancelled
        name = message.goal_id.id or self._generated_id(node)
        given = nanoseconds(message.goal_id.stamp)
        goal_id = GoalID(wrapped_stamp(given or self._message_time()), name)
        if (known := self._recent().get(name)) is not None:
            self._take_known(goal_id, *known)
            return
        if given and given <= self._last_cancel:
            self._end(
                GoalStatus(goal_id, RECALLED, "cancelled before it arrived: its stamp is not after that of a cancel")
            )
            return
        try:
            goal = message.goal
            trajectory = trajectory_of(goal.trajectory, self.simulation.clock.offset)
            goal_time = nanoseconds(goal.goal_time_tolerance)
            self._arm.accept(GoalRequest(name, trajectory, goal.path_tolerance, goal.goal_tolerance, goal_time))
        except RejectedTrajectoryError as error:
            # the reason may contain names from outside
            reason = str(error)[:_MAX_TEXT_LENGTH]
            self._end(GoalStatus(goal_id, REJECTED, reason), int(error.result))
            # counted and reported with the other refusals
            raise
        self._note(GoalStatus(goal_id, ACTIVE, ""), ended=False)
        warn_of_wall_time(self._refusals, f"{row.name} from {node}" if node else row.name, trajectory)

    def take_cancel(self, _row: Endpoint, message: GoalID, _node: str) -> None:
        """Cancel by identifier, by time (all goals up to it), or everything when both are empty.

        An unknown identifier is remembered for its goal, whether another goal is active or not.

        Raises:
            RejectedCommandError: it cannot be remembered.
        """
        _check_id(message.id)
        name, until = message.id, nanoseconds(message.stamp)
        known = self._recent()
        if name and name not in known:
            if sum(status.status == RECALLING for status, _ in known.values()) >= MAX_REMEMBERED:
                raise RejectedCommandError(
                    f"at most {MAX_REMEMBERED} goals may be cancelled before they arrive; send the goals, or wait "
                    f"{REMEMBERED / NANOSECONDS:g} s"
                )
            self._note(GoalStatus(GoalID(message.stamp, name), RECALLING, ""), ended=True)
        elif name and known[name][1] is not None:
            self._statuses[name] = known[name][0], self.simulation.now
        self._last_cancel = max(self._last_cancel, until)
        goal = self._current()
        if goal is None:
            return
        stamp_ns = nanoseconds(self._statuses[goal.goal_id][0].goal_id.stamp)
        everything = not name and until == 0
        if everything or name == goal.goal_id or (until and stamp_ns <= until):
            self._arm.cancel()

    def goal_status(self, output: Output) -> None:
        """Status of the goals."""
        self._status = output.sample(lambda: GoalStatusArray(header("", self._message_time()), self._published()))

    def goal_feedback(self, output: Output) -> None:
        """Feedback on the active goal, if there is one."""
        output.sample(self._progress)

    def goal_result(self, output: Output) -> None:
        """Result of each goal."""
        self._result = output.advertise()

    def _take_known(self, goal_id: GoalID, status: GoalStatus, ended: int | None) -> None:
        """Recall a goal that was cancelled before it arrived; refuse one that was here already."""
        name = goal_id.id
        if status.status == RECALLING:
            self._end(GoalStatus(goal_id, RECALLED, "cancelled before it arrived"))
            return
        if ended is not None:
            # remembered from its newest copy on
            self._statuses[name] = status, self.simulation.now
        since = "is already active" if ended is None else f"has ended less than {REMEMBERED / NANOSECONDS:g} s ago"
        raise RejectedTrajectoryError(GoalResult.INVALID_GOAL, f"goal {name!r} {since}; send another id")

    def _publish_ended(self, goal: TrajectoryGoal) -> None:
        if goal.goal_id not in self._statuses:
            # set directly on the arm, not through the topic
            return
        goal_id = self._statuses[goal.goal_id][0].goal_id
        status = GoalStatus(goal_id, int(goal.status), goal.reason)
        self._end(status, 0 if goal.result is None else int(goal.result))

    def _end(self, status: GoalStatus, code: int = 0) -> None:
        """Note the status of an ended goal, and publish its result."""
        self._note(status, ended=True)
        self._result.publish(
            control_msgs.FollowJointTrajectoryActionResult(
                header("", self._message_time()), status, control_msgs.FollowJointTrajectoryResult(code, status.text)
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
        """Return the active goal, those that ended recently, and recent cancellations without their goals."""
        now = self.simulation.now
        recent = {
            name: (status, ended)
            for name, (status, ended) in self._statuses.items()
            if ended is None or now - ended <= REMEMBERED
        }
        ended_ones = [
            name for name, (status, ended) in recent.items() if ended is not None and status.status != RECALLING
        ]
        for name in ended_ones[:-MAX_REMEMBERED]:
            del recent[name]
        return recent

    def _published(self) -> list[GoalStatus]:
        """Return what a status message lists: all that is active, and the newest of the rest."""
        recent = self._recent()
        ended_ones = [name for name, (_, ended) in recent.items() if ended is not None]
        for name in ended_ones[:-MAX_PUBLISHED]:
            del recent[name]
        return [status for status, _ in recent.values()]

    def _message_time(self) -> int:
        return self.simulation.clock.message_time()

    def _generated_id(self, node: str) -> str:
        """Generate an identifier in actionlib's form: node, number, time."""
        number, time = 1, seconds(self._message_time())
        while (name := f"{node}-{number}-{time:.9f}") in self._statuses:
            number += 1
        return name


def _check_id(name: str) -> None:
    """Check the length of an identifier; a RejectedTrajectoryError if it is too long to be remembered."""
    if len(name) > MAX_ID_LENGTH:
        raise RejectedTrajectoryError(
            GoalResult.INVALID_GOAL, f"goal id may have at most {MAX_ID_LENGTH} characters (got {len(name)})"
        )
