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
from cellwright.robot.servos import FARTHEST, Array
from cellwright.util.errors import RejectedCommandError, UnknownNameError, UsageError

RESUME_SPEED = 0.5
"""How fast joints go to their first targets after they were held [rad/s; m/s]."""
TIP_SPEED, TIP_TURNING = 2.0, 2.0 * math.pi
"""How fast the tip of an arm is brought to a pose [m/s], and turned on the way [rad/s]."""


class Guard(StrEnum):
    """What becomes of a first target that is too far away."""

    REFUSE = "refuse"
    """The message is refused, until one comes that is near enough."""
    BLEND = "blend"
    """The robot goes there, with the speed of resuming."""


@dataclass(frozen=True)
class SafetySettings:
    """What is guarded against.

    Always: names that the robot does not have are passed over, messages that make no sense are refused whole, targets
    are kept within the limits of the joints. All else changes how a robot behaves, and is off until it is asked for.

    Attributes:
        start_disabled: take no commands until enabled by the service.
        silence: hold the joints that a topic commands when nothing has come on it for so long [s].
        max_speeds: how fast targets may move [rad/s; m/s], by patterns of joint names; the last that fits counts. A
            joint is never moved faster than its URDF says.
        start_guard: how far [rad; m] a first target may be from where the joint stands; first after the start and
            whenever the robot was held or has gone home.
        guard: what becomes of one that is farther away.
        resume_speed: how fast joints go to their first targets after they were held [rad/s; m/s].
        one_commander: take a topic's commands from one node only, until it has been silent for so long [s].
        max_age: refuse commands whose stamp is older than so long [s], and those that come out of order.
        tip_speed: how fast the tip of an arm is brought to a pose [m/s]; None: 2 m/s.
        tip_turning: how fast it is turned on the way [rad/s]; None: one turn a second.
        clutch: targets count from where they and the joint were at first, so that whoever commands need not begin
            where the robot stands.
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

    def __post_init__(self) -> None:
        """Refuse what makes no sense.

        Raises:
            UsageError: a number that is not above 0.
        """
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
                raise UsageError(f"{name}: give a number above 0, not {value:g}")

    def speeds(self, joints: Sequence[str], own: Array) -> Array:
        """How fast the targets of joints may move [rad/s; m/s]; infinite where only the URDF (`own`) limits it.

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


MAX_NAMES = 256
"""So many names are kept; they come from outside, and must not eat the memory."""

MAX_LINES_PER_SECOND = 20
"""So many lines about what happens seldom are told in a second; what is switched on and off in a flood is counted."""

_MAX_NAME_LENGTH = 80
_MAX_NAMES_PER_LINE = 3  # names in one line


class Notices:
    """Lines for people, each kind at most once a second, or once for all."""

    def __init__(self, now: Callable[[], int], report: Callable[[str], None]) -> None:
        self._now, self._report = now, report
        self._told: dict[str, int] = {}
        self._said: deque[int] = deque(maxlen=MAX_LINES_PER_SECOND)  # when the newest lines were told [ns]
        self._untold = 0
        self._once: set[str] = set()
        self.unknown: list[str] = []
        """Names that commands gave and the robot does not have, in the order in which they came."""

    def tell(self, line: str) -> None:
        """Tell of something that happens seldom; of what happens in a flood some lines, and how many there were."""
        now = self._now()
        if len(self._said) == MAX_LINES_PER_SECOND and 0 <= now - self._said[0] < NANOSECONDS:
            self._untold += 1
            return
        self._said.append(now)
        more = f" (and {self._untold} lines more since the last one)" if self._untold else ""
        self._untold = 0
        self._report(f"{line}{more}")

    def tell_now_and_then(self, kind: str, line: str) -> None:
        """Tell of something unless something of its kind was told less than a second ago."""
        now, last = self._now(), self._told.get(kind)
        if last is None or not 0 <= now - last < NANOSECONDS:
            self._told[kind] = now
            self._report(line)

    def tell_of_limits(self, topic: str, beyond: Sequence[tuple[str, float, float, float]]) -> None:
        """Tell now and then of targets beyond limits: (joint, what it was asked for, least, greatest), [rad; m]."""
        said = [
            f"{joint} was asked for {asked:.4g}, and goes from {lower:.4g} to {upper:.4g}"
            for joint, asked, lower, upper in beyond[:_MAX_NAMES_PER_LINE]
        ]
        more = f" (and {len(beyond) - _MAX_NAMES_PER_LINE} more)" if len(beyond) > _MAX_NAMES_PER_LINE else ""
        self.tell_now_and_then(f"limits {topic}", f"{topic}: kept within limits: {'; '.join(said)}{more}")

    def tell_once(self, name: str, line: str) -> None:
        """Tell of a name once."""
        if name not in self._once and len(self._once) < MAX_NAMES:
            self._once.add(name)
            self._report(line)

    def tell_of_unknown(self, topic: str, names: Mapping[str, str]) -> None:
        """Tell once of names that a command gave and that are passed over, with the reason for each; in one line."""
        told: list[str] = []
        if len(self._once) >= MAX_NAMES and len(self.unknown) >= MAX_NAMES:
            return  # whatever comes now is not kept, and a stranger's long message must not hold up the physics
        for name, why in names.items():
            said = name if len(name) <= _MAX_NAME_LENGTH else f"{name[: _MAX_NAME_LENGTH - 3]}..."
            if len(self.unknown) < MAX_NAMES and said not in self.unknown:
                self.unknown.append(said)
            key = f"{topic} {said}"
            if key not in self._once and len(self._once) < MAX_NAMES:
                self._once.add(key)
                told.append(f"{said!r} {why}")
        if told:
            more = f" and {len(told) - _MAX_NAMES_PER_LINE} more such names" if len(told) > _MAX_NAMES_PER_LINE else ""
            self._report(f"{topic}: {', '.join(told[:_MAX_NAMES_PER_LINE])}{more}; passed over (told once)")


COMMANDER_TIMEOUT = 1.0
"""So long [s] after its newest command a node is still said to command."""

_STAMP_MEMORY = nanoseconds(1.0)  # after so long a node may begin anew with older stamps, as when it was restarted


class _Stream(NamedTuple):
    """The newest command that was taken on a topic: from which node, when [ns], and its stamp [ns]."""

    node: str
    heard: int
    stamp: int


class CommandGate:
    """Lets commands pass, or refuses them, by the node's own time `now` [ns] and that of messages, `told` [ns]."""

    def __init__(self, safety: SafetySettings, now: Callable[[], int], told: Callable[[], int]) -> None:
        self._now, self._told = now, told
        self.arrived = told()
        """When the newest input came, as the stamps of messages count [ns]."""
        self._streams: dict[str, _Stream] = {}
        limits = (safety.silence, safety.one_commander, safety.max_age)
        self._silence, self._alone, self._age = (None if each is None else nanoseconds(each) for each in limits)

    def forget(self) -> None:
        """Begin anew."""
        self._streams.clear()

    def note_arrival(self, _given: object = None) -> None:
        """Take note that something has come now."""
        self.arrived = self._told()

    def check(self, topic: str, node: str, stamp: int) -> None:
        """Look at a command before it is carried out; `stamp` [ns] 0 means that it has none.

        Raises:
            RejectedCommandError: it is not to be carried out.
        """
        newest, limit = self._streams.get(topic), self._age
        quiet = 0 if newest is None else self._now() - newest.heard
        if newest is not None and self._alone is not None and newest.node != node and quiet <= self._alone:
            raise RejectedCommandError(
                f"{newest.node or 'another'} commands here; another may when it has been silent for "
                f"{self._alone / 1e9:g} s"
            )
        if limit is None or not stamp:
            return
        age = self.arrived - stamp
        if age > limit:
            raise RejectedCommandError(f"it is {age / 1e9:.3g} s old, and {limit / 1e9:g} s are allowed")
        if age < -limit:
            raise RejectedCommandError(f"its stamp is {-age / 1e9:.3g} s ahead of the node's clock")
        is_known = newest is not None and newest.node == node and quiet <= _STAMP_MEMORY
        if newest is not None and is_known and stamp < newest.stamp:
            raise RejectedCommandError(f"it is {(newest.stamp - stamp) / 1e9:.3g} s older than the one before it")

    def confirm(self, topic: str, node: str, stamp: int) -> None:
        """Take note of a command that was carried out."""
        self._streams[topic] = _Stream(node, self._now(), stamp)

    def is_silent(self, topic: str) -> bool:
        """Whether a topic has been silent for too long; never where nothing has come yet, or nobody asked for it."""
        newest = self._streams.get(topic)
        return newest is not None and self._silence is not None and self._now() - newest.heard > self._silence

    @property
    def commanders(self) -> tuple[str, ...]:
        """The nodes whose commands were taken a moment ago."""
        since = self._now() - nanoseconds(COMMANDER_TIMEOUT)
        return tuple(sorted({each.node for each in self._streams.values() if each.node and each.heard >= since}))

    def get_state(self) -> dict[str, Any]:
        """All of it, as JSON values."""
        return {topic: list(each) for topic, each in self._streams.items()}

    def set_state(self, state: dict[str, Any]) -> None:
        """Take over what `get_state` returned."""
        self._streams = {topic: _Stream(*each) for topic, each in state.items()}


NO_SOURCE = -1

_ROUNDING = 1e-12  # of a way, below which it is the same
_WORTH_TELLING = 1e-3  # [rad; m]: limits and targets are written with few digits

Numbers = NDArray[np.intp]


class TargetLimiter:
    """Targets of all joints, in the order of their indices.

    A joint follows one source of commands at a time, from its first command until it is held or another source
    commands it. A hold leaves it wary: what comes next is approached slowly, until it has been caught up with.

    Args:
        joints: names of the joints.
        lower, upper: their limits [rad; m]; infinite where there are none.
        speeds: the URDF's limits of speed [rad/s; m/s].
        safety: what is guarded against.
        accelerations: how fast targets may change their speed [rad/s^2; m/s^2]; infinite where there is no bound. A
            target with such a bound never moves faster than its joint, and brakes in time for where it is to stop.

    Attributes:
        desired: where commands want the joints [rad; m], within limits.
        applied: what they are given [rad; m].
        source: the number of the source that each joint follows; NO_SOURCE where it follows none.
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
        self.lower, self.upper = np.maximum(lower, -FARTHEST), np.minimum(upper, FARTHEST)
        self._speeds = safety.speeds(joints, speeds)
        self._slow = np.minimum(np.minimum(self._speeds, speeds), safety.resume_speed)
        self._safety = safety
        bounds = np.full(count, np.inf) if accelerations is None else accelerations
        self._braked: Numbers = np.flatnonzero(np.isfinite(bounds))  # whose acceleration is bounded
        self._accelerations = bounds[self._braked]
        self._speeds[self._braked] = np.minimum(self._speeds, speeds)[self._braked]
        self._moved = np.zeros(len(self._braked))  # by how much these went in the newest step [rad; m]
        self._has_limits = bool(np.isfinite(self._speeds).any())
        self.desired, self.applied = np.zeros(count), np.zeros(count)
        self.source = np.full(count, NO_SOURCE)
        self._wary, self._slowly = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
        self._offsets = np.zeros(count)
        self._is_under_way = False
        self._is_untouched = True  # nothing has been asked for since the beginning
        self._arrays = ["desired", "applied", "source", "_wary", "_slowly", "_offsets"]  # that make up the state
        if len(self._braked):
            self._arrays.append("_moved")

    def begin(self, positions: Array) -> None:
        """Stand at positions [rad; m], with nothing commanded yet."""
        self.desired, self.applied = positions.copy(), positions.copy()
        self.source[:] = NO_SOURCE
        self._wary[:] = self._slowly[:] = False
        self._offsets[:] = self._moved[:] = 0.0
        self._is_under_way = False
        self._is_untouched = True

    def stand(self, positions: Array) -> None:
        """Stand at positions [rad; m], unless something has been asked for: a robot that nothing holds may sink."""
        if self._is_untouched:
            self.desired = np.clip(positions, self.lower, self.upper)
            self.applied = self.desired.copy()

    def hold(self, positions: Array, joints: Numbers | slice = slice(None)) -> None:
        """Hold joints at positions [rad; m] of all joints: what was asked for is forgotten."""
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
        """Let the next command of each joint be its first one; where the joints go now stays as it is."""
        self.source[:] = NO_SOURCE
        self._wary[:] = False

    def lead(self, joints: Numbers, positions: Array) -> None:
        """Have joints go to positions [rad; m] by the node's own wish: past guard and clutch, within limits."""
        self.source[joints] = NO_SOURCE
        self.desired[joints] = np.clip(positions, self.lower[joints], self.upper[joints])
        self._is_under_way, self._is_untouched = True, False
        self._wary[joints] = self._slowly[joints] = False

    def follow(
        self, source: int, joints: Numbers, targets: Array, measured: Callable[[], Array], *, guarded: bool = True
    ) -> Numbers:
        """Have joints go to targets [rad; m] of a source; those of them whose targets were beyond their limits.

        `measured` tells where all joints stand. Start guard and clutch are meant for what is `guarded`: positions of a
        stream.

        Raises:
            RejectedCommandError: the start guard refuses a first target; nothing was changed then.
        """
        first = self.source[joints] != source
        is_jump = first & False
        if guarded and self._safety.clutch:
            self._offsets[joints] = np.where(first, self.applied[joints] - targets, self._offsets[joints])
            targets = targets + self._offsets[joints]
        elif guarded and self._safety.start_guard is not None and first.any():
            is_jump = self._jumps(joints, np.abs(targets - measured()[joints]), first, self._safety.start_guard)
        within = np.clip(targets, self.lower[joints], self.upper[joints])
        self._slowly[joints] |= (first & self._wary[joints]) | is_jump
        self._wary[joints] = False
        self.source[joints] = source
        self.desired[joints] = within
        self._is_under_way, self._is_untouched = True, False
        beyond: Numbers = joints[np.abs(targets - within) > _WORTH_TELLING]
        return beyond

    def _jumps(self, joints: Numbers, far: Array, first: NDArray[np.bool_], limit: float) -> NDArray[np.bool_]:
        """Which first targets are farther away than the start guard allows; refuses them, where it is to."""
        is_jump: NDArray[np.bool_] = first & (far > limit)
        if is_jump.any() and self._safety.guard is Guard.REFUSE:
            worst = int(np.argmax(np.where(is_jump, far, 0.0)))
            raise RejectedCommandError(
                f"{self._joints[joints[worst]]} would jump by {far[worst]:.2g} at the start (the guard allows "
                f"{limit:g}): begin nearer to where the robot stands, or reset it"
            )
        return is_jump

    def advance(self, seconds: float) -> bool:
        """Bring what is applied nearer to what is desired, as far as `seconds` allow; whether it changed."""
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
        """Where the targets with bounded accelerations are after a step [rad; m]; they stop where they are to be.

        A target that goes s in a step and brakes by b in each later one has (k + 1) s - b k (k + 1) / 2 before it, with
        k the whole number of steps that it still moves after this one. So it goes as far as leaves that distance: of
        the `error` [rad; m], no more than `reach`.
        """
        by = self._accelerations * seconds * seconds
        far = np.abs(error)
        later = np.floor((np.sqrt(1.0 + 8.0 * far / by) - 1.0) / 2.0)
        ahead = np.minimum(far / (later + 1.0) + by * later / 2.0, reach)
        way = np.clip(np.copysign(ahead, error), self._moved - by, self._moved + by)
        lands = np.abs(way - error) <= _ROUNDING * (far + by)
        self._moved = np.where(lands & (far == 0.0), 0.0, way)
        found: Array = np.where(lands, self.desired[self._braked], self.applied[self._braked] + way)
        return found

    def get_state(self) -> dict[str, Any]:
        """All of it, as JSON values."""
        arrays = {name.lstrip("_"): getattr(self, name).tolist() for name in self._arrays}
        return arrays | {"under way": self._is_under_way, "untouched": self._is_untouched}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Take over what `get_state` returned."""
        for name in self._arrays:
            setattr(self, name, np.array(state[name.lstrip("_")], dtype=getattr(self, name).dtype))
        self._is_under_way, self._is_untouched = state["under way"], state["untouched"]
