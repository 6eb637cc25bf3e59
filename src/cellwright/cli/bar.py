"""A line on a terminal that moves while something takes time."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn


class Tell(Protocol):
    """Takes how much is done, None where no end is known, and a few words."""

    def __call__(self, done: float | None, status: str = "") -> None:
        """Show it."""


@contextmanager
def bar(console: Console, description: str, total: float | None) -> Iterator[Tell | None]:
    """A line that moves while something takes time and is gone afterwards; None where nobody would see it move."""
    if not console.is_interactive:
        yield None
        return
    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(24), TextColumn("{task.fields[status]}"))
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task(description, total=total, status="")

        def tell(done: float | None, status: str = "") -> None:
            progress.update(task, completed=done, status=status)

        yield tell
