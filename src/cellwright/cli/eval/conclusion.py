"""Conclusion of an evaluation: its files, its tables and its exit status, for `cellwright eval` and its `merge`."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, NoReturn

import typer
from rich.console import Console

from cellwright.cli import options
from cellwright.cli.arguments import OUTPUT
from cellwright.cli.main import DONE, INCONCLUSIVE, NOT_DONE, TRY_AGAIN
from cellwright.cli.output import echo, print_entry, print_line, write_result
from cellwright.cli.parameters import flag
from cellwright.cli.signals import ended_as_by_ctrl_c
from cellwright.cli.tables import FOLD, RIGHT, WHOLE, FittedTable, print_table, table
from cellwright.running.evaluation.execution.process import DISK_FULL
from cellwright.running.evaluation.outputs.junit import junit
from cellwright.running.evaluation.outputs.parquet import TABLE_NAME, parquet_table
from cellwright.running.evaluation.outputs.report import report
from cellwright.running.evaluation.outputs.state_pictures import draw_worst
from cellwright.running.evaluation.outputs.trackers import Status
from cellwright.running.evaluation.outputs.tracking import Tracking, final_metrics
from cellwright.running.evaluation.results import summary
from cellwright.running.evaluation.results.folder import RESULTS_NAME
from cellwright.running.evaluation.results.infrastructure import InfrastructureLoss, loss_counts
from cellwright.running.evaluation.results.result import Result
from cellwright.util.plugins import is_installed

AsTable = Annotated[bool, flag("--parquet", "Write FOLDER/results.parquet too: a table of the runs.", OUTPUT)]

_MAX_REASONS = 10


@dataclass(frozen=True)
class Reports:
    """Files and output at the end of an evaluation.

    Attributes:
        out: folder of the evaluation.
        threshold: score below which a run does not pass, if any.
        as_table: write a table of the runs too.
        as_json: print the summary as JSON.
    """

    out: Path
    threshold: summary.Threshold | None
    as_table: bool
    as_json: bool


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
        echo(f"error: {message}", err=True)
        raise typer.Exit(TRY_AGAIN)
    options.refuse(message)


def write_beside(file: Path, content: str | bytes) -> list[str]:
    """Write a file in an evaluation's folder; return the errors. A link is refused: a program may have put it there."""
    if file.is_symlink():
        return [f"{file}: cannot be written: it is a link; remove it"]
    return write_result(file, content)


@contextmanager
def continued_later() -> Iterator[None]:
    """Let any Ctrl-C, and the first SIGTERM or SIGHUP, end the evaluation with `TRY_AGAIN`: its results are kept."""
    try:
        with ended_as_by_ctrl_c():
            yield
    except KeyboardInterrupt:
        echo("interrupted; repeat the command to continue", err=True)
        raise typer.Exit(TRY_AGAIN) from None


def conclude(
    ended: Sequence[Result],
    failures: list[str],
    wanted: Reports,
    console: Console,
    *,
    left: int = 0,
    tracking: Tracking | None = None,
    notes: Sequence[str] = (),
    lost: Sequence[InfrastructureLoss] = (),
) -> NoReturn:
    """Write the files of an evaluation, print its summary, and exit.

    `ended` are results of runs and repetitions; `failures` are what the machine did wrong, a line each. The number of
    runs that were interrupted is `left`; `notes` are about the number of seeds, a line each. A failure of `tracking`
    does not change the exit status. Runs that are `lost` have rows of their own, and count in no figure.
    """
    out, threshold = wanted.out, wanted.threshold
    results, repeats = summary.with_repeats(ended)
    failures += [each.line for each in lost]
    failures += write_beside(out / "junit.xml", junit(results, threshold, repeats))
    pictures = {} if left else draw_worst(out, results, partial(print_line, console))
    failures += write_beside(out / "report.html", report(results, threshold, repeats, pictures, lost))
    if wanted.as_table:
        failures += write_beside(out / TABLE_NAME, parquet_table(ended))
    reasons = [summary.shortcoming(result, threshold) for result in results if not result.is_unjudged]
    reasons += [each.difference for each in repeats]
    otherwise = INCONCLUSIVE if any(result.is_unjudged for result in results) else DONE
    status = TRY_AGAIN if failures or left else NOT_DONE if any(reasons) else otherwise
    document = json.dumps(summary.summary_document(results, threshold, status, repeats, lost), indent=2)
    failures += write_beside(out / "summary.json", document + "\n")
    show_summary(console, results, threshold, repeats, lost)
    for note in notes:
        print_entry(console, "seeds", note)
    if left:
        console.print(f"interrupted: {left} {'run' if left == 1 else 'runs'} left; repeat the command to continue")
    print_entry(console, "report", str(out / "report.html"))
    status = TRY_AGAIN if failures else status
    if tracking is not None:
        ending: Status = "failed" if failures else "interrupted" if left else "finished"
        names = ("report.html", "summary.json", "junit.xml", RESULTS_NAME, *([TABLE_NAME] if wanted.as_table else []))
        metrics = final_metrics(results, threshold, repeats, status)
        for note in tracking.finish(metrics, len(ended), [out / name for name in names], ending):
            print_line(console, f"warning: {note}", "yellow")
        for name, run in tracking.runs.items():
            print_entry(console, name, f"run {run}")
    for failure in failures:
        echo(f"error: {failure}", err=True)
    if wanted.as_json:
        typer.echo(document)
    raise typer.Exit(status)


def show_summary(
    console: Console,
    results: Sequence[Result],
    threshold: summary.Threshold | None,
    repeats: Sequence[summary.Repeat] = (),
    lost: Sequence[InfrastructureLoss] = (),
) -> None:
    """Print a row for each trial, and a line for each run that did not pass or not repeat."""
    console.print()
    print_table(console, summary_table(results, lost))
    if rows := summary.measure_rows(summary.summarize(results)):
        console.print()
        figures = dict.fromkeys(("mean", "95 %", "spread"), RIGHT)
        print_table(console, table({"trial": FOLD, "figure": WHOLE, **figures}, rows))
    short = [(result, summary.shortcoming(result, threshold)) for result in summary.worst_first(results)]
    short = [(result, reason) for result, reason in short if reason]
    _print_first(console, [f"{result.name}: {reason}" for result, reason in short])
    count, judged = summary.passed_count(results, threshold)
    passed = summary.with_interval(f"{count} of {judged} runs", summary.passed_interval(results, threshold))
    print_entry(console, "passed", passed)
    if (share := summary.mean_share(results)) is not None:
        are_tasks = summary.are_tasks(results)
        words = f"{share:.0%} of the {'runs' if are_tasks else 'attainable points'}"
        entry = "success" if are_tasks else "share"
        print_entry(console, entry, summary.with_interval(words, summary.share_interval(results)))
    if unjudged := summary.unjudged_sentence(results):
        print_entry(console, "note", unjudged)
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


def summary_table(results: Sequence[Result], lost: Sequence[InfrastructureLoss] = ()) -> FittedTable:
    """Return a table with a row for each trial, and one for its runs that were lost to the infrastructure."""
    figures = dict.fromkeys(("runs", "mean", "95 %", "min", "max", "reach"), RIGHT)
    rows = []
    for each in summary.summarize(results):
        outcomes = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in each.outcomes.items())
        points = [f"{number:.4g}" for number in (each.mean, each.min, each.max, each.reachable)]
        points.insert(1, summary.range_text(each.mean_interval))
        rows.append([each.trial, str(each.runs), *points, outcomes])
    rows += [[trial, str(count), *"-----", "infrastructure, not counted"] for trial, count in loss_counts(lost).items()]
    return table({"trial": FOLD, **figures, "outcomes": FOLD}, rows)
