"""Action server of a cell: the actionlib protocol on five topics, for one device.

A goal that the device cannot follow is rejected immediately, with the reason in its status. An accepted goal gives
feedback ten times a second. It ends succeeded, aborted or preempted (cancelled or replaced).

Goals and cancellations come on two topics, whose order ROS 1 does not keep. So the server remembers, as actionlib's
does: a cancellation that arrives before its goal, the newest stamp up to which goals were cancelled, and the
identifiers of ended goals. A goal that was cancelled before it arrived is recalled: it never moves the device.
"""

from abc import abstractmethod
from typing import Any

from cellwright.cell.interface.rows import in_namespace
from cellwright.engine.clock import NANOSECONDS, seconds
from cellwright.engine.device import Device, State
from cellwright.middleware.interface.binding import Output
from cellwright.middleware.interface.table import Endpoint
from cellwright.middleware.messages import Message
from cellwright.middleware.messages.conversions import header, nanoseconds, wrapped_stamp
from cellwright.middleware.messages.standard import GoalID, GoalStatus, GoalStatusArray, Header
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


class ActionServer(Device):
    """Action server of one device of a cell. A subclass has the messages of its action.

    Like the original, it remembers its goals. They are part of the state, because the effect of a cancellation depends
    on them.

    Args:
        action: name of the action, as in the table of rows.
        subject: subject of its rows.
    """

    def __init__(self, action: str, subject: str | None = None) -> None:
        super().__init__(action if subject is None else f"{action} {subject}")
        self.topics = f"{in_namespace(action, subject)}/"
        """Begin of the names of its topics."""
        self._statuses: dict[str, tuple[GoalStatus, int | None]] = {}
        """Status of each goal, and the time of its end [ns]; None while it is active."""
        self._last_cancel = 0
        """Newest stamp up to which goals were cancelled [ns]; 0 for none."""

    @abstractmethod
    def _accept(self, name: str, goal: Any, source: str) -> None:
        """Let the device follow a goal, or raise a RejectedCommandError; `source` has its topic and its sender."""

    @abstractmethod
    def _cancel(self) -> None:
        """End the device's active goal."""

    @abstractmethod
    def _active(self) -> str | None:
        """Return the identifier of the device's active goal, which may have come in another way."""

    @abstractmethod
    def _make_result(self, head: Header, status: GoalStatus, outcome: Any) -> Message:
        """Return the message of a result.

        The `outcome` is that of `_note_end`; for a goal that never ran, the error that rejected it, or None.
        """

    @abstractmethod
    def _make_feedback(self, head: Header, status: GoalStatus) -> Message:
        """Return the message of the feedback on the active goal."""

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

    def take_goal(self, row: Endpoint, message: Any, node: str) -> None:
        """Follow a goal, reject it with a result, or recall it if it was cancelled before.

        Raises:
            RejectedCommandError: it is rejected, or its identifier is that of another goal.
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
            self._accept(name, message.goal, f"{row.name} from {node}" if node else row.name)
        except RejectedCommandError as error:
            # the reason may contain names from outside
            self._end(GoalStatus(goal_id, REJECTED, str(error)[:_MAX_TEXT_LENGTH]), error)
            # counted and reported with the other refusals
            raise
        self._note(GoalStatus(goal_id, ACTIVE, ""), ended=False)

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
        current = self._current()
        if current is None:
            return
        stamp_ns = nanoseconds(current.goal_id.stamp)
        everything = not name and until == 0
        if everything or name == current.goal_id.id or (until and stamp_ns <= until):
            self._cancel()

    def goal_status(self, output: Output) -> None:
        """Status of the goals."""
        self._status = output.sample(lambda: GoalStatusArray(self._head(), self._published()))

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
        raise RejectedCommandError(f"goal {name!r} {since}; send another id")

    def _note_end(self, name: str, code: int, reason: str, outcome: Any) -> None:
        """Publish the end of a goal of the device, unless it came in another way."""
        known = self._statuses.get(name)
        if known is not None and known[1] is None:
            self._end(GoalStatus(known[0].goal_id, code, reason), outcome)

    def _end(self, status: GoalStatus, outcome: Any = None) -> None:
        """Note the status of an ended goal, and publish its result."""
        self._note(status, ended=True)
        self._result.publish(self._make_result(self._head(), status, outcome))

    def _progress(self) -> Message | None:
        current = self._current()
        return None if current is None else self._make_feedback(self._head(), current)

    def _current(self) -> GoalStatus | None:
        """Return the status of the active goal if it came on the topic."""
        status, ended = self._statuses.get(self._active() or "", (None, None))
        return status if ended is None else None

    def _head(self) -> Header:
        return header("", self._message_time())

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
    """Check the length of an identifier; a RejectedCommandError if it is too long to be remembered."""
    if len(name) > MAX_ID_LENGTH:
        raise RejectedCommandError(f"goal id may have at most {MAX_ID_LENGTH} characters (got {len(name)})")
