"""What somebody sees while an evaluation works: on a terminal a table that moves, elsewhere a line for each result."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Self

from rich import box
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from cellwright.running.evaluation.evaluate import Running
from cellwright.running.evaluation.job import Job
from cellwright.running.evaluation.result import Result
from cellwright.running.evaluation.summary import summarize

_REFRESH = 4.0  # [1/s]


class EvalProgress:
    """Tells on a console how an evaluation goes."""

    def __init__(self, console: Console, jobs: Sequence[Job]) -> None:
        self._console = console
        self._jobs = jobs
        self._counts = Counter(job.trial.name for job in jobs)
        self._results: list[Result] = []
        self._running: Sequence[Running] = ()
        self._live = Live(console=console, refresh_per_second=_REFRESH, transient=True, get_renderable=self._table)

    def __enter__(self) -> Self:
        if self._console.is_interactive:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._console.is_interactive:
            self._live.stop()

    def begin(self, known: Sequence[Result], folder: Path) -> None:
        """Say what there is to do, and what of it is done."""
        self._results = list(known)
        count = len(self._jobs)
        self._line(f"{count} {'run' if count == 1 else 'runs'}, agent {self._jobs[0].agent}, results in {folder}")
        if known:
            self._line(f"{len(known)} of them {'has' if len(known) == 1 else 'have'} a result from before")

    def take(self, result: Result) -> None:
        """A new result."""
        self._results.append(result)
        done = f"[{len(self._results):>{len(str(len(self._jobs)))}}/{len(self._jobs)}]"
        outcome = result.outcome.replace("_", " ")
        text = f"{done} {result.name}: {result.points:g} of {result.reachable:g} points, {outcome}"
        tail = f", {result.wall:.1f} s" if result.is_done else f": {result.reason}"
        self._line(text + tail, None if result.is_done else "yellow")

    def show_running(self, running: Sequence[Running]) -> None:
        """What is being worked at this moment."""
        self._running = running

    def _line(self, text: str, style: str | None = None) -> None:
        self._console.print(text, markup=False, soft_wrap=True, style=style)

    def _table(self) -> Group:
        # what moves stands above: where there are more trials than lines, the end of the table is not seen
        return Group(Text(), self._runs(), Text(), self._trials())

    def _trials(self) -> Table:
        found = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False)
        found.add_column("trial")
        for heading in ("done", "mean", "min", "share", "lost"):
            found.add_column(heading, justify="right")
        summaries = {each.trial: each for each in summarize(self._results)}
        lost_of = Counter(result.trial for result in self._results if result.is_lost)
        for trial, count in self._counts.items():
            summary = summaries.get(trial)
            if summary is None:
                found.add_row(trial, f"0/{count}", "", "", "", "")
                continue
            lost = lost_of[trial]
            numbers = [f"{summary.mean:.4g}", f"{summary.least:.4g}", f"{summary.share:.0%}", str(lost or "")]
            found.add_row(trial, f"{summary.runs}/{count}", *numbers)
        return found

    def _runs(self) -> Table:
        found = Table(box=None, show_header=False, pad_edge=False)
        for each in self._running:
            limit = each.job.trial.time_limit
            end = f" of {limit:g}" if limit > 0 else ""
            cells = (f"{each.simulated:.0f}{end} s", f"{each.points:g} points", f"{each.wall:.0f} s")
            found.add_row(each.job.name, *cells, style="cyan")
        return found
