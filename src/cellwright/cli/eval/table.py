"""What an evaluation comes to, as people read it in 80 columns."""

from __future__ import annotations

from collections.abc import Sequence

from rich import box
from rich.console import Console
from rich.table import Table

from cellwright.running.evaluation.result import Result
from cellwright.running.evaluation.summary import Threshold, real_time_factor, shortcoming, summarize, worst_first

_MOST_TOLD = 10


def show(console: Console, results: Sequence[Result], threshold: Threshold | None) -> None:
    """Print a row for each trial, and a line for each run that did not pass."""
    console.print()
    console.print(table(results))
    short = [(result, shortcoming(result, threshold)) for result in worst_first(results)]
    short = [(result, why) for result, why in short if why]
    for result, why in short[:_MOST_TOLD]:
        console.print(f"  {result.name}: {why}", markup=False, soft_wrap=True)
    if len(short) > _MOST_TOLD:
        console.print(f"  and {len(short) - _MOST_TOLD} more")
    lines = [
        ("passed", f"{len(results) - len(short)} of {len(results)} runs"),
        ("speed", f"{real_time_factor(results):.1f} x real time in each process"),
    ]
    for name, text in lines:
        console.print(f"{name:<10}  {text}", markup=False)


def table(results: Sequence[Result]) -> Table:
    """A row for each trial."""
    found = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False)
    found.add_column("trial", overflow="fold")
    for heading in ("runs", "mean", "min", "max", "reach", "share"):
        found.add_column(heading, justify="right", no_wrap=True)
    found.add_column("outcomes")
    for each in summarize(results):
        outcomes = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in each.outcomes.items())
        numbers = (each.mean, each.least, each.most, each.reachable)
        cells = [f"{number:.4g}" for number in numbers]
        found.add_row(each.trial, str(each.runs), *cells, f"{each.share:.0%}", outcomes)
    return found
