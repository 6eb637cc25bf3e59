"""`cellwright eval --agents`: a class of programs in the same trials, its gradebook, and feedback for each program."""

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import NoReturn

import typer
from rich.console import Console

from cellwright.cli import options
from cellwright.cli.eval.arguments import EvaluationArguments
from cellwright.cli.eval.conclusion import continued_later, refuse_file, write_beside
from cellwright.cli.eval.progress import EvalProgress, run_jobs
from cellwright.cli.main import BAD_INPUT, DONE, TRY_AGAIN
from cellwright.cli.output import echo, print_entry, print_line
from cellwright.cli.tables import FOLD, RIGHT, WHOLE, FittedTable, print_table, table
from cellwright.running.evaluation.execution.local import LocalRunner
from cellwright.running.evaluation.execution.process import usable_processors
from cellwright.running.evaluation.execution.runner import RunnerOptions
from cellwright.running.evaluation.outputs import gradebook
from cellwright.running.evaluation.outputs.report import report
from cellwright.running.evaluation.plan.job import EvaluatedTrial, Job, agent_digest, make_jobs
from cellwright.running.evaluation.plan.roster import Student, find_students
from cellwright.running.evaluation.results.folder import PLAN_NAME
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.results_file import ResultsFile

SHEET = "class.csv"
PAGE = "class.html"
_STOP_AFTER = 3  # runs of a program at a limit of time, after which its others are not run
_MAX_SHOWN = 60  # characters of a reason in the table


def evaluate_class(patterns: Sequence[str], trials: Sequence[EvaluatedTrial], given: EvaluationArguments) -> NoReturn:
    """Evaluate the programs that the patterns select; write the sheet and the feedback, and exit.

    Each program runs in a process of its own, away from cell and referee. Runs of all programs share the processors. A
    program that cannot be made has a row like any other.
    """
    students = find_students(patterns)
    console = Console(stderr=given.as_json, highlight=False)
    by_student = [_jobs(student, trials, given) for student in students]
    jobs = [job for turn in zip(*by_student, strict=True) for job in turn]  # what spoils a program shows early
    programs = _digests(students)
    try:
        store = ResultsFile(given.out)
    except OSError as error:
        refuse_file(f"--out {given.out}: cannot be written: {error.strerror}", error)
    with continued_later():
        with store:
            if (given.out / PLAN_NAME).exists() and store.results and not given.fresh:
                options.refuse(
                    f"--out {given.out}: holds the evaluation of one program; "
                    "give another folder, or --fresh to replace its report"
                )
            if given.fresh:
                store.forget(job.key for job in jobs)
            results, failures = _run(jobs, students, store, given, console)
        failures += [
            f"{agent}: its files changed while the class ran, and its results may be another program's; "
            "repeat the command"
            for agent, digest in _digests(students).items()
            if digest != programs[agent]
        ]
        _conclude(students, results, failures, given, console, left=len(jobs) - len(results))


def _conclude(
    students: Sequence[Student],
    results: Sequence[Result],
    failures: list[str],
    given: EvaluationArguments,
    console: Console,
    *,
    left: int,
) -> NoReturn:
    """Write and print the sheet and the feedback, and exit."""
    by_agent: dict[str, list[Result]] = {student.agent: [] for student in students}
    for result in results:
        by_agent[result.agent].append(result)
    found = gradebook.rows(students, by_agent, given.reports.threshold)
    failures += _write(found, by_agent, given)
    is_none_made = not any(row.is_made for row in found)
    status = TRY_AGAIN if failures or left else BAD_INPUT if is_none_made else DONE
    document = json.dumps({"exit_status": status, "agents": [row.as_json() for row in found]}, indent=2)
    failures += write_beside(given.out / "summary.json", document + "\n")
    console.print()
    print_table(console, _table(found))
    for row in found:
        if row.hint:
            print_line(console, f"  {row.student.name}: same end states as {row.hint}")
    if left:
        console.print(f"interrupted: {left} {'run' if left == 1 else 'runs'} left; repeat the command to continue")
    print_entry(console, "sheet", f"{given.out / SHEET}, {given.out / PAGE}")
    print_entry(console, "feedback", str(given.out / gradebook.FEEDBACK))
    if status == BAD_INPUT:
        echo(f"error: --agents: no program could be made, as {found[0].student.agent}: {found[0].reason}", err=True)
    for failure in failures:
        echo(f"error: {failure}", err=True)
    if given.as_json:
        typer.echo(document)
    raise typer.Exit(TRY_AGAIN if failures else status)


def _jobs(student: Student, trials: Sequence[EvaluatedTrial], given: EvaluationArguments) -> list[Job]:
    try:
        return make_jobs(trials, student.agent, given.numbers, vary=given.vary, over="socket", verify=given.verify)
    except OSError as error:
        options.refuse(f"{error.filename}: cannot be read: {error.strerror}")


def _digests(students: Sequence[Student]) -> dict[str, str]:
    """Return the digest of each program; empty for one that is gone."""
    found = {}
    for student in students:
        found[student.agent] = ""
        with suppress(OSError):
            found[student.agent] = agent_digest(student.agent)
    return found


def _run(
    jobs: Sequence[Job], students: Sequence[Student], store: ResultsFile, given: EvaluationArguments, console: Console
) -> tuple[list[Result], list[str]]:
    """Return the results of the jobs that have one, and why there were no more."""
    names = {student.agent: student.name for student in students}
    title = f"{len(students)} programs"
    with EvalProgress(console, jobs, title=title, label=lambda each: f"{names[each.agent]}, {each.name}") as progress:
        watched = RunnerOptions(
            given.limits.limits(), given.record, progress.take, progress.show_jobs, progress.show_fault
        )
        runner = LocalRunner(store, watched, workers=given.workers or usable_processors(), stop_after=_STOP_AFTER)
        results, failures, lost = run_jobs(runner, jobs, store, progress)
        return results, [*(each.line for each in lost), *failures]


def _write(
    found: Sequence[gradebook.Row], results: Mapping[str, Sequence[Result]], given: EvaluationArguments
) -> list[str]:
    """Write the sheet, the page and the feedback; return the errors."""
    folder = given.out / gradebook.FEEDBACK
    if folder.is_symlink():
        return [f"{folder}: cannot be written: it is a link; remove it"]
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        return [f"{folder}: cannot be written: {error.strerror}"]
    failures = write_beside(given.out / SHEET, gradebook.csv_sheet(found))
    failures += write_beside(given.out / PAGE, gradebook.page(found, given.reports.threshold))
    for row in found:
        failures += write_beside(given.out / row.feedback, report(results[row.student.agent], given.reports.threshold))
    return failures


def _table(found: Sequence[gradebook.Row]) -> FittedTable:
    rows = []
    for row in found:
        share = "-" if row.share is None else f"{row.share:.0%}"
        reason = row.reason if len(row.reason) <= _MAX_SHOWN else f"{row.reason[: _MAX_SHOWN - 1]}…"
        rows.append([row.student.name, share, f"{row.passed} of {row.judged}", row.endings, reason])
    return table({"name": WHOLE, "share": RIGHT, "passed": RIGHT, "runs": FOLD, "worst run": FOLD}, rows)
