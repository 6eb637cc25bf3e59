"""Limiter of the targets of all joints: start guard, clutch, slow approach, and limits of speed and acceleration."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cellwright.robot.safety import Guard, SafetySettings
from cellwright.robot.servos import MAX_POSITION, Array
from cellwright.util.errors import RejectedCommandError

Numbers = NDArray[np.intp]
NO_SOURCE = -1
_NONE: Numbers = np.zeros(0, dtype=np.intp)
_ROUNDING = 1e-12  # relative difference below which distances are equal
_MIN_LOGGED_DIFFERENCE = 1e-3  # [rad; m]: limits and targets are written with few digits


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
            # The first target means the place where the joint is; later ones move it by the difference to the first.
            self._offsets[joints] = np.where(first, self.applied[joints] - targets, self._offsets[joints])
            targets = targets + self._offsets[joints]
        elif guarded and self._safety.start_guard is not None and is_first:
            slowly |= self._jumps(joints, np.abs(targets - measured()[joints]), first, self._safety.start_guard)
        within = targets.clip(self.lower[joints], self.upper[joints])
        # A joint that follows this source already was neither held nor approached since.
        if is_first:
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
