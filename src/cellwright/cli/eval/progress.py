"""Progress of an evaluation on a console: lines of results, and moving tables of runs and trials."""

from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Self

from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

from cellwright.cli.output import print_line
from cellwright.cli.signals import stopped_by_signals
from cellwright.cli.tables import FOLD, RIGHT, WHOLE, FittedTable, table
from cellwright.running.evaluation.execution.runner import Runner, Running
from cellwright.running.evaluation.execution.seed_queue import SeedQueue
from cellwright.running.evaluation.plan.job import Job
from cellwright.running.evaluation.results import summary
from cellwright.running.evaluation.results.infrastructure import InfrastructureLoss
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.results_file import ResultsFile
from cellwright.util.errors import printable

_REFRESH = 4.0  # [1/s]


class EvalProgress:
    """Progress of an evaluation on a console.

    Args:
        title: subject of the evaluation; empty for the agent of the jobs.
        label: returns the name of a run for people.
        may_end_early: True if their results may make the last of the jobs needless.
    """

    def __init__(
        self,
        console: Console,
        jobs: Sequence[Job],
        *,
        title: str = "",
        label: Callable[[Result], str] = lambda result: result.name,
        may_end_early: bool = False,
    ) -> None:
        self._title = title or f"agent {jobs[0].agent}"
        self._label = label
        self._may_end_early = may_end_early
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
        """Print the number of runs, and how many of them are done."""
        self._results = list(known)
        count = len(self._jobs)
        runs = "run" if count == 1 else "runs"
        at_most = "at most " if self._may_end_early else ""
        print_line(self._console, f"{at_most}{count} {runs}, {self._title}, results in {folder}")
        if known:
            print_line(self._console, f"{len(known)} of them {'has' if len(known) == 1 else 'have'} a result already")

    def take(self, result: Result) -> None:
        """Add a new result, and print it."""
        self._results.append(result)
        done = f"[{len(self._results):>{len(str(len(self._jobs)))}}/{len(self._jobs)}]"
        outcome = result.outcome.replace("_", " ")
        text = f"{done} {self._label(result)}: {result.points:g} of {result.reachable:g} points, {outcome}"
        tail = f", {result.wall:.1f} s" if result.is_done else f": {result.reason}"
        print_line(self._console, text + tail, None if result.is_done else "yellow")

    def show_fault(self, line: str) -> None:
        """Print what the machine did to a run."""
        print_line(self._console, line, "yellow")

    def show_jobs(self, running: Sequence[Running]) -> None:
        """Show the runs in progress."""
        self._running = running

    def _table(self) -> Group:
        # the moving lines stand above: if there are more trials than lines, the end of the table is out of sight
        return Group(Text(), self._runs(), Text(), self._trials())

    def _trials(self) -> FittedTable:
        rows = {trial: [trial, f"0/{count}"] for trial, count in self._counts.items()}
        failed = Counter(result.trial for result in self._results if result.has_failed)
        for each in summary.summarize(self._results):
            figures = [
                f"{each.mean:.4g}",
                f"{each.min:.4g}",
                "-" if each.share is None else f"{each.share:.0%}",
                str(failed[each.trial] or ""),
            ]
            rows[each.trial] = [each.trial, f"{each.runs}/{self._counts[each.trial]}", *figures]
        return table({"trial": FOLD, **dict.fromkeys(("done", "mean", "min", "share", "failed"), RIGHT)}, rows.values())

    def _runs(self) -> FittedTable:
        rows = []
        for each in self._running:
            limit = each.job.trial.time_limit
            end = "" if limit is None else f" of {limit:g}"
            cells = (f"{each.simulated:.0f}{end} s", f"{each.points:g} points", f"{each.wall:.0f} s")
            rows.append([Text(printable(cell), "cyan") for cell in (each.job.name, *cells)])
        columns = {"run": FOLD, **dict.fromkeys(("simulated", "points", "wall"), WHOLE)}
        return table(columns, rows, box=None, show_header=False)


def run_jobs(
    runner: Runner,
    jobs: Sequence[Job],
    store: ResultsFile,
    progress: EvalProgress,
    begin: Callable[[Sequence[Result]], None] = lambda _known: None,
    queue: SeedQueue | None = None,
) -> tuple[list[Result], list[str], list[InfrastructureLoss]]:
    """Run the jobs that have no result yet, until they are done or a signal comes; their progress is shown.

    `begin` receives the known results before anything is run. With a `queue`, which the runner asks for more, only what
    it counts is returned.

    Returns:
        The results of the jobs that have one, in the jobs' order; why there were no more, a line each; and the runs
        that were lost to the infrastructure.
    """
    known = [store.results[job.key] for job in jobs if runner.is_settled(job)]
    progress.begin(known, store.path.parent)
    before = list(store.notices)
    for notice in before:
        progress.show_fault(notice)
    begin(known)
    first = jobs if queue is None else queue.next_jobs()
    if (len(known) < len(jobs) if queue is None else first) and not runner.failure:
        with stopped_by_signals(runner.stop):
            runner.run(first)
            with suppress(OSError):  # it was removed: the runner has reported that
                store.restore()
    for notice in store.notices[len(before) :]:
        progress.show_fault(notice)
    settled = [store.results[job.key] for job in jobs if runner.is_settled(job)]
    results = settled if queue is None else queue.results()
    return results, [*filter(None, [runner.failure])], runner.lost
