"""Report of benchmarks: figures in words, the table in a terminal, the page as Markdown, and progress."""

from __future__ import annotations

import datetime
import math
import statistics
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from benchmarks.benchmarks import BenchmarkResult, Curve, Figure, OnProgress
from cellwright.cli.output import progress_bar
from cellwright.recording.plots.style import COLOURS, FAINT, SETTINGS

if TYPE_CHECKING:
    from matplotlib.figure import Figure as MatplotlibFigure

WIDTH = 120
"""Length of a line of text."""
HEAD = """# Benchmarks

What does Cellwright cost in time and memory? `make bench` (`python -m benchmarks --write docs/benchmarks.md`) measures
it on your machine and writes this page. It exits with status 1 if a figure is outside its bound.

## Reading the tables

- **Compare ratios, not times.** A ratio (`x`) compares two things in one run on one machine, and is similar elsewhere.
  A time is valid only for the machine below, in its state then.
- A **bound** is a target of the project. Figures without a bound are for information.
- The best of several repeats counts, unless a note says otherwise: other work can only slow a machine down. Compared
  things run in turn.
- `make bench AGAINST=FOLDER` also runs the trial in another checkout of Cellwright, which needs no installation: for
  one of the last commit, `git worktree add ../before HEAD`. Alone: `python -m benchmarks trial --against FOLDER`.
- A skipped benchmark names what this machine lacks.
- To find where the time goes: `python -m cProfile -o FILE -m python -m benchmarks NAME`.
"""
_PANEL_WIDTH, _PANEL_HEIGHT = 2.75, 2.4  # of a curve [in]; three fit the page


def value_text(figure: Figure) -> str:
    """Return the value in about three digits with its unit; a dash where there is none."""
    if not math.isfinite(figure.value):
        return "-"
    return f"{number_text(figure.value)} {figure.unit}".rstrip()


def number_text(value: float) -> str:
    """Return a number in about three digits, never as a power of ten; a count in full."""
    size = abs(value)
    if isinstance(value, int) or size >= 100:
        return f"{value:.0f}"
    return f"{value:.{1 if size >= 10 else 2 if size >= 1 else 3}f}"


def bound_text(figure: Figure) -> str:
    """Return the bound of the value; empty where there is none."""
    bounds = [
        f"{sign} {limit:.4g}" for sign, limit in (("≥", figure.minimum), ("≤", figure.maximum)) if limit is not None
    ]
    return ", ".join(bounds)


def verdict_text(figure: Figure) -> str:
    """Return the verdict on the bound; empty where there is none."""
    if not bound_text(figure):
        return ""
    return "held" if figure.is_held else "NOT HELD"


def show(console: Console, taken: BenchmarkResult, *, with_verdicts: bool) -> None:
    """Print the figures of a benchmark.

    Args:
        console: the console.
        taken: the benchmark.
        with_verdicts: print for each figure if its bound is held.
    """
    console.print()
    console.print(Text(taken.benchmark.title, style="bold"))
    if taken.figures:
        console.print(_table(taken, with_verdicts=with_verdicts))
    for word, reason in (("skipped", taken.skipped), ("failed", taken.failed)):
        if reason:
            console.print(f"{word}: {reason}", markup=False, soft_wrap=True, style="yellow")


def _table(taken: BenchmarkResult, *, with_verdicts: bool) -> Table:
    found = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False)
    found.add_column("figure", ratio=1)
    for heading in ("value", "bound"):
        found.add_column(heading, justify="right", no_wrap=True)
    if with_verdicts:
        found.add_column("", no_wrap=True)
    for figure in taken.figures:
        cells = [_label(figure), Text(value_text(figure)), Text(bound_text(figure))]
        if with_verdicts:
            cells.append(Text(verdict_text(figure), style="" if figure.is_held else "bold red"))
        found.add_row(*cells)
    return found


def _label(figure: Figure) -> Text:
    text = Text(figure.label)
    if figure.note:
        text.append(f"\n  {figure.note}", style="dim")
    return text


def page(
    taken: Sequence[BenchmarkResult], machine: Mapping[str, str], day: datetime.date, *, quick: bool = False
) -> str:
    """Return the whole page.

    Args:
        taken: the benchmarks, in the order of the page.
        machine: the machine that they ran on.
        day: the date.
        quick: mark the figures as rough.
    """
    rough = (
        ["", "**These figures are rough:** taken with `--quick`, they only show that everything works."]
        if quick
        else []
    )
    about = [("date", day.isoformat()), *machine.items()]
    lines = [HEAD.rstrip(), *rough, "", "## The machine", "", *table(("", ""), about)]
    for each in taken:
        lines += ["", f"## {each.benchmark.title}", *_section(each, with_verdicts=not quick)]
    return "\n".join(lines) + "\n"


def _section(taken: BenchmarkResult, *, with_verdicts: bool) -> Iterator[str]:
    for paragraph in (f"`python -m benchmarks {taken.benchmark.name}`", *taken.benchmark.about()):
        yield from ("", *textwrap.wrap(paragraph, WIDTH, break_long_words=False, break_on_hyphens=False))
    if taken.figures:
        yield ""
        rows = [
            (
                figure.label,
                value_text(figure),
                bound_text(figure),
                verdict_text(figure) if with_verdicts else "",
                figure.note,
            )
            for figure in taken.figures
        ]
        yield from table(("figure", "value", "bound", "", "note"), rows)
    if taken.curves:
        titles = ", ".join(curve.title for curve in taken.curves)
        yield from ("", f"![{taken.benchmark.title}: {titles}]({picture_name(taken)})")
    for word, reason in (("Skipped", taken.skipped), ("Failed", taken.failed)):
        if reason:
            yield from ("", f"{word}: {cell(reason)}.")


def picture_name(taken: BenchmarkResult) -> str:
    """Return the file of a benchmark's curves, relative to the page."""
    return f"images/benchmark-{taken.benchmark.name}.svg"


def picture(curves: Sequence[Curve]) -> MatplotlibFigure:
    """Draw curves side by side: the measured costs, and the straight line that fits them best."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(SETTINGS):
        drawn = Figure(figsize=(_PANEL_WIDTH * len(curves), _PANEL_HEIGHT), layout="constrained")
        for curve, axes in zip(curves, drawn.subplots(1, len(curves), squeeze=False)[0], strict=True):
            first, last = curve.sizes[0], curve.sizes[-1]
            middle, mean = statistics.fmean(curve.sizes), statistics.fmean(curve.costs)
            line = [mean + curve.slope * (size - middle) for size in (first, last)]
            label = f"{number_text(curve.slope)} {curve.unit} a {curve.size}"
            axes.plot([first, last], line, color=FAINT, linestyle=(0, (4, 3)), linewidth=0.9, label=label)
            axes.plot(curve.sizes, curve.costs, color=COLOURS[0], marker="o", markersize=3.5)
            axes.set_ylim(0.0, 1.15 * max(*curve.costs, *line))
            axes.set_title(curve.title)
            axes.set_xlabel(f"{curve.size}s")
            axes.set_ylabel(curve.unit)
            axes.legend(loc="lower right")
    return drawn


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    """Yield a table of Markdown, a line at a time."""
    yield _row(heads)
    yield "|" + "---|" * len(heads)
    yield from map(_row, rows)


def _row(cells: Sequence[str]) -> str:
    return "|" + "|".join(f" {cell(text)} " if text else " " for text in cells) + "|"


def cell(text: str) -> str:
    """Return a text that fits a cell: on one line, and without characters that would end it."""
    return " ".join(text.split()).replace("|", "\\|")


@contextmanager
def progress_line(console: Console, title: str) -> Iterator[OnProgress]:
    """Yield a function that shows lines about a benchmark while it runs."""
    with progress_bar(console, title, None) as moving:

        def on_progress(line: str) -> None:
            if moving is None:
                console.print(f"{title}: {line}", markup=False, soft_wrap=True)
            else:
                moving(None, line)

        yield on_progress
