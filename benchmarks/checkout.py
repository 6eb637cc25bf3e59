"""Another checkout of Cellwright, run in processes of its own with this interpreter and its packages."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

from cellwright.util.errors import UsageError

OURS = Path(__file__).resolve().parent.parent
"""Folder of this checkout."""
LIMIT = 1200.0
"""Time [s] after which a process has failed."""

_CHECK = """
import sys, benchmarks, cellwright
from pathlib import Path
folder = Path.cwd().resolve()
for package in (benchmarks, cellwright):
    if not Path(package.__file__).resolve().is_relative_to(folder):
        sys.exit(f"{package.__name__} is loaded from {package.__file__}")
"""


class Checkout:
    """A checkout with its sources, not installed.

    Args:
        folder: its folder.

    Raises:
        UsageError: it is no checkout with benchmarks.
    """

    def __init__(self, folder: Path) -> None:
        for needed in ("src/cellwright/__init__.py", "benchmarks/trial.py"):
            if not (folder / needed).is_file():
                raise UsageError(f"{folder}: {needed} is missing; give the folder of a checkout of Cellwright")
        self.folder = folder.resolve()

    @property
    def commit(self) -> str:
        """Abbreviated commit, marked if files differ from it; empty where git does not say."""
        command = ["git", "-C", str(self.folder), "describe", "--always", "--dirty", "--exclude=*"]
        with suppress(OSError, subprocess.SubprocessError):
            return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10.0).stdout.strip()  # noqa: S603
        return ""

    def run(self, program: str, *arguments: str) -> Any:
        """Run a program with the modules of this checkout; return the JSON that it prints.

        Raises:
            UsageError: it failed, or loaded modules from elsewhere.
        """
        paths = os.pathsep.join(str(self.folder / each) for each in ("src", "."))
        done = subprocess.run(  # noqa: S603
            [sys.executable, "-c", _CHECK + program, *arguments],
            cwd=self.folder,
            env={**os.environ, "PYTHONPATH": paths},
            capture_output=True,
            text=True,
            timeout=LIMIT,
            check=False,
        )
        if done.returncode != 0:
            raise UsageError(f"{self.folder}: a timed process failed: {done.stderr.strip()[-300:]}")
        return json.loads(done.stdout)
