"""Memory of this process, and its growth."""

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
"""Growth [MiB] over hours up to which memory is steady: allocators breathe."""


def resident() -> float:
    """Return the resident memory of this process [MiB]; nan where the system does not report it (Linux does)."""
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
    """Growth of memory, once everything was loaded and used.

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
        """True if it grew by at most `STEADY`; False if it could not be measured."""
        return self.end - self.start <= STEADY


def growth(samples: Sequence[Sample]) -> Growth:
    """Return the growth of memory over a run; values are nan for fewer than twenty samples."""
    tenth = len(samples) // 10
    if tenth < 2:
        return Growth(math.nan, math.nan, math.nan)
    late = samples[tenth:]
    times, values = np.array([[each.hours, each.memory] for each in late]).T
    slope = float(np.polyfit(times - times.mean(), values, 1)[0]) * 1024
    early = median(each.memory for each in samples[tenth : 2 * tenth])
    return Growth(early, median(each.memory for each in samples[-tenth:]), slope)
