"""A benchmark taken, and what it found."""

from __future__ import annotations

from dataclasses import dataclass
from subprocess import SubprocessError
from typing import Any

from benchmarks.benchmarks import Benchmark
from benchmarks.figures import BenchmarkSkippedError, Figure, Tell
from cellwright.util.errors import CellwrightError, RunEndedError


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
