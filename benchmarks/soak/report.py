"""Report of a long run: a table, and a plot of memory over time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.figure import Figure

from benchmarks.soak.memory import STEADY
from benchmarks.soak.soak import TRACED, SoakResult
from cellwright.clients.operators.plots import svg_text

_COLOUR = "#1f5fa8"
_MIN_SPAN = 10.0  # [MiB]: a smaller range would exaggerate noise


def has_passed(soaked: SoakResult) -> bool:
    """Return whether memory was steady, and both runs were in the same state at every cut."""
    return soaked.first_difference is None and (math.isnan(soaked.growth.end) or soaked.growth.is_steady)


def lines(soaked: SoakResult) -> Iterator[str]:
    """Yield the lines of the table."""
    growth, last = soaked.growth, soaked.whole.get(soaked.rounds, "")
    yield f"{soaked.face}: {soaked.hours:g} simulated hours in one process, {soaked.wall:.0f} s"
    for label, count in sorted(soaked.counts.items()):
        yield _line(label, f"{count:,}")
    if math.isnan(growth.end):
        yield _line("memory", "not reported by this system, or too few rounds for a verdict")
    else:
        verdict = "steady" if growth.is_steady else f"GROWS by more than {STEADY:g} MiB"
        yield _line("memory", f"{growth.start:.1f} MiB early, {growth.end:.1f} MiB late: {verdict}")
        yield _line("slope", f"{growth.slope:+.1f} KiB/h")
    if soaked.grown is not None:
        yield _line(
            "Python's objects", f"{soaked.grown:+.1f} KiB in the last {TRACED - TRACED // 4} of {TRACED} rounds"
        )
        for each in soaked.max_growth[:3]:
            yield _line("", each)
    cut = soaked.first_difference
    if cut is None:
        yield _line("state", f"the same in {len(soaked.pieces)} pieces as in one, at every cut")
    else:
        yield _line("state", f"DIFFERS between one piece and {len(soaked.pieces)}, first at round {cut}")
    yield _line("", last)


def picture(runs: Sequence[SoakResult]) -> str:
    """Return the text of an SVG file: memory over time, one frame for each run."""
    figure = Figure(figsize=(9.0, 2.8 * len(runs)), layout="constrained")
    for run, frame in zip(runs, figure.subplots(len(runs), 1, squeeze=False)[:, 0], strict=True):
        values = np.array([each.memory for each in run.samples])
        values = np.nan_to_num(np.concatenate([values[:1], values]))
        middle, half = (values.min() + values.max()) / 2, max(_MIN_SPAN, 1.1 * np.ptp(values)) / 2
        frame.plot([0.0, *(each.hours for each in run.samples)], values, _COLOUR)
        frame.set_xlim(0.0, run.hours)
        frame.set_ylim(middle - half, middle + half)
        title = f"{run.face}: memory in use over {run.hours:g} simulated hours, slope {run.growth.slope:+.1f} KiB/h"
        frame.set_title(title, loc="left", size="medium", weight="bold")
        frame.set_ylabel("MiB")
        frame.set_xlabel("simulated time [h]")
        frame.grid(color="#ddd")
    return svg_text(figure)


def _line(label: str, text: str) -> str:
    return f"  {label:<22} {text}".rstrip()
