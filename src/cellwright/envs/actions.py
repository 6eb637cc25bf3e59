"""Actions of an environment: absolute targets in their units, or changes of the targets, scaled to ±1."""

from __future__ import annotations

from typing import Any, Final, Literal, TypeAlias, get_args

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import ArrayLike

from cellwright.config.control import Channel, ControlSpace
from cellwright.envs.stepper import CellStepper
from cellwright.util.errors import UsageError, did_you_mean

Control: TypeAlias = Literal["absolute", "delta"]

TURN_SPEED: Final = 1.0
"""Speed [rad/s] of a target that turns by an action of 1."""
SLIDE_SPEED: Final = 0.5
"""Speed [m/s] of a target that slides by an action of 1."""


class Actions:
    """Meaning of the numbers of an action.

    `absolute`: the targets themselves, in rad and m, as in `ControlSpace`. `delta`: how far the target of each joint
    moves in the period, from where it is, so an arm with 0 holds still. 1 is `TURN_SPEED` or `SLIDE_SPEED`. Suction is
    on above 0 then, and a width goes from closed at -1 to open at 1.

    Args:
        space: channels of the cell.
        control: kind of the actions.
        period: control period [s].

    Attributes:
        box: the space of actions, float32.

    Raises:
        UsageError: there is no such kind.
    """

    def __init__(self, space: ControlSpace, control: Control, period: float) -> None:
        kinds = get_args(Control)
        if control not in kinds:
            close = did_you_mean(str(control), kinds)
            raise UsageError(f"control: must be {' or '.join(kinds)} (got {control!r}){close}")
        self._space = space
        self._is_absolute = control == "absolute"
        self._steps = [period * (SLIDE_SPEED if each.unit == "m" else TURN_SPEED) for each in space.channels]
        if self._is_absolute:
            low, high = ([getattr(each, end) for each in space.channels] for end in ("low", "high"))
            self.box = Box(np.array(low, np.float32), np.array(high, np.float32), dtype=np.float32)
        else:
            self.box = Box(-1.0, 1.0, (len(space.channels),), np.float32)

    def targets(self, action: ArrayLike, stepper: CellStepper) -> list[float]:
        """Return the targets that an action means now.

        Raises:
            UsageError: it has another shape, or a number that is not finite.
        """
        numbers: list[Any] = np.asarray(action, dtype=np.float64).reshape(-1).tolist()
        if self._is_absolute:
            return numbers
        shares = [min(max(each, -1.0), 1.0) for each in numbers]
        desired = stepper.desired()
        if len(shares) != len(desired) or not np.isfinite(numbers).all():
            return self._space.targets(numbers)  # which says what is wrong
        moved = zip(self._space.channels, shares, desired, self._steps, strict=True)
        return [_target(channel, share, present, step) for channel, share, present, step in moved]


def _target(channel: Channel, share: float, present: float, step: float) -> float:
    if channel.kind == "suction":
        return float(share > 0.0)
    if channel.kind == "width":
        return channel.low + 0.5 * (share + 1.0) * (channel.high - channel.low)
    return present + share * step
