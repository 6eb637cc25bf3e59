"""Console output that commands share: warnings, lines of a summary, the ready line, a progress bar."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn

from cellwright.util.errors import printable
from cellwright.util.files import write_atomic

if TYPE_CHECKING:
    from cellwright.engine.loop import PaceFigures
    from cellwright.middleware.server import Server
    from cellwright.running.run import Outputs, Session

_MAX_LENGTH = 10_000  # characters of a line


def warn(message: object) -> None:
    """Print a warning or an error on stderr."""
    echo(f"warning: {message}", err=True)


def echo(text: str, *, err: bool = False) -> None:
    """Print a text that may come from a file or another program, without what a terminal would obey."""
    typer.echo(printable(text, _MAX_LENGTH), err=err)


def print_line(console: Console, text: str, style: str | None = None) -> None:
    """Print a line: no markup, folded by the terminal alone, and without what a terminal would obey."""
    console.print(printable(text, _MAX_LENGTH), markup=False, soft_wrap=True, style=style)


def print_entry(console: Console, name: str, text: str) -> None:
    """Print a line of a summary; its text may come from a user's file."""
    print_line(console, f"{name:<10}  {text}")


def print_files(console: Console, name: str, files: Iterable[object]) -> None:
    """Print a line for each written file of a kind, such as `picture`."""
    for file in files:
        print_entry(console, name, str(file))


def write_result(file: Path, content: str | bytes) -> list[str]:
    """Write a file of results; return the errors. The results are printed all the same."""
    try:
        write_atomic(file, content)
    except OSError as error:
        return [f"{file}: cannot be written: {error.strerror or error}"]
    return []


def report_ready(session: Session, note: str = "") -> None:
    """Print the name, the address and the rate of a served session, its node in ROS 1, and its domain in ROS 2."""
    serving = session.serving
    assert serving is not None
    line = ready_line(session.node.name, serving.server, session.rate.speed)
    if serving.ros1 is not None:
        line += f", ROS 1 at {serving.ros1.master.uri}"
        line += "" if serving.ros1.identity.kind == "cell" else f" as {serving.ros1.identity.node}"
    if serving.ros2 is not None:
        line += f", ROS 2 in domain {serving.ros2.domain}"
    session.outputs.on_message(line + note)


def session_outputs(console: Console, notice: Callable[[str], None]) -> Outputs:
    """Return the outputs of a session on the command line."""
    from cellwright.running.run import Outputs  # slow to load

    return Outputs(warn, notice, partial(print_line, console))


def ready_line(name: str, server: Server, speed: float | None) -> str:
    """Return the ready line: name, address, and rate; for a speed of None, as fast as possible."""
    host, port = server.address
    if server.lockstep:
        pace = "lockstep"
    else:
        pace = "as fast as possible" if speed is None else "real time" if speed == 1.0 else f"{speed:g} x real time"
    in_use = f" ({server.busy_port} is in use)" if server.busy_port else ""
    return f"ready: {name} at {host}:{port}{in_use}, {pace}"


def pace_text(pace: PaceFigures) -> str:
    """Return how time kept up with the wall clock, in words."""
    held = f", {pace.held:.1f} s paused for slow clients" if pace.held else ""
    return f"{pace.factor:.4f} x real time, latest step {pace.worst_lateness * 1e3:.1f} ms late{held}"


ShowProgress: TypeAlias = Callable[..., None]
"""Receives the progress, None if no end is known, and a few words."""


@contextmanager
def progress_bar(console: Console, description: str, total: float | None) -> Iterator[ShowProgress | None]:
    """Show a progress line, which disappears at the end; yield None if the console does not show it."""
    if not console.is_interactive:
        yield None
        return
    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(24), TextColumn("{task.fields[status]}"))
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task(description, total=total, status="")

        def show(done: float | None, status: str = "") -> None:
            progress.update(task, completed=done, status=status)

        yield show
