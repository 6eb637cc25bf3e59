"""The list of benchmarks, their figures with bounds, and the run of one of them.

A benchmark imports its dependencies when it runs.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from importlib import import_module
from itertools import chain
from pathlib import Path
from subprocess import SubprocessError
from types import ModuleType
from typing import Any, Protocol, TypeAlias

from cellwright.util.errors import CellwrightError, RunEndedError, UnknownNameError


@dataclass(frozen=True)
class Figure:
    """One figure.

    Attributes:
        label: name of the figure, as the table shows it.
        value: the measured value; not a number where it could not be measured here, and then `note` says why.
        unit: of the value, such as `us/step`; `x` for a ratio.
        maximum: upper bound of the value, where there is one.
        minimum: lower bound of the value, where there is one.
        note: method or context of the figure.
    """

    label: str
    value: float
    unit: str = "x"
    maximum: float | None = None
    minimum: float | None = None
    note: str = ""

    @property
    def is_held(self) -> bool:
        """True if the value is within its bounds; a value that is not a number is within none."""
        return (self.maximum is None or self.value <= self.maximum) and (
            self.minimum is None or self.value >= self.minimum
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the same as JSON values; a value that is not a number is null."""
        return {
            "what": self.label,
            "value": self.value if math.isfinite(self.value) else None,
            "unit": self.unit,
            "most": self.maximum,
            "least": self.minimum,
            "held": self.is_held,
            "note": self.note,
        }


@dataclass(frozen=True)
class Curve:
    """Growth of a cost with the size of something, measured at three sizes or more.

    Attributes:
        title: name of the curve.
        size: name of one of what is counted, such as `part`.
        unit: unit of the costs.
        sizes: numbers of them, in rising order.
        costs: the cost at each size.
    """

    title: str
    size: str
    unit: str
    sizes: tuple[float, ...]
    costs: tuple[float, ...]

    @property
    def slope(self) -> float:
        """Cost of one more: slope of the straight line that fits best."""
        return statistics.linear_regression(self.sizes, self.costs).slope

    @property
    def bend(self) -> float:
        """Last cost compared with the straight line through the first one and the one at half the last size.

        It is 1 for linear growth, below 1 for slower growth, up to 2 for a square and 4 for a cube. A flat curve has 1
        as well, where a fitted exponent, or a ratio of two slopes, would divide noise by noise.
        """
        half = min(range(1, len(self.sizes) - 1), key=lambda place: abs(self.sizes[place] - self.sizes[-1] / 2))
        slope = (self.costs[half] - self.costs[0]) / (self.sizes[half] - self.sizes[0])
        return self.costs[-1] / (self.costs[0] + slope * (self.sizes[-1] - self.sizes[0]))

    def figures(self, maximum_bend: float) -> Iterator[Figure]:
        """Yield a figure of each size, then the slope and the bend with its bound."""
        for size, cost in zip(self.sizes, self.costs, strict=True):
            yield Figure(f"{self.title}: {size:g} {self.size}s", cost, self.unit)
        note = "slope of the line that fits best"
        yield Figure(f"{self.title}: one more {self.size}", self.slope, self.unit, note=note)
        note = "1 is linear, 2 a square"
        yield Figure(f"{self.title}: the last / a straight line", self.bend, maximum=maximum_bend, note=note)


OnProgress: TypeAlias = Callable[[str], None]
"""Takes a line about the present measurement."""


class Measure(Protocol):
    """Measures; yields each figure as soon as it is known, so that a long benchmark shows progress. Curves are drawn.

    Raises:
        BenchmarkSkippedError: this machine lacks something that is needed.
    """

    def __call__(self, on_progress: OnProgress, *, quick: bool) -> Iterable[Figure | Curve]:
        """Yield the figures; `quick` takes so few repeats that they only show that everything works."""


class Compare(Protocol):
    """Measures this checkout beside another one; yields figures as `Measure` does."""

    def __call__(self, folder: Path, on_progress: OnProgress, *, quick: bool) -> Iterable[Figure]:
        """Yield the figures, with the other checkout in `folder`."""


class BenchmarkSkippedError(Exception):
    """A benchmark cannot run on this machine; the text says what is missing."""


@dataclass(frozen=True)
class Benchmark:
    """A benchmark of the command line.

    Attributes:
        name: on the command line; also its module in this package, with its function `measure`.
        title: heading of its figures.
        minutes: approximate duration on a laptop.
    """

    name: str
    title: str
    minutes: float

    def measure(self) -> Measure:
        """Return the function that takes its figures."""
        measure: Measure = self._module().measure
        return measure

    def compare(self) -> Compare | None:
        """Return the function that compares two checkouts; None if this benchmark has none."""
        compare: Compare | None = getattr(self._module(), "compare", None)
        return compare

    def about(self) -> tuple[str, ...]:
        """Return its description, paragraph by paragraph."""
        return tuple(" ".join(paragraph.split()) for paragraph in (self._module().__doc__ or "").split("\n\n"))

    def _module(self) -> ModuleType:
        return import_module(f"benchmarks.{self.name}")


BENCHMARKS = (
    Benchmark("step", "A step of the cell", 0.5),
    Benchmark("growth", "Growth with the number of parts", 1.5),
    Benchmark("layouts", "Growth with the numbers of bins, belts and AGVs", 1.5),
    Benchmark("trial", "A trial of 500 s", 4.0),
    Benchmark("pybullet_cell", "The cell compared with PyBullet", 1.0),
    Benchmark("start", "A cold start", 0.2),
    Benchmark("costs", "Marginal costs", 1.0),
    Benchmark("many_cells", "Many cells on one machine", 1.5),
    Benchmark("looking", "Viewing and recording", 3.0),
    Benchmark("pictures", "Pictures of cameras", 0.5),
    Benchmark("environments", "Environments for learning", 0.5),
    Benchmark("robot", "A robot compared with PyBullet", 0.5),
    Benchmark("evaluation", "Many runs in two processes", 3.0),
    Benchmark("ray_cluster", "Many runs on a Ray cluster", 6.0),
    Benchmark("socket", "Over a socket", 2.0),
    Benchmark("teleop", "From a command to motion", 2.5),
    Benchmark("ros1", "Over ROS 1", 2.5),
    Benchmark("ros2", "Over ROS 2", 2.5),
)


def find_benchmark(name: str) -> Benchmark:
    """Return the benchmark of a name.

    Raises:
        UnknownNameError: there is none.
    """
    for benchmark in BENCHMARKS:
        if benchmark.name == name:
            return benchmark
    raise UnknownNameError("benchmark", name, [each.name for each in BENCHMARKS])


@dataclass(frozen=True)
class BenchmarkResult:
    """Result of a benchmark.

    Attributes:
        benchmark: the benchmark.
        figures: its figures; those before the failure, if it failed.
        curves: its curves, one for each panel of its picture.
        skipped: the missing requirement; empty if it ran.
        failed: the error; empty if there was none.
    """

    benchmark: Benchmark
    figures: tuple[Figure, ...] = ()
    curves: tuple[Curve, ...] = ()
    skipped: str = ""
    failed: str = ""

    @property
    def is_held(self) -> bool:
        """True if it did not fail and every bound is held; a skipped one breaks none."""
        return not self.failed and all(figure.is_held for figure in self.figures)

    def as_dict(self) -> dict[str, Any]:
        """Return the same as JSON values."""
        return {
            "name": self.benchmark.name,
            "title": self.benchmark.title,
            "skipped": self.skipped or None,
            "failed": self.failed or None,
            "held": self.is_held,
            "figures": [figure.as_dict() for figure in self.figures],
            "curves": [asdict(curve) for curve in self.curves],
        }


def run_benchmark(
    benchmark: Benchmark, on_progress: OnProgress, *, quick: bool = False, against: Path | None = None
) -> BenchmarkResult:
    """Run a benchmark.

    Args:
        benchmark: the benchmark.
        on_progress: takes a line about the present measurement.
        quick: take so few repeats that the figures only show that everything works.
        against: folder of another checkout, for a benchmark that compares two.

    Returns:
        The result; errors of the benchmark are in it.
    """
    figures: list[Figure] = []
    curves: list[Curve] = []
    skipped = failed = ""
    compare = None if against is None else benchmark.compare()
    try:
        found = benchmark.measure()(on_progress, quick=quick)
        if against is not None and compare is not None:
            found = chain(found, compare(against, on_progress, quick=quick))
        for each in found:  # one that fails keeps what it found before
            if isinstance(each, Curve):
                curves.append(each)
            else:
                figures.append(each)
    except BenchmarkSkippedError as reason:
        skipped = str(reason)
    except (CellwrightError, RunEndedError, SubprocessError, OSError) as error:  # also of a process that it started
        failed = str(error) or type(error).__name__
    return BenchmarkResult(benchmark, tuple(figures), tuple(curves), skipped, failed)
