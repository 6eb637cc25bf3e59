"""Command `cellwright eval`: runs of a program in many trials."""

from collections.abc import Sequence
from contextlib import ExitStack

from rich.console import Console

from cellwright.cli import options
from cellwright.cli.eval.agents import evaluate_class
from cellwright.cli.eval.arguments import EvaluationArguments
from cellwright.cli.eval.conclusion import Reports, conclude, continued_later, refuse_file, write_beside
from cellwright.cli.eval.progress import EvalProgress, run_jobs
from cellwright.cli.eval.watch import page_beside
from cellwright.cli.output import print_line, warn
from cellwright.cli.parameters import with_groups
from cellwright.running.evaluation.execution.local import LocalRunner
from cellwright.running.evaluation.execution.memory import MEMORY_IS_LIMITED
from cellwright.running.evaluation.execution.on_ray.runner import RayRunner
from cellwright.running.evaluation.execution.process import usable_processors
from cellwright.running.evaluation.execution.runner import Runner, RunnerOptions, Running
from cellwright.running.evaluation.execution.seed_queue import SeedQueue
from cellwright.running.evaluation.outputs.tracking import Tracking, parameters_of
from cellwright.running.evaluation.plan.job import Job, make_jobs, repeated
from cellwright.running.evaluation.results.folder import PLAN_NAME, RECORDINGS, other_agents, plan_of, plan_text
from cellwright.running.evaluation.results.infrastructure import InfrastructureLoss
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.results_file import ResultsFile
from cellwright.running.evaluation.results.summary import shortcoming


@with_groups
def evaluate(given: EvaluationArguments) -> None:
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

        # a policy server at four latencies: its success against latency is in the report
        cellwright eval trial.yaml --policy ws://127.0.0.1:8000 --latency 0ms --latency 60ms --latency 120ms --seeds 50

        # a class: evaluation/class.csv and class.html have a row for each program
        cellwright eval lesson final01 --agents 'students/*.py:Mine' --vary --seeds 3

        # one of 16 machines; then, of all folders: cellwright eval merge shards/*
        cellwright eval lesson --seeds 1000 --shard 3/16 --out shards/3

    Exit status: 0 every run is done, not below --min-score, and repeatable (--repeat); 1 some are not; 2 bad input, and
    nothing was started; 3 no run is at fault, but some have no order. With 75 runs are left: a signal came, or the
    machine failed, such as by a full disk. The same command continues. With --agents 0 says that the sheet is complete,
    and 2 also that no program could be made.
    """
    given.refuse()
    page, limits, part = given.page.options(), given.limits.limits(), given.part
    try:
        trials = given.evaluated()
        if given.agents:
            evaluate_class(given.agents, trials, given)
        planned = make_jobs(
            trials,
            given.program,
            given.numbers,
            vary=given.vary,
            over=given.over or "",
            verify=given.verify,
            latencies=given.latencies,
        )
    except OSError as error:
        options.refuse(f"{error.filename}: cannot be read: {error.strerror}")
    console = Console(stderr=given.as_json, highlight=False)
    if given.ray is None and not MEMORY_IS_LIMITED:
        console.print("note: this system cannot limit the memory of a run")
    own: Sequence[Job] = planned
    if part is not None:
        own = part.select(planned)
        if not own:
            options.refuse(f"--shard {part}: there are only {len(planned)} runs; give no more shards than runs")
        print_line(console, f"shard {part} of {len(planned)} runs")
    if given.repeat:
        planned, own = [*planned, *map(repeated, planned)], [*own, *map(repeated, own)]
    plan, reports = plan_of(planned, limits), given.reports
    try:
        store = ResultsFile(given.out)
        tracking = Tracking(given.log or (), given.out, parameters_of(plan, part, reports.threshold), reports.threshold)
    except OSError as error:
        refuse_file(f"--out {given.out}: cannot be written: {error.strerror}", error)
    with continued_later(), ExitStack() as stack, tracking:
        with store:
            _claim(given, own, store, tracking)
            unwritten = write_beside(given.out / PLAN_NAME, plan_text(plan))
            stack.enter_context(page_beside(given.out, given.min_score or "", page, console, stays=not given.as_json))
            results, failures, lost, queue = _work(given, own, store, tracking, console)
            left = len(own) - len(results) if queue is None else queue.left
            if queue is not None and not left:
                counted = {result.key for result in results}
                plan = plan_of([job for job in planned if job.key in counted], limits)
                unwritten += write_beside(given.out / PLAN_NAME, plan_text(plan))
        notes = [] if queue is None else queue.sentences()
        failures = [*unwritten, *failures]
        conclude(results, failures, reports, console, left=left, tracking=tracking, notes=notes, lost=lost)


def _claim(given: EvaluationArguments, jobs: Sequence[Job], store: ResultsFile, tracking: Tracking) -> None:
    """Take the folder for this program: forget its results with --fresh, else refuse those of another program."""
    if given.fresh:
        store.forget(job.key for job in jobs)
        tracking.forget()
    elif others := other_agents(given.out, store.results.values(), given.program):
        more = f" (and {len(others) - 1} more)" if len(others) > 1 else ""
        options.refuse(
            f"--out {given.out}: holds results of another program, {others[0]}{more}; "
            "give another folder, or --fresh to replace its report"
        )


def _work(
    given: EvaluationArguments, jobs: Sequence[Job], store: ResultsFile, tracking: Tracking, console: Console
) -> tuple[list[Result], list[str], list[InfrastructureLoss], SeedQueue | None]:
    """Return results that count, why there are no more, what the infrastructure lost, and the queue if there is one."""
    rule = given.rule
    with EvalProgress(console, jobs, may_end_early=rule is not None) as progress:

        def take(result: Result) -> None:
            progress.take(result)
            tracking.take(result)
            if given.record_failed:
                _drop_recording(given.reports, result)

        def show_jobs(running: Sequence[Running]) -> None:
            progress.show_jobs(running)
            if warning := tracking.update():
                progress.show_fault(warning)

        def more() -> Sequence[Job]:
            return [] if queue is None else queue.next_jobs(runner.faults)

        def begin(known: Sequence[Result]) -> None:
            if (len(known) < len(jobs) if queue is None else queue.left) and (
                problem := runner.check_agent(jobs[0].program)
            ):
                options.refuse(problem)
            with options.errors_of("--log"):
                warning = tracking.begin(known)
            if warning:
                progress.show_fault(warning)

        recorded = given.record or given.record_failed
        watched = RunnerOptions(given.limits.limits(), recorded, take, show_jobs, progress.show_fault, more)
        runner: Runner
        if given.ray is None:
            runner = LocalRunner(store, watched, workers=given.workers or usable_processors())
        else:
            runner = RayRunner(store, given.ray, jobs, watched, most=given.workers)
        queue = None if rule is None else SeedQueue(jobs, rule, runner.result_of)
        return *run_jobs(runner, jobs, store, progress, begin, queue), queue


def _drop_recording(reports: Reports, result: Result) -> None:
    """Remove the recording of a run that passed."""
    if shortcoming(result, reports.threshold):
        return
    file = (reports.out / RECORDINGS / result.log_name).with_suffix(".mcap")
    try:
        file.unlink(missing_ok=True)
    except OSError as error:
        warn(f"{file}: cannot be removed: {error.strerror or error}")
