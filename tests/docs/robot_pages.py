"""Pages about a single robot: a shell with the command `cellwright`, and a port of the test's own."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from tests.docs.pages import Command, Step
from tests.support.short_commands import short_commands
from tests.support.warm import WarmStart

SHORT = ("check *", "operate *", "robot *", "teleop *--check-driver*", "teleop *--until*")


@contextmanager
def shell(home: Path, programs: Path, warm: WarmStart) -> Iterator[dict[str, str]]:
    """Yield the environment of a shell.

    Args:
        home: its home folder.
        programs: a folder for its programs.
        warm: runs commands that end without input.
    """
    programs.mkdir(exist_ok=True)
    path = f"{programs}:{os.environ['PATH']}"
    with short_commands(programs / "cellwright", SHORT, warm):
        yield {"PATH": path, "HOME": str(home), "COLUMNS": "100", "LANG": "C.UTF-8"}


def at(port: int, step: Step) -> Step:
    """Return a step with another port than the default one of a robot."""
    if not isinstance(step, Command):
        return step
    more = {
        "cellwright teleop": f" --port {port}",
        "cellwright operate": f" --connect 127.0.0.1:{port}",
        "python wave.py": f" 127.0.0.1:{port}",
    }
    return replace(
        step, line=step.line + next((added for start, added in more.items() if step.line.startswith(start)), "")
    )
