"""Safety of commands: settings, the gate that admits or refuses, rate-limited notices, and the limiter of targets."""

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cellwright.engine.clock import NANOSECONDS, nanoseconds
from cellwright.robot.interface import COMMAND_TOPICS
from cellwright.robot.servos import MAX_POSITION, Array
from cellwright.util.errors import RejectedCommandError, UnknownNameError, UsageError

RESUME_SPEED = 0.5
"""Speed of joints towards their first targets after a hold [rad/s; m/s]."""
TIP_SPEED, TIP_TURNING = 2.0, 2.0 * math.pi
"""Maximum speed of an arm's tip towards a pose [m/s], and of its rotation [rad/s]."""

MAX_NAMES = 256
"""Maximum number of names that are kept; the limit protects memory from clients."""
MAX_LINES_PER_SECOND = 20
"""Maximum number of lines about rare events in a second; further ones are only counted."""
_MAX_NAME_LENGTH = 80
_MAX_NAMES_PER_LINE = 3  # in one line
COMMANDER_TIMEOUT = 1.0
"""Time [s] after its newest command for which a node counts as commander."""
_STAMP_MEMORY = nanoseconds(1.0)  # after this time a node may use older stamps, as after its restart
NO_SOURCE = -1
_ROUNDING = 1e-12  # relative difference below which distances are equal
_MIN_LOGGED_DIFFERENCE = 1e-3  # [rad; m]: limits and targets are written with few digits


class Guard(StrEnum):
    """Reaction to a first target that is too far away."""

    REFUSE = "refuse"
    """Messages are refused until one is near enough."""
    BLEND = "blend"
    """The robot goes there at the resume speed."""


@dataclass(frozen=True)
class SafetySettings:
    """Safety settings of a robot.

    Always on: names that the robot does not have are ignored, invalid messages are refused whole, and targets are kept
    within the limits of the joints. All else changes how a robot behaves, and is off by default.

    Attributes:
        start_disabled: take no commands until enabled by the service.
        silence: hold the joints of a topic that has been silent for this time [s].
        max_speeds: speed limits of targets [rad/s; m/s], by patterns of joint names; the last match counts. A joint
            never moves faster than its URDF allows.
        start_guard: maximum distance [rad; m] of a first target from the joint's position; first after the start, and
            after each hold and homing.
        guard: reaction to a first target farther away.
        resume_speed: speed of joints towards their first targets after a hold [rad/s; m/s].
        one_commander: take a topic's commands from one node only, until it has been silent for this time [s].
        max_age: refuse commands with a stamp older than this [s], and those out of order.
        tip_speed: speed of an arm's tip towards a pose [m/s]; None: 2 m/s.
        tip_turning: speed of its rotation [rad/s]; None: one turn a second.
        clutch: make targets relative to the first target and the joint's position then, so that a client need not begin
            at the robot's posture.
        command_topics: names of the topics that command the robot, as the operators of io_teleop publish poses beside
            the joint targets that follow from them; messages on other topics are ignored. Empty: all command it.
    """

    start_disabled: bool = False
    silence: float | None = None
    max_speeds: tuple[tuple[str, float], ...] = ()
    start_guard: float | None = None
    guard: Guard = Guard.REFUSE
    resume_speed: float = RESUME_SPEED
    one_commander: float | None = None
    max_age: float | None = None
    tip_speed: float | None = None
    tip_turning: float | None = None
    clutch: bool = False
    command_topics: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Validate the settings.

        Raises:
            UsageError: a number is not above 0.
            UnknownNameError: a name is not that of a command topic.
        """
        for topic in self.command_topics:
            if topic not in COMMAND_TOPICS:
                raise UnknownNameError("command topic", topic, COMMAND_TOPICS)
        named = {
            "watchdog": self.silence,
            "start guard": self.start_guard,
            "resume speed": self.resume_speed,
            "one commander": self.one_commander,
            "max age": self.max_age,
            "tip speed": self.tip_speed,
            "tip turning": self.tip_turning,
            **{f"max speed of {pattern}": speed for pattern, speed in self.max_speeds},
        }
        for name, value in named.items():
            if value is not None and not 0.0 < value < math.inf:
                raise UsageError(f"{name} must be a finite number above 0 (got {value:g})")

    def speeds(self, joints: Sequence[str], own: Array) -> Array:
        """Return speed limits of the joints' targets [rad/s; m/s]; infinite where only the URDF (`own`) limits them.

        Raises:
            UnknownNameError: a pattern that fits no joint.
        """
        found = np.full(len(joints), math.inf)
        for pattern, speed in self.max_speeds:
            fits = [fnmatchcase(joint, pattern) for joint in joints]
            if not any(fits):
                raise UnknownNameError("joint", pattern, joints)
            found[fits] = speed
        limited: Array = np.where(np.isfinite(found), np.minimum(found, own), math.inf)
        return limited


class Notices:
    """Log of rate-limited lines: each kind at most once a second, or only once."""

    def __init__(self, now: Callable[[], int], report: Callable[[str], None]) -> None:
        self._now, self._report = now, report
        self._last: dict[str, int] = {}
        self._log_times: deque[int] = deque(maxlen=MAX_LINES_PER_SECOND)  # times of the newest lines [ns]
        self._suppressed = 0
        self._once: set[str] = set()
        self.unknown: list[str] = []
        """Unknown joint names in commands, in the order of their first use."""

    def log(self, line: str) -> None:
        """Log a rare event; events in a flood are partly counted instead."""
        now = self._now()
        if len(self._log_times) == MAX_LINES_PER_SECOND and 0 <= now - self._log_times[0] < NANOSECONDS:
            self._suppressed += 1
            return
        self._log_times.append(now)
        more = f" ({self._suppressed} lines suppressed before)" if self._suppressed else ""
        self._suppressed = 0
        self._report(f"{line}{more}")

    def log_throttled(self, kind: str, line: str) -> None:
        """Log a line unless one of its kind was logged less than a second ago."""
        now, last = self._now(), self._last.get(kind)
        if last is None or not 0 <= now - last < NANOSECONDS:
            self._last[kind] = now
            self._report(line)

    def log_limits(self, topic: str, beyond: Sequence[tuple[str, float, float, float]]) -> None:
        """Log targets beyond limits, throttled: (joint, requested position, lower limit, upper limit), [rad; m]."""
        shown = [
            f"{joint} to {lower:.4g} .. {upper:.4g} (got {requested:.4g})"
            for joint, requested, lower, upper in beyond[:_MAX_NAMES_PER_LINE]
        ]
        more = f" (and {len(beyond) - _MAX_NAMES_PER_LINE} more)" if len(beyond) > _MAX_NAMES_PER_LINE else ""
        self.log_throttled(f"limits {topic}", f"{topic}: clipped to limits: {'; '.join(shown)}{more}")

    def log_once(self, name: str, line: str) -> None:
        """Log a line once for a name."""
        if name not in self._once and len(self._once) < MAX_NAMES:
            self._once.add(name)
            self._report(line)

    def log_unknown(self, topic: str, names: Mapping[str, str]) -> None:
        """Log each ignored name of a command once, with the reason; all in one line."""
        lines: list[str] = []
        if len(self._once) >= MAX_NAMES and len(self.unknown) >= MAX_NAMES:
            return  # new names are not kept, and a long message must not delay the physics
        for name, why in names.items():
            shown = name if len(name) <= _MAX_NAME_LENGTH else f"{name[: _MAX_NAME_LENGTH - 3]}..."
            if len(self.unknown) < MAX_NAMES and shown not in self.unknown:
                self.unknown.append(shown)
            key = f"{topic} {shown}"
            if key not in self._once and len(self._once) < MAX_NAMES:
                self._once.add(key)
                lines.append(f"{shown!r} {why}")
        if lines:
            more = f" and {len(lines) - _MAX_NAMES_PER_LINE} more" if len(lines) > _MAX_NAMES_PER_LINE else ""
            self._report(f"{topic}: {', '.join(lines[:_MAX_NAMES_PER_LINE])}{more}; ignored (logged once)")


class _Stream(NamedTuple):
    """Newest command that was taken on a topic: its node, its time of arrival [ns], and its stamp [ns]."""

    node: str
    heard: int
    stamp: int


class CommandGate:
    """Gate of commands: admits or refuses them, by the node's own time and that of messages.

    Args:
        safety: safety settings.
        now: returns the time of the run [ns].
        message_time: returns the time that messages carry [ns].
        offset: returns by how much message time is ahead of the run's [ns], as after a reset that kept the clock.
    """

    def __init__(
        self,
        safety: SafetySettings,
        now: Callable[[], int],
        message_time: Callable[[], int],
        offset: Callable[[], int] = lambda: 0,
    ) -> None:
        self._now, self._message_time, self._offset = now, message_time, offset
        self.arrived = message_time()
        """Arrival of the newest input, in the time of message stamps [ns]."""
        self._streams: dict[str, _Stream] = {}
        limits = (safety.silence, safety.one_commander, safety.max_age)
        self._silence, self._exclusive, self._age = (None if each is None else nanoseconds(each) for each in limits)

    def forget(self) -> None:
        """Clear."""
        self._streams.clear()

    def note_arrival(self, _input: object = None) -> None:
        """Note that input has arrived now."""
        self.arrived = self._message_time()

    def check(self, topic: str, node: str, stamp: int) -> None:
        """Check a command before it is carried out; `stamp` [ns] 0 means that it has none.

        Raises:
            RejectedCommandError: it is refused.
        """
        newest, limit = self._streams.get(topic), self._age
        quiet = 0 if newest is None else self._now() - newest.heard
        if newest is not None and self._exclusive is not None and newest.node != node and quiet <= self._exclusive:
            raise RejectedCommandError(
                f"{newest.node or 'another node'} commands this topic; others may after {self._exclusive / 1e9:g} s "
                "of silence"
            )
        if limit is None or not stamp:
            return
        age = self.arrived - stamp
        if age > limit:
            raise RejectedCommandError(f"stamp must be at most {limit / 1e9:g} s old (got {age / 1e9:.3g} s)")
        if age < -limit:
            raise RejectedCommandError(f"stamp is {-age / 1e9:.3g} s ahead of the node's clock")
        is_known = newest is not None and newest.node == node and quiet <= _STAMP_MEMORY
        if newest is not None and is_known and stamp < newest.stamp:
            raise RejectedCommandError(
                f"stamp is {(newest.stamp - stamp) / 1e9:.3g} s older than that of the previous command"
            )

    def confirm(self, topic: str, node: str, stamp: int) -> None:
        """Note a command that was carried out."""
        self._streams[topic] = _Stream(node, self._now(), stamp)

    def is_silent(self, topic: str) -> bool:
        """Return True if a topic has been silent for too long; False without a limit, and before its first command."""
        newest = self._streams.get(topic)
        return newest is not None and self._silence is not None and self._now() - newest.heard > self._silence

    @property
    def commanders(self) -> tuple[str, ...]:
        """Nodes with recently taken commands."""
        since = self._now() - nanoseconds(COMMANDER_TIMEOUT)
        return tuple(sorted({each.node for each in self._streams.values() if each.node and each.heard >= since}))

    def get_state(self) -> dict[str, Any]:
        """Return the state, as JSON values, with stamps in the time of the run."""
        offset = self._offset()
        return {topic: [node, heard, stamp and stamp - offset] for topic, (node, heard, stamp) in self._streams.items()}

    def set_state(self, state: dict[str, Any]) -> None:
        """Restore what `get_state` returned."""
        offset = self._offset()
        self._streams = {
            topic: _Stream(node, heard, stamp and stamp + offset) for topic, (node, heard, stamp) in state.items()
        }


Numbers = NDArray[np.intp]
_NONE: Numbers = np.zeros(0, dtype=np.intp)


class TargetLimiter:
    """Limiter of the targets of all joints, in the order of their indices.

    A joint follows one source of commands at a time, from its first command until a hold, or until another source
    commands it. After a hold the first targets are approached slowly, until the joint has caught up.

    Args:
        joints: names of the joints.
        lower, upper: their limits [rad; m]; infinite for none.
        speeds: the URDF's speed limits [rad/s; m/s].
        safety: safety settings.
        accelerations: acceleration limits of targets [rad/s^2; m/s^2]; infinite for none. A target with such a limit
            never moves faster than its joint, and brakes in time to stop at its destination.

    Attributes:
        desired: positions that commands request [rad; m], within limits.
        applied: positions that the joints get [rad; m].
        source: index of the source that each joint follows; NO_SOURCE for none.
    """

    def __init__(
        self,
        joints: tuple[str, ...],
        lower: Array,
        upper: Array,
        speeds: Array,
        safety: SafetySettings,
        accelerations: Array | None = None,
    ) -> None:
        count = len(joints)
        self._joints = joints
        self.lower, self.upper = np.maximum(lower, -MAX_POSITION), np.minimum(upper, MAX_POSITION)
        self._speeds = safety.speeds(joints, speeds)
        self._slow = np.minimum(np.minimum(self._speeds, speeds), safety.resume_speed)
        self._safety = safety
        bounds = np.full(count, np.inf) if accelerations is None else accelerations
        self._braked: Numbers = np.flatnonzero(np.isfinite(bounds))  # joints with an acceleration limit
        self._accelerations = bounds[self._braked]
        self._speeds[self._braked] = np.minimum(self._speeds, speeds)[self._braked]
        self._moved = np.zeros(len(self._braked))  # motion of these in the newest step [rad; m]
        self._has_limits = bool(np.isfinite(self._speeds).any())
        self.desired, self.applied = np.zeros(count), np.zeros(count)
        self.source = np.full(count, NO_SOURCE)
        self._wary, self._slowly = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
        self._offsets = np.zeros(count)
        self._is_under_way = False
        self._is_untouched = True  # no target since the beginning
        self._arrays = ["desired", "applied", "source", "_wary", "_slowly", "_offsets"]  # the state
        if len(self._braked):
            self._arrays.append("_moved")

    def begin(self, positions: Array) -> None:
        """Start at positions [rad; m], with nothing commanded."""
        self.desired, self.applied = positions.copy(), positions.copy()
        self.source[:] = NO_SOURCE
        self._wary[:] = self._slowly[:] = False
        self._offsets[:] = self._moved[:] = 0.0
        self._is_under_way = False
        self._is_untouched = True

    def hold_until_commanded(self, positions: Array) -> None:
        """Hold positions [rad; m], unless there was a command: a robot that nothing holds may sink."""
        if self._is_untouched:
            self.desired = np.clip(positions, self.lower, self.upper)
            self.applied = self.desired.copy()

    def hold(self, positions: Array, joints: Numbers | slice = slice(None)) -> None:
        """Hold joints at positions [rad; m] of all joints; earlier targets are discarded."""
        within = np.clip(positions, self.lower, self.upper)
        self.desired[joints] = self.applied[joints] = within[joints]
        stopped = np.zeros(len(within), dtype=bool)
        stopped[joints] = True
        self._moved[stopped[self._braked]] = 0.0
        self._is_under_way, self._is_untouched = True, False
        self.source[joints] = NO_SOURCE
        self._slowly[joints] = False
        self._wary[joints] = True

    def release(self) -> None:
        """Treat the next command of each joint as its first; current motions continue."""
        self.source[:] = NO_SOURCE
        self._wary[:] = False

    def lead(self, joints: Numbers, positions: Array) -> None:
        """Set positions [rad; m] of joints on the node's own request: without guard and clutch, within limits."""
        self.source[joints] = NO_SOURCE
        self.desired[joints] = np.clip(positions, self.lower[joints], self.upper[joints])
        self._is_under_way, self._is_untouched = True, False
        self._wary[joints] = self._slowly[joints] = False

    def follow(
        self, source: int, joints: Numbers, targets: Array, measured: Callable[[], Array], *, guarded: bool = True
    ) -> Numbers:
        """Set targets [rad; m] of joints from a source.

        Args:
            source: its index.
            joints: numbers of the joints.
            targets: their targets [rad; m].
            measured: returns the positions of all joints.
            guarded: applies start guard and clutch, for positions of a stream.

        Returns:
            Those joints whose targets were beyond their limits.

        Raises:
            RejectedCommandError: the start guard refuses a first target; nothing was changed.
        """
        first = self.source[joints] != source
        is_first = np.count_nonzero(first) > 0
        slowly = first & self._wary[joints] if is_first else first
        if guarded and self._safety.clutch:
            self._offsets[joints] = np.where(first, self.applied[joints] - targets, self._offsets[joints])
            targets = targets + self._offsets[joints]
        elif guarded and self._safety.start_guard is not None and is_first:
            slowly |= self._jumps(joints, np.abs(targets - measured()[joints]), first, self._safety.start_guard)
        within = targets.clip(self.lower[joints], self.upper[joints])
        if is_first:  # a joint that follows this source already was neither held nor approached since
            self._slowly[joints] |= slowly
            self._wary[joints] = False
            self.source[joints] = source
        self.desired[joints] = within
        self._is_under_way, self._is_untouched = True, False
        is_beyond = np.abs(targets - within) > _MIN_LOGGED_DIFFERENCE
        beyond: Numbers = joints[is_beyond] if np.count_nonzero(is_beyond) else _NONE
        return beyond

    def _jumps(self, joints: Numbers, far: Array, first: NDArray[np.bool_], limit: float) -> NDArray[np.bool_]:
        """Select first targets beyond the start guard; raise an error if the guard refuses them."""
        is_jump: NDArray[np.bool_] = first & (far > limit)
        if is_jump.any() and self._safety.guard is Guard.REFUSE:
            worst = int(np.argmax(np.where(is_jump, far, 0.0)))
            raise RejectedCommandError(
                f"{self._joints[joints[worst]]} would jump by {far[worst]:.2g} at the start (the guard allows "
                f"{limit:g}); begin nearer to the robot's posture, or reset it"
            )
        return is_jump

    def advance(self, seconds: float) -> bool:
        """Move the applied positions towards the desired ones for a time; return whether they changed."""
        if not self._is_under_way:
            return False
        if self._has_limits or self._slowly.any():
            reach = np.where(self._slowly, self._slow, self._speeds) * seconds
            error = self.desired - self.applied
            is_there = np.abs(error) <= reach
            applied = np.where(is_there, self.desired, self.applied + np.clip(error, -reach, reach))
            if len(self._braked):
                chosen = self._braked
                applied[chosen] = self._brake(error[chosen], reach[chosen], seconds)
                is_there[chosen] = (applied[chosen] == self.desired[chosen]) & (self._moved == 0.0)
            self.applied = applied
            self._slowly &= ~is_there
            self._is_under_way = not is_there.all()
        else:
            self.applied = self.desired.copy()
            self._is_under_way = False
        return True

    def _brake(self, error: Array, reach: Array, seconds: float) -> Array:
        """Return the limited targets after a step [rad; m], so that they stop at their destinations.

        A target that moves by s in a step, and brakes by b in each later one, still covers (k + 1) s - b k (k + 1) / 2.
        Here k is the whole number of steps for which it moves after this one. So s is the largest step that leaves this
        distance: of the `error` [rad; m], no more than `reach`.
        """
        by = self._accelerations * seconds * seconds
        far = np.abs(error)
        later = np.floor((np.sqrt(1.0 + 8.0 * far / by) - 1.0) / 2.0)
        ahead = np.minimum(far / (later + 1.0) + by * later / 2.0, reach)
        motion = np.clip(np.copysign(ahead, error), self._moved - by, self._moved + by)
        lands = np.abs(motion - error) <= _ROUNDING * (far + by)
        self._moved = np.where(lands & (far == 0.0), 0.0, motion)
        found: Array = np.where(lands, self.desired[self._braked], self.applied[self._braked] + motion)
        return found

    def get_state(self) -> dict[str, Any]:
        """Return the state, as JSON values."""
        arrays = {name.lstrip("_"): getattr(self, name).tolist() for name in self._arrays}
        return arrays | {"under way": self._is_under_way, "untouched": self._is_untouched}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Restore what `get_state` returned."""
        for name in self._arrays:
            setattr(self, name, np.array(state[name.lstrip("_")], dtype=getattr(self, name).dtype))
        self._is_under_way, self._is_untouched = state["under way"], state["untouched"]
