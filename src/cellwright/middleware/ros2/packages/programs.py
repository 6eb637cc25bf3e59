"""Programs that an installation runs to their ends: pip, interpreters with ROS 2's wheels, compilers."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from cellwright.util.errors import UsageError

BOOTSTRAP_VARIABLES = ("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE")
"""Variables that each interpreter with ROS 2's wheels sets for itself, and that would mislead another one."""

_LAST_LINES = 20  # of the output of a program that failed


def pip(environment: Path, arguments: Sequence[str], on_line: Callable[[str], None] = lambda _: None) -> None:
    """Run this interpreter's pip on a virtual environment; files of Python are not compiled.

    Raises:
        UsageError: it failed; the error ends with its last lines.
    """
    options = ["--python", str(environment / "bin" / "python"), "--disable-pip-version-check", "--no-input"]
    own = {"PIP_PROGRESS_BAR": "off"}
    command = [sys.executable, "-m", "pip", *options, *arguments, "--no-compile"]
    run(command, "pip", clean_environment() | own, on_line)


def clean_environment(variables: Mapping[str, str] = os.environ) -> dict[str, str]:
    """Return the variables of a process that starts an interpreter with ROS 2's wheels."""
    dropped = {"PYTHONHOME", "PYTHONPATH", *BOOTSTRAP_VARIABLES}
    return {name: value for name, value in variables.items() if name not in dropped}


def run(
    command: Sequence[str], what: str, variables: Mapping[str, str], on_line: Callable[[str], None] = lambda _: None
) -> None:
    """Run a program to its end; `on_line` takes each line of its output.

    Raises:
        UsageError: it cannot be started or failed; the error names `what`, and ends with its last lines.
    """
    lines: list[str] = []
    try:
        with subprocess.Popen(  # noqa: S603
            command,
            env=dict(variables),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
        ) as process:
            for line in process.stdout or ():
                lines = [*lines[1 - _LAST_LINES :], line.rstrip("\n")]
                on_line(lines[-1])
    except OSError as error:
        raise UsageError(f"{what}: {command[0]}: cannot be started: {error.strerror or error}") from None
    if process.returncode != 0:
        raise UsageError("\n".join([f"{what}: {Path(command[0]).name} failed:", *lines]))
