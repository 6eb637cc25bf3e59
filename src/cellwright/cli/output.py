"""Console output that commands share: warnings, lines of a summary, the ready line, a progress bar."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import typer
from rich import box
from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn
from rich.table import Table

from cellwright.util.errors import showable
from cellwright.util.files import write_whole

if TYPE_CHECKING:
    from cellwright.engine.loop import Pace
    from cellwright.middleware.server import Server
    from cellwright.running.run import Session

_LONGEST = 10_000  # characters of a line


def warn(what: object) -> None:
    """Say on stderr what goes wrong, or may."""
    typer.echo(f"warning: {what}", err=True)


def say(console: Console, text: str, style: str | None = None) -> None:
    """Print a line as it is: no markup, and folded by the terminal alone."""
    console.print(text, markup=False, soft_wrap=True, style=style)


def note(console: Console, name: str, text: str) -> None:
    """Print a line of a summary; what is told in it may come from a file of somebody else."""
    say(console, f"{name:<10}  {showable(text, _LONGEST)}")


def note_files(console: Console, name: str, files: Iterable[object]) -> None:
    """Print a line for each file of a kind that was written, such as `picture`."""
    for file in files:
        note(console, name, str(file))


FOLD: Mapping[str, Any] = {"overflow": "fold"}
RIGHT: Mapping[str, Any] = {"justify": "right", "no_wrap": True}
WHOLE: Mapping[str, Any] = {"no_wrap": True}
"""Columns of a table: names that may be broken, figures, words that stay in one piece."""


def table(columns: Mapping[str, Mapping[str, Any]], rows: Iterable[Sequence[RenderableType]], **settings: Any) -> Table:
    """A table with a line below its headings, of columns with their settings; `settings` are those of the table."""
    found = Table(**{"box": box.SIMPLE_HEAD, "show_edge": False, "pad_edge": False, **settings})
    for heading, column in columns.items():
        found.add_column(heading, **column)
    for row in rows:
        found.add_row(*row)
    return found


def write_result(file: Path, content: str | bytes) -> list[str]:
    """Write a file that is made of results; what went wrong, if something did. The results are printed all the same."""
    try:
        write_whole(file, content)
    except OSError as error:
        return [f"{file}: cannot be written: {error.strerror or error}"]
    return []


def say_ready(session: Session) -> None:
    """Say that something is served, where, how its time passes, and what it is in ROS 1."""
    assert session.server is not None
    line = ready_line(session.node.name, session.server, session.rate.speed)
    if session.ros is not None:
        line += f", ROS 1 at {session.ros.master.uri}"
        line += "" if session.target.identity is None else f" as {session.target.identity.node}"
    session.say(line + session.target.ready_note())


def words_for(console: Console, notice: Callable[[str], None]) -> dict[str, Any]:
    """Where a session that is run from the command line says things, as `Session` takes it."""
    return {"report": warn, "notice": notice, "say": partial(say, console)}


def ready_line(name: str, server: Server, speed: float | None) -> str:
    """The line that says that something is served, where, and how its time passes: for a speed of None, as it can."""
    host, port = server.address
    if server.lockstep:
        pace = "lockstep"
    else:
        pace = "as fast as it goes" if speed is None else "real time" if speed == 1.0 else f"{speed:g} x real time"
    in_use = f" ({server.busy_port} is in use)" if server.busy_port else ""
    return f"ready: {name} at {host}:{port}{in_use}, {pace}"


def pace_text(pace: Pace) -> str:
    """How time kept to the wall clock, in words."""
    stood = f", time stood {pace.stood:.1f} s for clients that were behind" if pace.stood else ""
    return f"{pace.factor:.4f} x real time, latest tick {pace.worst_lateness * 1e3:.1f} ms late{stood}"


ShowProgress: TypeAlias = Callable[..., None]
"""Takes how much is done, None where no end is known, and a few words."""


@contextmanager
def progress_bar(console: Console, description: str, total: float | None) -> Iterator[ShowProgress | None]:
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
