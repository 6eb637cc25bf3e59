"""`python -m benchmarks`: runs benchmarks, prints their figures, and writes the page."""

from __future__ import annotations

import datetime
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from benchmarks import benchmarks
from benchmarks.benchmarks import Benchmark, BenchmarkResult, run_benchmark
from benchmarks.checkout import Checkout
from benchmarks.machine import machine
from benchmarks.report import page, picture, picture_name, progress_line, show
from cellwright.cli import options
from cellwright.cli.arguments import OUTPUT
from cellwright.cli.main import DONE, NOT_DONE, main
from cellwright.recording.plots.figure import write_figure
from cellwright.util.errors import UsageError
from cellwright.util.files import write_atomic

app = typer.Typer(add_completion=False, rich_markup_mode="markdown", pretty_exceptions_enable=False)
_NAMES = ", ".join(f"`{each.name}`" for each in benchmarks.BENCHMARKS)


@app.command()
def bench(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="NAME", help=f"Benchmarks to run: {_NAMES} (default: all).", show_default=False),
    ] = None,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            metavar="",
            help="Use few repeats, to check that everything works; figures are rough, and bounds are not judged.",
        ),
    ] = False,
    against: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Compare with another checkout of Cellwright, which needs no installation: the whole trial, in turn.",
            show_default=False,
        ),
    ] = None,
    write: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.md",
            help="Write a page with these figures and the machine's, and curves into the folder images beside it.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    as_json: Annotated[
        bool,
        typer.Option(
            "--json", metavar="", help="Print the figures as JSON, and nothing else on stdout.", rich_help_panel=OUTPUT
        ),
    ] = False,
) -> None:
    """Measure the costs of Cellwright on this machine, beside their bounds.

    Run it on an idle machine; all of it takes about half an hour. A benchmark that needs something that is not
    installed (PyBullet, ROS 1) is skipped and says so.

        # a whole trial: alone, with the agent, with listeners on all topics
        python -m benchmarks trial

        # the same, and beside another checkout
        python -m benchmarks trial --against ../before

        # everything, and the page of the documentation
        python -m benchmarks --write docs/benchmarks.md

    Exit status: 0 every bound is held; 1 a bound is not held, or a benchmark failed; 2 bad input, and nothing was
    started.
    """
    chosen = [benchmarks.find_benchmark(name) for name in dict.fromkeys(names or ())] or list(benchmarks.BENCHMARKS)
    if against is not None:
        _check_against(against, chosen)
    write = options.output_file("--write", write, ".md")
    console = Console(stderr=as_json, highlight=False)
    about, today = machine(), datetime.datetime.now(tz=datetime.UTC).date()
    minutes = sum(each.minutes for each in chosen)
    if not quick:
        console.print(
            f"{len(chosen)} of {len(benchmarks.BENCHMARKS)} benchmarks, about {minutes:.0f} minutes", markup=False
        )
    for name, value in about.items():
        console.print(f"{name:<12}  {value}", markup=False, soft_wrap=True)
    taken: list[BenchmarkResult] = []
    for each in chosen:
        with progress_line(console, each.title) as on_progress:
            taken.append(run_benchmark(each, on_progress, quick=quick, against=against))
        show(console, taken[-1], with_verdicts=not quick)
    status = DONE if all(not each.failed if quick else each.is_held for each in taken) else NOT_DONE
    if write is not None and not _write(write, page(taken, about, today, quick=quick), taken, console):
        status = NOT_DONE
    if as_json:
        document = {
            "machine": about,
            "date": today.isoformat(),
            "quick": quick,
            "benchmarks": [each.as_dict() for each in taken],
            "exit_status": status,
        }
        typer.echo(json.dumps(document, indent=2))
    raise typer.Exit(status)


def _check_against(folder: Path, chosen: Sequence[Benchmark]) -> None:
    """Check `--against` before anything starts; a UsageError if it cannot be used."""
    if not any(each.compare() for each in chosen):
        able = ", ".join(each.name for each in benchmarks.BENCHMARKS if each.compare())
        raise UsageError(f"--against: none of these benchmarks compares two checkouts; name one that does: {able}")
    try:
        Checkout(folder)
    except UsageError as error:
        raise UsageError(f"--against {error}") from None


def _write(file: Path, text: str, taken: Sequence[BenchmarkResult], console: Console) -> bool:
    """Write the page and its pictures; on a failure, print it and return False: the figures are printed by then."""
    try:
        for each in taken:
            if each.curves:
                drawn = file.parent / picture_name(each)
                drawn.parent.mkdir(exist_ok=True)
                write_figure(picture(each.curves), drawn)
        write_atomic(file, text)
    except OSError as error:
        typer.echo(f"error: --write {file}: cannot be written: {error.strerror or error}", err=True)
        return False
    console.print(f"\npage  {file}", markup=False, soft_wrap=True)
    return True


if __name__ == "__main__":
    sys.exit(main(None, app, name="python -m benchmarks"))
