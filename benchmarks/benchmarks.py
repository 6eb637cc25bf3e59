"""Benchmarks that there are, the figures they find with their bounds, and taking one of them.

What a benchmark needs is imported when it is taken.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import import_module
from subprocess import SubprocessError
from types import ModuleType
from typing import Any, Protocol, TypeAlias

from cellwright.util.errors import CellwrightError, RunEndedError, UnknownNameError


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


@dataclass(frozen=True)
class Benchmark:
    """A benchmark that can be asked for.

    Attributes:
        name: on the command line; also its module in this package, whose `measure` takes it.
        title: heading of its figures.
        minutes: about how long it takes on a laptop.
    """

    name: str
    title: str
    minutes: float

    def measure(self) -> Measure:
        """What takes it."""
        measure: Measure = self._module().measure
        return measure

    def about(self) -> tuple[str, ...]:
        """What is measured and how, paragraph by paragraph."""
        return tuple(" ".join(paragraph.split()) for paragraph in (self._module().__doc__ or "").split("\n\n"))

    def _module(self) -> ModuleType:
        return import_module(f"benchmarks.{self.name}")


BENCHMARKS = (
    Benchmark("step", "A step of the cell", 0.5),
    Benchmark("trial", "A trial of 500 s", 4.0),
    Benchmark("pybullet_cell", "The cell beside PyBullet", 1.0),
    Benchmark("start", "A cold start", 0.2),
    Benchmark("costs", "One more of something", 1.0),
    Benchmark("looking", "Looking on, and keeping it", 3.0),
    Benchmark("robot", "A robot beside PyBullet", 0.5),
    Benchmark("evaluation", "Many runs in two processes", 3.0),
    Benchmark("socket", "Over a socket", 2.0),
    Benchmark("teleop", "From a command to motion", 2.5),
    Benchmark("ros1", "Over ROS 1", 2.5),
)


def find_benchmark(name: str) -> Benchmark:
    """The benchmark of a name.

    Raises:
        UnknownNameError: there is none.
    """
    for benchmark in BENCHMARKS:
        if benchmark.name == name:
            return benchmark
    raise UnknownNameError("benchmark", name, [each.name for each in BENCHMARKS])


@dataclass(frozen=True)
class Taken:
    """A benchmark that was taken, or tried.

    Attributes:
        benchmark: which.
        figures: what it found; all that was found before it failed, if it did.
        skipped: what this machine lacks for it; empty if nothing.
        failed: what went wrong; empty if nothing.
    """

    benchmark: Benchmark
    figures: tuple[Figure, ...] = ()
    skipped: str = ""
    failed: str = ""

    @property
    def is_held(self) -> bool:
        """Whether it did not fail and every bound is held; one that was skipped breaks none."""
        return not self.failed and all(figure.is_held for figure in self.figures)

    def as_dict(self) -> dict[str, Any]:
        """The same as JSON values."""
        return {
            "name": self.benchmark.name,
            "title": self.benchmark.title,
            "skipped": self.skipped or None,
            "failed": self.failed or None,
            "held": self.is_held,
            "figures": [figure.as_dict() for figure in self.figures],
        }


def take(benchmark: Benchmark, tell: Tell, *, quick: bool = False) -> Taken:
    """Take a benchmark.

    Args:
        benchmark: which.
        tell: takes a line about what is being measured.
        quick: with so few repeats that the figures only show that everything works.
    """
    figures: list[Figure] = []
    skipped = failed = ""
    try:
        for figure in benchmark.measure()(tell, quick=quick):
            figures.append(figure)  # noqa: PERF402 - one that fails keeps what it found before
    except BenchmarkSkippedError as reason:
        skipped = str(reason)
    except (CellwrightError, RunEndedError, SubprocessError, OSError) as error:  # also of a process that it started
        failed = str(error) or type(error).__name__
    return Taken(benchmark, tuple(figures), skipped, failed)
