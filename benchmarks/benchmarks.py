"""The benchmarks there are. What a benchmark needs is imported when it is taken."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from types import ModuleType

from benchmarks.figures import Measure
from cellwright.util.errors import UnknownNameError


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
