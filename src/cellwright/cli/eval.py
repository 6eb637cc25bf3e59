"""Command `cellwright eval`: runs of a program in many trials, its progress, and a table of the results."""

import json
from collections import Counter
from collections.abc import Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from statistics import fmean
from typing import Annotated, Any, NoReturn, Self

import typer
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from cellwright.cell.kitting.attainable import attainable_score
from cellwright.cli import options
from cellwright.cli.arguments import (
    AGENT_HELP,
    OUTPUT,
    SIMULATION,
    AsJson,
    EvaluationView,
    OpenPage,
    Vary,
    ViewHost,
    ViewPort,
    page_options,
)
from cellwright.cli.main import DONE, NOT_DONE, TRY_AGAIN, argument, flag, option
from cellwright.cli.options import N
from cellwright.cli.output import FOLD, RIGHT, WHOLE, print_entry, print_line, table, write_result
from cellwright.cli.signals import stopped_by_signals
from cellwright.cli.watch import page_beside
from cellwright.config.trial.catalogue import bundled_sensors
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import PictureCameraConfig
from cellwright.rendering.backend import requested_backend
from cellwright.running.evaluation import summary
from cellwright.running.evaluation.engine import Engine, Running
from cellwright.running.evaluation.evaluate import Evaluation
from cellwright.running.evaluation.job import EvaluatedTrial, Job, make_jobs, models_digest, repeated
from cellwright.running.evaluation.merge import PLAN_NAME, plan_of, plan_text
from cellwright.running.evaluation.on_ray.evaluation import RayEvaluation
from cellwright.running.evaluation.parquet import TABLE_NAME, parquet_table
from cellwright.running.evaluation.process import DISK_FULL, MEBIBYTE, MEMORY_IS_LIMITED, RunLimits, usable_processors
from cellwright.running.evaluation.report import report
from cellwright.running.evaluation.result import RESULTS_NAME, Result, ResultsFile
from cellwright.running.evaluation.shard import Shard
from cellwright.running.evaluation.state_pictures import draw_worst
from cellwright.running.evaluation.sweep import Sweep, check_effect, variant_name, variants
from cellwright.running.evaluation.trackers import Status
from cellwright.running.evaluation.tracking import Tracking, final_metrics, parameters_of
from cellwright.util.plugins import is_installed

_MAX_REASONS = 10


def show_summary(
    console: Console,
    results: Sequence[Result],
    threshold: summary.Threshold | None,
    repeats: Sequence[summary.Repeat] = (),
) -> None:
    """Print a row for each trial, and a line for each run that did not pass or not repeat."""
    console.print()
    console.print(summary_table(results))
    if rows := summary.measure_rows(summary.summarize(results)):
        console.print()
        figures = dict.fromkeys(("mean", "95 %", "spread"), RIGHT)
        console.print(table({"trial": FOLD, "figure": WHOLE, **figures}, rows))
    short = [(result, summary.shortcoming(result, threshold)) for result in summary.worst_first(results)]
    short = [(result, reason) for result, reason in short if reason]
    _print_first(console, [f"{result.name}: {reason}" for result, reason in short])
    passed = f"{len(results) - len(short)} of {len(results)} runs"
    print_entry(console, "passed", summary.with_interval(passed, summary.passed_interval(results, threshold)))
    if results:
        share = f"{fmean(result.share for result in results):.0%} of the attainable points"
        print_entry(console, "share", summary.with_interval(share, summary.share_interval(results)))
    if repeats:
        different = [repeat for repeat in repeats if repeat.difference]
        _print_first(console, [f"{repeat.first.name} is not repeatable: {repeat.difference}" for repeat in different])
        print_entry(
            console, "repeated", f"{len(repeats) - len(different)} of {len(repeats)} runs ended in the same state"
        )
    if same := [trial for trial, group in summary.by_trial(results).items() if summary.are_same(group)]:
        print_entry(console, "note", f"all runs are the same, whatever the seed: {', '.join(same)} (see --vary)")
    print_entry(console, "speed", f"{summary.real_time_factor(results):.1f} x real time in each process")


def _print_first(console: Console, lines: Sequence[str]) -> None:
    for line in lines[:_MAX_REASONS]:
        print_line(console, f"  {line}")
    if len(lines) > _MAX_REASONS:
        console.print(f"  and {len(lines) - _MAX_REASONS} more")


def summary_table(results: Sequence[Result]) -> Table:
    """Return a table with a row for each trial."""
    figures = dict.fromkeys(("runs", "mean", "95 %", "min", "max", "reach"), RIGHT)
    rows = []
    for each in summary.summarize(results):
        outcomes = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in each.outcomes.items())
        points = [f"{number:.4g}" for number in (each.mean, each.min, each.max, each.reachable)]
        points.insert(1, summary.range_text(each.mean_interval))
        rows.append([each.trial, str(each.runs), *points, outcomes])
    return table({"trial": FOLD, **figures, "outcomes": {}}, rows)


_REFRESH = 4.0  # [1/s]


class EvalProgress:
    """Progress of an evaluation on a console."""

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
        """Print the number of runs, and how many of them are done."""
        self._results = list(known)
        count = len(self._jobs)
        runs = "run" if count == 1 else "runs"
        print_line(self._console, f"{count} {runs}, agent {self._jobs[0].agent}, results in {folder}")
        if known:
            print_line(self._console, f"{len(known)} of them {'has' if len(known) == 1 else 'have'} a result already")

    def take(self, result: Result) -> None:
        """Add a new result, and print it."""
        self._results.append(result)
        done = f"[{len(self._results):>{len(str(len(self._jobs)))}}/{len(self._jobs)}]"
        outcome = result.outcome.replace("_", " ")
        text = f"{done} {result.name}: {result.points:g} of {result.reachable:g} points, {outcome}"
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

    def _trials(self) -> Table:
        rows = {trial: [trial, f"0/{count}"] for trial, count in self._counts.items()}
        lost = Counter(result.trial for result in self._results if result.is_lost)
        for each in summary.summarize(self._results):
            figures = [f"{each.mean:.4g}", f"{each.min:.4g}", f"{each.share:.0%}", str(lost[each.trial] or "")]
            rows[each.trial] = [each.trial, f"{each.runs}/{self._counts[each.trial]}", *figures]
        return table({"trial": {}, **dict.fromkeys(("done", "mean", "min", "share", "lost"), RIGHT)}, rows.values())

    def _runs(self) -> Table:
        grid = Table(box=None, show_header=False, pad_edge=False)
        for each in self._running:
            limit = each.job.trial.time_limit
            end = f" of {limit:g}" if limit > 0 else ""
            cells = (f"{each.simulated:.0f}{end} s", f"{each.points:g} points", f"{each.wall:.0f} s")
            grid.add_row(each.job.name, *cells, style="cyan")
        return grid


_MAX_SEEDS, _MAX_JOBS = 100_000, 1024
_MEMORY = 256.0, 2.0**24  # [MiB]; with less a worker cannot begin

ARM_AND_SENSORS = bundled_sensors()[0]
"""Files with the arm and sensors that a trial of the competition lacks, where each team brought its own."""

_LIMITS = "Limits of each run"

AsTable = Annotated[bool, flag("--parquet", "Write FOLDER/results.parquet too: a table of the runs.", OUTPUT)]


def evaluate(
    trials: Annotated[
        list[str], argument("TRIAL", "Bundled trials, such as `lesson`, and YAML files; each is a separate trial.")
    ],
    agent: Annotated[str, option("AGENT", f"{AGENT_HELP}.", SIMULATION)] = "kitter",
    joined: Annotated[
        list[str] | None,
        option(
            "FILE",
            "Join this file to each trial, such as one with your arm and sensors; repeatable. "
            f"Default for trials without an arm: `{ARM_AND_SENSORS}`.",
            SIMULATION,
            name="--with",
        ),
    ] = None,
    seeds: Annotated[int, option("N", "Run each trial with the seeds 1 to N.", SIMULATION)] = 1,
    vary: Vary = False,
    sweep: Annotated[
        list[str] | None,
        option(
            "KEY=A,B,C",
            "Run each trial with each value of this key of its file, such as `time_limit=60,120`; several give all "
            "combinations.",
            SIMULATION,
        ),
    ] = None,
    repeat: Annotated[
        bool, flag("--repeat", "Run each trial and seed twice, and find programs that are not repeatable.", SIMULATION)
    ] = False,
    jobs: Annotated[
        int | None,
        option("J", "Runs in parallel. Default: the number of processors, here or of the cluster.", SIMULATION),
    ] = None,
    shard: Annotated[
        str | None,
        option("K/N", "Do part K of N of the runs, or `auto` by variables of Slurm or Kubernetes.", SIMULATION),
    ] = None,
    ray: Annotated[
        str | None,
        option(
            "ADDRESS",
            "Run on the Ray cluster at this address, such as `auto` or HOST:PORT; `local` starts one here.",
            SIMULATION,
        ),
    ] = None,
    time_limit: Annotated[float, option("T", "Wall time [s].", _LIMITS)] = 600.0,
    memory_limit: Annotated[float, option("M", "Memory [MiB].", _LIMITS)] = 2048.0,
    min_score: Annotated[
        str | None,
        option("SCORE", "Exit with status 1 if a run scores less: points, or `75%` of the reachable points.", OUTPUT),
    ] = None,
    out: Annotated[Path, option("FOLDER", "Folder for results, logs and reports.", OUTPUT)] = Path("evaluation"),
    fresh: Annotated[
        bool, flag("--fresh", "Run everything, also what has a valid result in FOLDER already.", OUTPUT)
    ] = False,
    record: Annotated[
        bool, flag("--record", "Record each run that has no result yet, to FOLDER/recordings.", OUTPUT)
    ] = False,
    as_table: AsTable = False,
    log: Annotated[
        list[str] | None, option("TRACKER", "Log the evaluation to `mlflow` or `wandb` as one run; repeatable.", OUTPUT)
    ] = None,
    view: EvaluationView = False,
    view_host: ViewHost = None,
    view_port: ViewPort = None,
    open_page: OpenPage = False,
    as_json: AsJson = False,
) -> None:
    """Evaluate an agent in many runs, each in its own process.

    Each result is in FOLDER/results.jsonl at once; repeat the command to continue an interrupted evaluation. At the end
    FOLDER has report.html for people, and junit.xml and summary.json for CI. `cellwright eval compare` compares two
    such folders.

        # the bundled agent in two trials, five variations of each
        cellwright eval lesson final01 --vary --seeds 5

        # your agent in CI: status 1 if a run has less than 75 % of the points
        cellwright eval trial.yaml --agent my_robot.py:MyRobot --min-score 75%

        # up to which number of rounds of the belt does it win?
        cellwright eval lesson --sweep options.belt_population_cycles=1,5,20

        # one of 16 machines; then, of all folders: cellwright eval merge shards/*
        cellwright eval lesson --seeds 1000 --shard 3/16 --out shards/3

    Exit status: 0 every run is done, not below --min-score, and repeatable (--repeat); 1 some are not; 2 bad input, and
    nothing was started. With 75 runs are left: a signal came, or the machine failed, such as by a full disk. The same
    command continues.
    """
    threshold = threshold_of(min_score)
    require_table(as_table)
    page = page_options(view=view, host=view_host, port=view_port, opens=open_page)
    with options.errors_of("--log"):
        Tracking.require(log or ())
    with options.errors_of("--shard"):
        part = None if shard is None else Shard.read(shard)
    limits = RunLimits(
        _within("--time-limit", time_limit, 0.1, options.LATEST),
        round(_within("--memory-limit", memory_limit, *_MEMORY) * MEBIBYTE),
    )
    numbers = range(1, _within("--seeds", seeds, 1, _MAX_SEEDS) + 1)
    workers = None if jobs is None else _within("--jobs", jobs, 1, _MAX_JOBS)
    try:
        evaluated = _trials(trials, joined or [], list(map(Sweep.read, sweep or [])))
        planned = make_jobs(evaluated, agent, numbers, vary=vary)
    except OSError as error:
        options.refuse(f"{error.filename}: cannot be read: {error.strerror}")
    console = Console(stderr=as_json, highlight=False)
    if ray is None and not MEMORY_IS_LIMITED:
        console.print("note: this system cannot limit the memory of a run")
    if part is None:
        own: Sequence[Job] = planned
    else:
        own = part.select(planned)
        if not own:
            options.refuse(f"--shard {part}: there are only {len(planned)} runs; give no more shards than runs")
        print_line(console, f"shard {part} of {len(planned)} runs")
    if repeat:
        planned, own = [*planned, *map(repeated, planned)], [*own, *map(repeated, own)]
    plan = plan_of(planned, limits)
    try:
        store = ResultsFile(out)
        tracking = Tracking(log or (), out, parameters_of(plan, part, threshold), threshold)
    except OSError as error:
        refuse_file(f"--out {out}: cannot be written: {error.strerror}", error)
    with ExitStack() as stack, tracking:
        with store:
            if fresh:
                store.forget(job.key for job in own)
                tracking.forget()
            unwritten = write_result(out / PLAN_NAME, plan_text(plan))
            stack.enter_context(page_beside(out, min_score or "", page, console, stays=not as_json))
            results, failures = _work(own, store, limits, workers, console, tracking, ray=ray, records=record)
        left, failures = len(own) - len(results), [*unwritten, *failures]
        conclude(
            out, results, failures, threshold, console, left=left, as_table=as_table, as_json=as_json, tracking=tracking
        )


def threshold_of(min_score: str | None) -> summary.Threshold | None:
    """Return the threshold of `--min-score`; None without one."""
    with options.errors_of("--min-score"):
        return None if min_score is None else summary.Threshold.read(min_score)


def require_table(as_table: bool) -> None:  # noqa: FBT001 (the value of an option)
    """Refuse `--parquet` without the package that writes the table."""
    if as_table and not is_installed("pyarrow"):
        options.refuse("--parquet: needs the package pyarrow; pip install 'cellwright[parquet]'")


def refuse_file(message: str, error: OSError) -> NoReturn:
    """Refuse a file as bad input, unless the disk is full."""
    if error.errno in DISK_FULL:
        typer.echo(f"error: {message}", err=True)
        raise typer.Exit(TRY_AGAIN)
    options.refuse(message)


def conclude(
    out: Path,
    ended: Sequence[Result],
    failures: list[str],
    threshold: summary.Threshold | None,
    console: Console,
    *,
    left: int,
    as_table: bool,
    as_json: bool,
    tracking: Tracking | None = None,
) -> NoReturn:
    """Write the files of an evaluation to `out`, print its summary, and exit.

    `ended` are results of runs and repetitions; `failures` are what the machine did wrong, a line each; `left` is the
    number of runs that were interrupted. A failure of `tracking` does not change the exit status.
    """
    results, repeats = summary.with_repeats(ended)
    failures += write_result(out / "junit.xml", summary.junit(results, threshold, repeats))
    pictures = {} if left else draw_worst(out, results, partial(print_line, console))
    failures += write_result(out / "report.html", report(results, threshold, repeats, pictures))
    if as_table:
        failures += write_result(out / TABLE_NAME, parquet_table(ended))
    reasons = [*(summary.shortcoming(result, threshold) for result in results), *(each.difference for each in repeats)]
    status = TRY_AGAIN if failures or left else NOT_DONE if any(reasons) else DONE
    document = json.dumps(summary.summary_document(results, threshold, status, repeats), indent=2)
    failures += write_result(out / "summary.json", document + "\n")
    show_summary(console, results, threshold, repeats)
    if left:
        console.print(f"interrupted: {left} {'run' if left == 1 else 'runs'} left; repeat the command to continue")
    print_entry(console, "report", str(out / "report.html"))
    status = TRY_AGAIN if failures else status
    if tracking is not None:
        ending: Status = "failed" if failures else "interrupted" if left else "finished"
        names = ("report.html", "summary.json", "junit.xml", RESULTS_NAME, *([TABLE_NAME] if as_table else []))
        metrics = final_metrics(results, threshold, repeats, status)
        for note in tracking.finish(metrics, len(ended), [out / name for name in names], ending):
            print_line(console, f"warning: {note}", "yellow")
        for name, run in tracking.runs.items():
            print_entry(console, name, f"run {run}")
    for failure in failures:
        typer.echo(f"error: {failure}", err=True)
    if as_json:
        typer.echo(document)
    raise typer.Exit(status)


def _work(
    jobs: Sequence[Job],
    store: ResultsFile,
    limits: RunLimits,
    workers: int | None,
    console: Console,
    tracking: Tracking,
    *,
    ray: str | None,
    records: bool,
) -> tuple[list[Result], list[str]]:
    """Return the results of the jobs that have one, in the jobs' order; and why there were no more, if it failed."""
    with EvalProgress(console, jobs) as progress:

        def take(result: Result) -> None:
            progress.take(result)
            tracking.take(result)

        def show_jobs(running: Sequence[Running]) -> None:
            progress.show_jobs(running)
            if warning := tracking.update():
                progress.show_fault(warning)

        common: dict[str, Any] = {"limits": limits, "records": records}
        common |= {"on_result": take, "on_progress": show_jobs, "on_fault": progress.show_fault}
        evaluation: Engine
        if ray is None:
            evaluation = Evaluation(store, workers=usable_processors() if workers is None else workers, **common)
        else:
            evaluation = RayEvaluation(store, ray, jobs, most=workers, **common)
        known = [store.results[job.key] for job in jobs if evaluation.is_settled(job)]
        progress.begin(known, store.path.parent)
        if len(known) < len(jobs) and (problem := evaluation.check_agent(jobs[0].agent)):
            options.refuse(problem)
        with options.errors_of("--log"):
            warning = tracking.begin(known)
        if warning:
            progress.show_fault(warning)
        if len(known) < len(jobs) and not evaluation.failure:
            with stopped_by_signals(evaluation.stop):
                evaluation.run(jobs)
    results = [store.results[job.key] for job in jobs if evaluation.is_settled(job)]
    return results, [*evaluation.unjudged, *filter(None, [evaluation.failure])]


def _trials(names: Sequence[str], joined: Sequence[str], sweeps: Sequence[Sweep] = ()) -> list[EvaluatedTrial]:
    """Read the trials once: their errors are printed before anything starts."""
    entries = []
    for name in dict.fromkeys(names):
        has_arm = load_trial(options.paths([name])).trial.has_arm
        parts = [name, *(joined or ([] if has_arm else [ARM_AND_SENSORS]))]
        swept = variants(sweeps, name if len(names) > 1 else "")
        trials = options.load_variants(parts, swept)
        check_effect(sweeps, trials)
        if any(isinstance(each, PictureCameraConfig) for trial in trials for each in trial.sensors):
            requested_backend()  # an unknown backend is reported once, and not by every run
        entries += [
            (name, parts, each, trial, attainable_score(trial)) for each, trial in zip(swept, trials, strict=True)
        ]
    how_often = Counter(trial for _, trial in {(name, trial.name) for name, _, _, trial, _ in entries})
    return [
        EvaluatedTrial(
            variant_name(trial.name if how_often[trial.name] == 1 else name, overrides),
            tuple(path.resolve() for path in options.paths(parts)),
            attainable.total,
            attainable.maximum,
            trial.time_limit,
            models_digest(trial),
            tuple(parts),
            overrides,
        )
        for name, parts, overrides, trial, attainable in entries
    ]


def _within(option: str, value: N, low: float, high: float) -> N:
    return options.in_range(option, value, low, high, f"a number from {low:g} to {high:g}")
