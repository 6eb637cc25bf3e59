"""Command `cellwright eval`: a program in many runs, its progress, and a table of the results."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Self

import typer
from rich import box
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from cellwright.cell.kitting.reach import reach
from cellwright.cli import options
from cellwright.cli.arguments import OUTPUT, WORK, Vary
from cellwright.cli.declarations import flag, option
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.signals import stopped_by_signals
from cellwright.config.trial.catalogue import bundled_sensors
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Camera
from cellwright.rendering.backend import requested_backend
from cellwright.running.evaluation.evaluate import Evaluation, Running
from cellwright.running.evaluation.job import EvaluatedTrial, Job, make_jobs, models_digest
from cellwright.running.evaluation.process import MEBIBYTE, MEMORY_IS_LIMITED, Limits, usable_processors
from cellwright.running.evaluation.report import report
from cellwright.running.evaluation.result import Result, ResultsFile
from cellwright.running.evaluation.summary import (
    Threshold,
    junit,
    real_time_factor,
    shortcoming,
    summarize,
    summary_document,
    worst_first,
)
from cellwright.util.errors import UsageError
from cellwright.util.files import write_whole

_MOST_TOLD = 10


def show_summary(console: Console, results: Sequence[Result], threshold: Threshold | None) -> None:
    """Print a row for each trial, and a line for each run that did not pass."""
    console.print()
    console.print(summary_table(results))
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


def summary_table(results: Sequence[Result]) -> Table:
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


_MOST_SEEDS, _MOST_JOBS = 100_000, 1024
_MEMORY = 256.0, 2.0**24  # [MiB]; with less a worker cannot begin

ARM_AND_SENSORS = bundled_sensors()[0]
"""What a trial of the competition lacks, where each team brought its own."""

_LIMITS = "Limits of each run"


def evaluate(
    trials: Annotated[
        list[str],
        typer.Argument(
            metavar="TRIAL",
            help="Trials that come with Cellwright, such as `lesson`, and YAML files; each is a trial of its own.",
            show_default=False,
        ),
    ],
    agent: Annotated[
        str, option("What works the cells: `kitter`, `lesson`, your `path.py:Class` or `module:Class`.", WORK, "AGENT")
    ] = "kitter",
    joined: Annotated[
        list[str] | None,
        option(
            "A file that is joined to each trial, such as one with your arm and sensors; repeatable. "
            f"Without it a trial that has no arm gets `{ARM_AND_SENSORS}`.",
            WORK,
            "FILE",
            "--with",
        ),
    ] = None,
    seeds: Annotated[int, option("Each trial runs with the seeds 1 to N.", WORK, "N")] = 1,
    vary: Vary = False,
    jobs: Annotated[int | None, option("Runs at a time; as many as processors when left out.", WORK, "J")] = None,
    time_limit: Annotated[float, option("Time on the wall clock [s].", _LIMITS, "T")] = 600.0,
    memory_limit: Annotated[float, option("Memory [MiB].", _LIMITS, "M")] = 2048.0,
    min_score: Annotated[
        str | None,
        option("Exit with status 1 when a run is below: points, or `75%` of what is within reach.", OUTPUT, "SCORE"),
    ] = None,
    out: Annotated[Path, option("Where results, logs and reports go.", OUTPUT, "FOLDER")] = Path("evaluation"),
    record: Annotated[
        bool, flag("Record each run that has no result yet, to FOLDER/recordings.", OUTPUT, "--record")
    ] = False,
    as_json: Annotated[bool, flag("Print the summary as JSON on stdout.", OUTPUT, "--json")] = False,
) -> None:
    """Judge a program in many runs, each in a process of its own.

    Results are in FOLDER/results.jsonl as soon as they are there; the same command again goes on where it was stopped.
    At the end FOLDER has report.html for people, junit.xml and summary.json for CI.

        # the bundled agent in five cells that differ a little
        cellwright eval lesson final01 --vary --seeds 5

        # your program in CI: status 1 if a run has less than 75 % of the points
        cellwright eval trial.yaml --agent my_robot.py:MyRobot --min-score 75%

    Exit status: 0 every run is done, and not below --min-score; 1 some are not; 2 bad input, and nothing was started.
    """
    least = None if min_score is None else _threshold(min_score)
    limits = Limits(
        _within("--time-limit", time_limit, 0.1, options.LATEST),
        round(_within("--memory-limit", memory_limit, *_MEMORY) * MEBIBYTE),
    )
    numbers = range(1, int(_within("--seeds", seeds, 1, _MOST_SEEDS)) + 1)
    workers = int(_within("--jobs", usable_processors() if jobs is None else jobs, 1, _MOST_JOBS))
    try:
        wanted = make_jobs(_trials(trials, joined or []), agent, numbers, vary=vary)
    except OSError as error:
        options.refuse(f"{error.filename}: cannot be read: {error.strerror}")
    console = Console(stderr=as_json, highlight=False)
    if not MEMORY_IS_LIMITED:
        console.print("note: on this system the memory of a run is not limited")
    try:
        store = ResultsFile(out)
    except OSError as error:
        options.refuse(f"--out {out}: cannot be written to: {error.strerror}")
    with store:
        results, failures = _work(wanted, store, limits, workers, console, records=record)
    left = len(wanted) - len(results)
    short = [shortcoming(result, least) for result in results]
    status = NOT_DONE if left or failures or any(short) else DONE
    told = len(failures)
    failures += _write(out / "junit.xml", junit(results, least))
    failures += _write(out / "report.html", report(results, least))
    if len(failures) > told:
        status = NOT_DONE
    document = json.dumps(summary_document(results, least, status), indent=2)
    failures += _write(out / "summary.json", document + "\n")
    show_summary(console, results, least)
    if left:
        console.print(f"interrupted: {left} runs are left; the same command goes on with them")
    console.print(f"report      {out / 'report.html'}", markup=False, soft_wrap=True)
    for failure in failures:
        status = NOT_DONE
        typer.echo(f"error: {failure}", err=True)
    if as_json:
        typer.echo(document)
    raise typer.Exit(status)


def _write(file: Path, content: str | bytes) -> list[str]:
    """Write a file that is made of the results; what went wrong, if something did."""
    try:
        write_whole(file, content)
    except OSError as error:  # the results are told all the same
        return [f"{file}: cannot be written: {error.strerror or error}"]
    return []


def _work(
    jobs: Sequence[Job], store: ResultsFile, limits: Limits, workers: int, console: Console, *, records: bool
) -> tuple[list[Result], list[str]]:
    """The results of the jobs that have one, in the jobs' order; and why there were no more, if it could not go on."""
    with EvalProgress(console, jobs) as progress:
        evaluation = Evaluation(
            store,
            limits=limits,
            workers=workers,
            records=records,
            on_result=progress.take,
            on_look=progress.show_running,
        )
        known = [store.results[job.key] for job in jobs if evaluation.is_settled(job)]
        progress.begin(known, store.path.parent)
        if len(known) < len(jobs):
            try:
                problem = evaluation.check_agent(jobs[0].agent)
            except OSError as error:
                problem = f"{error.filename}: {error.strerror}"
            if problem:
                options.refuse(problem)
            with stopped_by_signals(evaluation.stop):
                evaluation.run(jobs)
    results = [store.results[job.key] for job in jobs if evaluation.is_settled(job)]
    return results, [evaluation.failure] if evaluation.failure else []


def _trials(names: Sequence[str], joined: Sequence[str]) -> list[EvaluatedTrial]:
    """The trials, read once: what is wrong with them is told before anything starts."""
    found = []
    for name in dict.fromkeys(names):
        has_arm = load_trial(options.paths([name])).trial.has_arm
        parts = [name, *(joined or ([] if has_arm else [ARM_AND_SENSORS]))]
        trial = options.load(parts)
        if any(isinstance(each, Camera) for each in trial.sensors):
            requested_backend()  # one that does not exist is told once, and not by every run
        found.append((name, parts, trial, reach(trial)))
    how_often = Counter(trial.name for _, _, trial, _ in found)
    return [
        EvaluatedTrial(
            trial.name if how_often[trial.name] == 1 else name,
            tuple(path.resolve() for path in options.paths(parts)),
            could.total,
            could.maximum,
            trial.time_limit,
            models_digest(trial),
            tuple(parts),
        )
        for name, parts, trial, could in found
    ]


def _threshold(text: str) -> Threshold:
    try:
        return Threshold.read(text)
    except UsageError as error:
        options.refuse(f"--min-score {error}")


def _within(option: str, value: float, least: float, most: float) -> float:
    if not least <= value <= most:
        options.refuse(f"{option} {value:g}: give a number from {least:g} to {most:g}")
    return value
