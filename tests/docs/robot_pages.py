"""Pages about a single robot: a shell with the command `cellwright`, and a port of the test's own."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from tests.docs.pages import Command, Step
from tests.short_commands import short_commands
from tests.warm import WarmStart

SHORT = ("check *", "operate *", "robot *", "teleop *--check-driver*", "teleop *--until*")


@contextmanager
def shell(home: Path, programs: Path, warm: WarmStart) -> Iterator[dict[str, str]]:
    """The environment of a shell, for as long as a block lasts.

    Args:
        home: its home folder.
        programs: a folder for its programs.
        warm: runs commands that end by themselves.
    """
    programs.mkdir(exist_ok=True)
    path = f"{programs}:{os.environ['PATH']}"
    with short_commands(programs / "cellwright", SHORT, warm):
        yield {"PATH": path, "HOME": str(home), "COLUMNS": "100", "LANG": "C.UTF-8"}


def at(port: int, step: Step) -> Step:
    """A step with another port in place of the one that a single robot has."""
    if not isinstance(step, Command):
        return step
    more = {
        "cellwright teleop": f" --port {port}",
        "cellwright operate": f" --connect 127.0.0.1:{port}",
        "python wave.py": f" 127.0.0.1:{port}",
    }
    return replace(
        step, line=step.line + next((what for start, what in more.items() if step.line.startswith(start)), "")
    )
