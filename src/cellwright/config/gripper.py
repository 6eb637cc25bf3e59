"""Settings of a parallel gripper as values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias, get_args

from cellwright.util.errors import DescriptionError

Holding: TypeAlias = Literal["weld", "friction"]
"""Hold of a part: by a weld that breaks under too high a load, or by the friction of the pads alone."""

BOUNDS: Mapping[str, tuple[float, float, str]] = {
    "opening": (0.005, 0.5, "m"),
    "force": (1.0, 500.0, "N"),
    "speed": (0.005, 1.0, "m/s"),
    "pad.size": (0.005, 0.2, "m"),
    "pad.friction": (0.05, 3.0, ""),
}
"""Smallest and largest value of each setting, and its unit."""

HOLDINGS: tuple[Holding, ...] = get_args(Holding)


@dataclass(frozen=True, slots=True)
class Pad:
    """Pads of the fingers: flat, and equal on both.

    Attributes:
        size: width across the finger and length along it [m].
        friction: coefficient of dry friction with any part.
    """

    size: tuple[float, float] = (0.022, 0.038)
    friction: float = 1.0

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            DescriptionError: values are out of bounds.
        """
        _check({"pad.size": self.size, "pad.friction": (self.friction,)})


@dataclass(frozen=True, slots=True)
class ParallelGripperSettings:
    """Parallel gripper with two fingers that move against each other, at equal distances from the middle.

    Attributes:
        opening: largest distance between the pads [m].
        force: largest gripping force [N]: the forces of both fingers together, as makers state it. A held part bears
            loads up to the pads' friction times this force.
        speed: speed at which the distance between the pads changes [m/s].
        pad: the pads.
        holds: its way to hold a part.

    Raises:
        DescriptionError: values are out of bounds.

    Example:
        >>> ParallelGripperSettings(opening=0.085, force=60.0, holds="friction").load
        60.0
        >>> ParallelGripperSettings(opening=2.0)
        Traceback (most recent call last):
        cellwright.util.errors.DescriptionError: gripper: opening: must be from 0.005 to 0.5 m (got 2)
    """

    opening: float = 0.1
    force: float = 40.0
    speed: float = 0.1
    pad: Pad = field(default_factory=Pad)
    holds: Holding = "weld"

    def __post_init__(self) -> None:
        """Check the values."""
        problems = []
        if self.holds not in HOLDINGS:
            problems.append(f"gripper: holds: must be {' or '.join(HOLDINGS)} (got {self.holds!r})")
        _check({"opening": (self.opening,), "force": (self.force,), "speed": (self.speed,)}, problems)

    @property
    def load(self) -> float:
        """Largest load [N] that the pads' friction bears."""
        return self.pad.friction * self.force


def _check(values: Mapping[str, tuple[float, ...]], problems: list[str] | None = None) -> None:
    """Raise DescriptionError with these problems and all values that are out of bounds, if there are any."""
    problems = list(problems or ())
    for key, numbers in values.items():
        lower, upper, unit = BOUNDS[key]
        # in this form, NaN is out of bounds too
        problems += [
            f"gripper: {key}: must be from {f'{lower:g} to {upper:g} {unit}'.rstrip()} (got {number:g})"
            for number in numbers
            if not lower <= number <= upper
        ]
    if problems:
        raise DescriptionError(problems)
