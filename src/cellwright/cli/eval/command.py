"""Command `cellwright eval`: runs of a program in many trials."""

from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from rich.console import Console

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
from cellwright.cli.eval.agents import ClassOptions, evaluate_class
from cellwright.cli.eval.conclusion import (
    AsTable,
    conclude,
    continued_later,
    refuse_file,
    require_table,
    threshold_of,
    write_beside,
)
from cellwright.cli.eval.progress import EvalProgress
from cellwright.cli.eval.watch import page_beside
from cellwright.cli.main import argument, flag, option
from cellwright.cli.options import N
from cellwright.cli.output import print_line, warn
from cellwright.cli.signals import stopped_by_signals
from cellwright.config.trial.catalogue import bundled_sensors
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.joining import joined_name, split_names
from cellwright.config.trial.trial import PictureCameraConfig
from cellwright.rendering.backend import requested_backend
from cellwright.running.evaluation.execution.local import LocalRunner
from cellwright.running.evaluation.execution.memory import MEMORY_IS_LIMITED
from cellwright.running.evaluation.execution.on_ray.runner import RayRunner
from cellwright.running.evaluation.execution.process import usable_processors
from cellwright.running.evaluation.execution.runner import Runner, Running
from cellwright.running.evaluation.outputs.tracking import Tracking, parameters_of
from cellwright.running.evaluation.plan.job import (
    MEBIBYTE,
    EvaluatedTrial,
    Job,
    RunLimits,
    log_name,
    make_jobs,
    models_digest,
    repeated,
)
from cellwright.running.evaluation.plan.shard import Shard
from cellwright.running.evaluation.plan.sweep import Sweep, check_effect, variant_name, variants
from cellwright.running.evaluation.results.folder import PLAN_NAME, RECORDINGS, other_agents, plan_of, plan_text
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.results_file import ResultsFile
from cellwright.running.evaluation.results.summary import Threshold, shortcoming

_MAX_SEEDS, _MAX_JOBS = 100_000, 1024
_MEMORY = 256.0, 2.0**24  # [MiB]; with less a worker cannot begin

ARM_AND_SENSORS = bundled_sensors()[0]
"""Files with the arm and sensors that a trial of the competition lacks, where each team brought its own."""

_LIMITS, _TRUST = "Limits of each run", "Programs that you do not trust"


def evaluate(
    trials: Annotated[
        list[str],
        argument(
            "TRIAL",
            "Bundled trials, such as `lesson`, and YAML files. Each is a separate trial; files of one are joined as "
            "`final01+kitter_sensors`.",
        ),
    ],
    agent: Annotated[str, option("AGENT", f"{AGENT_HELP}.", SIMULATION)] = "kitter",
    agents: Annotated[
        list[str] | None,
        option(
            "PATTERN",
            "Evaluate each program of a class, such as `'students/*.py:Mine'`, over socket: one sheet with a row for "
            "each, and a file of feedback; repeatable.",
            SIMULATION,
        ),
    ] = None,
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
    start_limit: Annotated[
        float, option("T", "Simulation time until the program must have started the competition [s].", _LIMITS)
    ] = 300.0,
    memory_limit: Annotated[float, option("M", "Memory [MiB].", _LIMITS)] = 2048.0,
    over: Annotated[
        str | None,
        option(
            "socket",
            "Run each program in a process of its own, which does not hold cell and referee; the results are the same.",
            _TRUST,
        ),
    ] = None,
    verify: Annotated[
        bool,
        flag(
            "--verify",
            "Play each run's commands again in a process without the program; a run with another result fails.",
            _TRUST,
        ),
    ] = False,
    min_score: Annotated[
        str | None,
        option("SCORE", "Exit with status 1 if a run scores less: points, or `75%` of the reachable points.", OUTPUT),
    ] = None,
    out: Annotated[Path, option("FOLDER", "Folder for results, logs and reports.", OUTPUT)] = Path("evaluation"),
    fresh: Annotated[
        bool,
        flag(
            "--fresh",
            "Run everything, also what has a valid result in FOLDER already, or in place of another program.",
            OUTPUT,
        ),
    ] = False,
    record: Annotated[
        bool, flag("--record", "Record each run that has no result yet, to FOLDER/recordings.", OUTPUT)
    ] = False,
    record_failed: Annotated[
        bool, flag("--record-failed", "As --record, but keep only the recordings of runs that do not pass.", OUTPUT)
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
    such folders. Without --over and --verify the program runs in the referee's process, and could change its score.

        # the bundled agent in two trials, five variations of each
        cellwright eval lesson final01 --vary --seeds 5

        # your agent in CI: status 1 if a run has less than 75 % of the points
        cellwright eval trial.yaml --agent my_robot.py:MyRobot --min-score 75%

        # up to which number of rounds of the belt does it win?
        cellwright eval lesson --sweep options.belt_population_cycles=1,5,20

        # programs of others: each in a process of its own, its points from its commands alone
        cellwright eval final01 --agent theirs.py:Robot --over socket --verify

        # a class: evaluation/class.csv and class.html have a row for each program
        cellwright eval lesson final01 --agents 'students/*.py:Mine' --vary --seeds 3

        # one of 16 machines; then, of all folders: cellwright eval merge shards/*
        cellwright eval lesson --seeds 1000 --shard 3/16 --out shards/3

    Exit status: 0 every run is done, not below --min-score, and repeatable (--repeat); 1 some are not; 2 bad input, and
    nothing was started; 3 no run is at fault, but some have no order. With 75 runs are left: a signal came, or the
    machine failed, such as by a full disk. The same command continues. With --agents 0 says that the sheet is complete,
    and 2 also that no program could be made.
    """
    if over not in (None, "socket"):
        options.refuse(f"--over {over}: give socket")
    threshold = threshold_of(min_score)
    if record and record_failed:
        options.refuse("--record keeps all recordings; leave out it or --record-failed")
    require_table(as_table)
    page = page_options(view=view, host=view_host, port=view_port, opens=open_page)
    with options.errors_of("--log"):
        Tracking.require(log or ())
    with options.errors_of("--shard"):
        part = None if shard is None else Shard.read(shard)
    limits = RunLimits(
        _within("--time-limit", time_limit, 0.1, options.LATEST),
        round(_within("--memory-limit", memory_limit, *_MEMORY) * MEBIBYTE),
        start=_within("--start-limit", start_limit, 1.0, options.LATEST),
    )
    if agents:
        refused = {
            "--agent": agent != "kitter",
            "--shard": shard is not None,
            "--ray": ray is not None,
            "--log": bool(log),
            "--parquet": as_table,
            "--repeat": repeat,
            "--view": view,
        }
        if given := [name for name, is_given in refused.items() if is_given]:
            options.refuse(f"{given[0]}: does not go with --agents; leave one out")
    numbers = range(1, _within("--seeds", seeds, 1, _MAX_SEEDS) + 1)
    workers = None if jobs is None else _within("--jobs", jobs, 1, _MAX_JOBS)
    try:
        evaluated = _trials(trials, joined or [], list(map(Sweep.read, sweep or [])))
        if agents:
            evaluate_class(
                agents,
                ClassOptions(
                    trials=evaluated,
                    seeds=numbers,
                    vary=vary,
                    verify=verify,
                    limits=limits,
                    workers=workers,
                    threshold=threshold,
                    out=out,
                    fresh=fresh,
                    records=record,
                    as_json=as_json,
                ),
            )
        planned = make_jobs(evaluated, agent, numbers, vary=vary, over=over or "", verify=verify)
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
    with continued_later(), ExitStack() as stack, tracking:
        with store:
            if fresh:
                store.forget(job.key for job in own)
                tracking.forget()
            elif others := other_agents(out, store.results.values(), agent):
                more = f" (and {len(others) - 1} more)" if len(others) > 1 else ""
                options.refuse(
                    f"--out {out}: holds results of another program, {others[0]}{more}; "
                    "give another folder, or --fresh to replace its report"
                )
            unwritten = write_beside(out / PLAN_NAME, plan_text(plan))
            stack.enter_context(page_beside(out, min_score or "", page, console, stays=not as_json))
            kept = partial(_drop_recording, out, threshold) if record_failed else None
            records = record or record_failed
            results, failures = _work(
                own, store, limits, workers, console, tracking, ray=ray, records=records, judge_recording=kept
            )
        left, failures = len(own) - len(results), [*unwritten, *failures]
        conclude(
            out, results, failures, threshold, console, left=left, as_table=as_table, as_json=as_json, tracking=tracking
        )


def _drop_recording(out: Path, threshold: Threshold | None, result: Result) -> None:
    """Remove the recording of a run that passed."""
    if shortcoming(result, threshold):
        return
    file = (out / RECORDINGS / log_name(result.trial, result.seed, result.key)).with_suffix(".mcap")
    try:
        file.unlink(missing_ok=True)
    except OSError as error:
        warn(f"{file}: cannot be removed: {error.strerror or error}")


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
    judge_recording: Callable[[Result], None] | None,
) -> tuple[list[Result], list[str]]:
    """Return the results of the jobs that have one, in the jobs' order; and why there were no more, if it failed."""
    with EvalProgress(console, jobs) as progress:

        def take(result: Result) -> None:
            progress.take(result)
            tracking.take(result)
            if judge_recording is not None:
                judge_recording(result)

        def show_jobs(running: Sequence[Running]) -> None:
            progress.show_jobs(running)
            if warning := tracking.update():
                progress.show_fault(warning)

        common: dict[str, Any] = {"limits": limits, "records": records}
        common |= {"on_result": take, "on_progress": show_jobs, "on_fault": progress.show_fault}
        evaluation: Runner
        if ray is None:
            evaluation = LocalRunner(store, workers=usable_processors() if workers is None else workers, **common)
        else:
            evaluation = RayRunner(store, ray, jobs, most=workers, **common)
        known = [store.results[job.key] for job in jobs if evaluation.is_settled(job)]
        progress.begin(known, store.path.parent)
        for notice in store.notices:
            progress.show_fault(notice)
        count = len(store.notices)
        if len(known) < len(jobs) and (problem := evaluation.check_agent(jobs[0].agent)):
            options.refuse(problem)
        with options.errors_of("--log"):
            warning = tracking.begin(known)
        if warning:
            progress.show_fault(warning)
        if len(known) < len(jobs) and not evaluation.failure:
            with stopped_by_signals(evaluation.stop):
                evaluation.run(jobs)
                with suppress(OSError):  # it was removed: the evaluation has reported that
                    store.restore()
        for notice in store.notices[count:]:
            progress.show_fault(notice)
    results = [store.results[job.key] for job in jobs if evaluation.is_settled(job)]
    return results, [*evaluation.unjudged, *filter(None, [evaluation.failure])]


def _trials(names: Sequence[str], joined: Sequence[str], sweeps: Sequence[Sweep] = ()) -> list[EvaluatedTrial]:
    """Read the trials once: their errors are printed before anything starts."""
    entries = []
    for name in dict.fromkeys(names):
        alone = load_trial(options.paths([name])).trial
        if not alone.orders and len(names) > 1:
            others = joined_name([*(other for other in names if other != name), name][-2:])
            options.refuse(f"{name}: has no order, and is no trial beside others; to join it, write such as {others}")
        parts = [*split_names(name), *(joined or ([] if alone.has_arm else [ARM_AND_SENSORS]))]
        swept = variants(sweeps, name if len(names) > 1 else "")
        trials = options.load_variants([joined_name(parts)], swept)
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
            tuple(path.resolve() for path in options.paths([joined_name(parts)])),
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
