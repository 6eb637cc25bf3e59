"""Target limiter: limits, speeds, accelerations and start guard of targets, and mimic joints.

Pure logic.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cellwright.config.robot.model import Joint
from cellwright.robot.safety import Guard, SafetySettings
from cellwright.robot.servos import FARTHEST, Array
from cellwright.util.errors import RejectedCommandError

NO_SOURCE = -1

_ROUNDING = 1e-12  # of a way, below which it is the same
_WORTH_TELLING = 1e-3  # [rad; m]: limits and targets are written with few digits

Numbers = NDArray[np.intp]
Flags = NDArray[np.bool_]


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
        source: the number of the source that each joint follows; NOBODY where it follows none.
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
        """Have joints go to targets [rad; m].

        Args:
            source: whose targets they are.
            joints: which, by number.
            targets: one for each.
            measured: tells where all joints stand [rad; m].
            guarded: whether they are positions of a stream, which start guard and clutch are meant for.

        Returns:
            Those of the joints whose targets were beyond their limits.

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

    def _jumps(self, joints: Numbers, far: Array, first: Flags, limit: float) -> Flags:
        """Which first targets are farther away than the start guard allows.

        Raises:
            RejectedCommandError: there are some, and they are to be refused.
        """
        is_jump: Flags = first & (far > limit)
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
        k the whole number of steps that it still moves after this one. So it goes as far as leaves that distance.

        Args:
            error: how far these joints have to go [rad; m].
            reach: how far they may go in a step [rad; m].
            seconds: length of the step [s].
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
        arrays = {name: getattr(self, attribute).tolist() for name, attribute in self._arrays().items()}
        return arrays | {"under way": self._is_under_way, "untouched": self._is_untouched}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Take over what `get_state` returned."""
        for name, attribute in self._arrays().items():
            setattr(self, attribute, np.array(state[name], dtype=getattr(self, attribute).dtype))
        self._is_under_way, self._is_untouched = state["under way"], state["untouched"]

    def _arrays(self) -> dict[str, str]:
        """Attributes that make up the state, by their names in it."""
        return _STATE_ARRAYS | {"moved": "_moved"} if len(self._braked) else _STATE_ARRAYS


_STATE_ARRAYS = {
    "desired": "desired",
    "applied": "applied",
    "source": "source",
    "wary": "_wary",
    "slowly": "_slowly",
    "offsets": "_offsets",
}


class MimicJoints:
    """The joints of a robot that mimic another.

    Args:
        joints: all joints with one degree of freedom, in the order of their numbers.
        numbers: their numbers, by name.

    Attributes:
        leaders: name of the joint that is followed, by the name of the one that follows.
    """

    def __init__(self, joints: Sequence[Joint], numbers: Mapping[str, int]) -> None:
        followers = [(joint.name, joint.mimic) for joint in joints if joint.mimic is not None]
        self.leaders = {name: mimic.joint for name, mimic in followers}
        self._ways = [
            (numbers[name], numbers[mimic.joint], mimic.multiplier, mimic.offset) for name, mimic in followers
        ]

    def carry(self, approach: TargetLimiter) -> None:
        """Put each follower to where its leader's applied position has it, within its own limits [rad; m]."""
        for follower, leader, multiplier, offset in self._ways:
            place = multiplier * approach.applied[leader] + offset
            place = min(max(place, approach.lower[follower]), approach.upper[follower])
            approach.applied[follower] = approach.desired[follower] = place
