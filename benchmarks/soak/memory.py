"""How much memory this process has, and whether it grows."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np

MEBIBYTE = 1 << 20

STEADY = 4.0
"""A process whose memory has grown by no more than this [MiB] over hours is steady: allocators breathe."""


def resident() -> float:
    """Memory of this process that is in use [MiB]; not a number where the system does not tell (Linux does)."""
    memory = math.nan
    if sys.platform == "linux":
        import resource  # there is none on Windows

        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        memory = pages * resource.getpagesize() / MEBIBYTE
    return memory


@dataclass(frozen=True, slots=True)
class Sample:
    """Memory [MiB] at a simulation time [h]."""

    hours: float
    memory: float


@dataclass(frozen=True, slots=True)
class Growth:
    """How memory went, once everything was loaded and had been used.

    Attributes:
        start: early in the run [MiB]: the median of its second tenth.
        end: late in the run [MiB]: the median of its last tenth.
        slope: of the straight line that fits best behind the first tenth [KiB/h].
    """

    start: float
    end: float
    slope: float

    @property
    def is_steady(self) -> bool:
        """Whether it stayed as it was, but for `STEADY`; what could not be measured is no proof."""
        return self.end - self.start <= STEADY


def growth(samples: Sequence[Sample]) -> Growth:
    """How memory went over a run; needs at least twenty samples to say anything, and says nan before."""
    tenth = len(samples) // 10
    if tenth < 2:
        return Growth(math.nan, math.nan, math.nan)
    late = samples[tenth:]
    times, values = np.array([[each.hours, each.memory] for each in late]).T
    slope = float(np.polyfit(times - times.mean(), values, 1)[0]) * 1024
    early = median(each.memory for each in samples[tenth : 2 * tenth])
    return Growth(early, median(each.memory for each in samples[-tenth:]), slope)
