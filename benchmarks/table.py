"""What a benchmark found, as people read it in 80 columns."""

from __future__ import annotations

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from benchmarks import words
from benchmarks.figures import Figure
from benchmarks.taking import Taken


def show(console: Console, taken: Taken, *, judged: bool) -> None:
    """Print the figures of a benchmark.

    Args:
        console: where to.
        taken: the benchmark.
        judged: whether to say of each figure if its bound is held.
    """
    console.print()
    console.print(Text(taken.benchmark.title, style="bold"))
    if taken.figures:
        console.print(_table(taken, judged=judged))
    for word, reason in (("skipped", taken.skipped), ("failed", taken.failed)):
        if reason:
            console.print(f"{word}: {reason}", markup=False, soft_wrap=True, style="yellow")


def _table(taken: Taken, *, judged: bool) -> Table:
    found = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False)
    found.add_column("figure", ratio=1)
    for heading in ("value", "bound"):
        found.add_column(heading, justify="right", no_wrap=True)
    if judged:
        found.add_column("", no_wrap=True)
    for figure in taken.figures:
        cells = [_named(figure), Text(words.value(figure)), Text(words.bound(figure))]
        if judged:
            cells.append(Text(words.verdict(figure), style="" if figure.is_held else "bold red"))
        found.add_row(*cells)
    return found


def _named(figure: Figure) -> Text:
    text = Text(figure.what)
    if figure.note:
        text.append(f"\n  {figure.note}", style="dim")
    return text
