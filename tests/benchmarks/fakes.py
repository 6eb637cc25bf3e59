"""Benchmarks with given results."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from benchmarks.benchmarks import Benchmark, Compare, Curve, Figure, Measure, OnProgress


@dataclass(frozen=True)
class FakeBenchmark(Benchmark):
    """Yields figures, then raises an error if it has one."""

    figures: tuple[Figure | Curve, ...] = ()
    error: BaseException | None = None
    compared: tuple[Figure, ...] = ()

    def about(self) -> tuple[str, ...]:
        return ("What it is.", "How it is measured.")

    def measure(self) -> Measure:
        return self._measure

    def compare(self) -> Compare | None:
        return self._compare if self.compared else None

    def _compare(self, folder: Path, on_progress: OnProgress, *, quick: bool) -> Iterator[Figure]:
        on_progress(f"comparing with {folder.name}{' quickly' if quick else ''}")
        yield from self.compared

    def _measure(self, on_progress: OnProgress, *, quick: bool) -> Iterable[Figure | Curve]:
        return self._found(on_progress, "quickly" if quick else "well")

    def _found(self, on_progress: OnProgress, how: str) -> Iterator[Figure | Curve]:
        on_progress(f"measuring {how}")
        yield from self.figures
        if self.error is not None:
            raise self.error


HELD = Figure("one thing / another", 1.049, maximum=1.15, note="a [note] with a | in it")
BROKEN = Figure("cold start", 1.5, "s", maximum=1.0)
FREE = Figure("steps", 123456.7, "/s")
CURVE = Curve("step", "part", "us/step", (0, 50, 100), (20.0, 30.0, 40.0))
