"""Page of an evaluation beside the command that runs or shows it."""

import shlex
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import typer
from rich.console import Console

from cellwright.cli.main import TRY_AGAIN
from cellwright.cli.output import print_line
from cellwright.cli.signals import keep_until_signal
from cellwright.running.run import PageOptions
from cellwright.running.run.pages import open_page_of
from cellwright.viewer.web.start import WebPage

_PROGRAM = "cellwright.running.evaluation.outputs.page"


def open_evaluation_page(folders: Sequence[Path], min_score: str, page: PageOptions, console: Console) -> WebPage:
    """Open the page of an evaluation, and print its address.

    Args:
        folders: its folders; several are shards of one plan.
        min_score: as on the command line; empty for none.
        page: address of the page.
        console: for lines about the page.

    Raises:
        UsageError: a folder has no plan or another one, or the page cannot be opened.
    """
    return open_page_of(
        {"folders": [str(folder) for folder in folders], "min_score": min_score},
        page,
        f"{', '.join(map(str, folders)):.60} · Cellwright",
        partial(print_line, console),
        another=shlex.join(map(str, folders)),
        program=_PROGRAM,
    )


@contextmanager
def page_beside(
    folder: Path, min_score: str, page: PageOptions | None, console: Console, *, stays: bool
) -> Iterator[None]:
    """Show an evaluation that runs meanwhile on a page.

    Args:
        folder: its folder, with the plan.
        min_score: as on the command line; empty for none.
        page: address of the page; None for no page.
        console: for lines about the page.
        stays: keep the page after the end of the evaluation, until Ctrl-C, unless runs are left.
    """
    if page is None:
        yield
        return
    shown = open_evaluation_page([folder], min_score, page, console)
    try:
        yield
    except typer.Exit as ended:
        if stays and ended.exit_code != TRY_AGAIN:
            keep_until_signal(partial(_announce, shown, console))
        raise
    finally:
        shown.close()


def _announce(page: WebPage, console: Console) -> WebPage:
    print_line(console, "the page stays open until Ctrl-C")
    return page
