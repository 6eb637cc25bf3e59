"""What a benchmark finds: figures with the bounds that they are held to."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias


@dataclass(frozen=True)
class Figure:
    """One figure.

    Attributes:
        what: what was measured, as a reader of the table finds it.
        value: how much; not a number where it could not be measured here, and then `note` says why.
        unit: of the value, such as `us/step`; `x` for a ratio.
        most: what the value is to stay at or below, where there is such a bound.
        least: what the value is to reach, where there is such a bound.
        note: how it was taken, or what has to be known to read it.
    """

    what: str
    value: float
    unit: str = "x"
    most: float | None = None
    least: float | None = None
    note: str = ""

    @property
    def is_held(self) -> bool:
        """Whether the value is within its bounds; a value that is not a number is within none."""
        return (self.most is None or self.value <= self.most) and (self.least is None or self.value >= self.least)

    def as_dict(self) -> dict[str, Any]:
        """The same as JSON values; a value that is not a number is null."""
        return {
            "what": self.what,
            "value": self.value if math.isfinite(self.value) else None,
            "unit": self.unit,
            "most": self.most,
            "least": self.least,
            "held": self.is_held,
            "note": self.note,
        }


Tell: TypeAlias = Callable[[str], None]
"""Takes a line about what is being measured now."""


class Measure(Protocol):
    """Measures; yields each figure as soon as it is known, so that a long benchmark is seen to go on.

    Raises:
        BenchmarkSkippedError: this machine lacks something that is needed.
    """

    def __call__(self, tell: Tell, *, quick: bool) -> Iterable[Figure]:
        """Take the figures; `quick`: with so few repeats that they only show that everything works."""


class BenchmarkSkippedError(Exception):
    """A benchmark cannot be taken on this machine; its text says what is missing."""
