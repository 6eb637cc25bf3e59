"""Cells, robots and recordings served with a page, each by a process as a user starts it."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.support.processes import Process
from tests.support.warm import warm_start


class Viewed(Process):
    """Command with a page: `view`, or another with `--view`.

    Args:
        folder: its working directory.
        arguments: those of `cellwright`, without those of the page.
    """

    def __init__(self, folder: Path, *arguments: str) -> None:
        command = [sys.executable, "-m", "cellwright", *arguments]
        if arguments[0] != "view":
            command.append("--view")
        if "--view-port" not in arguments:
            command += ["--view-port", "0"]
        super().__init__(command, os.environ, folder, warm=warm_start())

    @property
    def address(self) -> tuple[str, int]:
        """Address for clients."""
        found = self.wait_for(r"^ready: .* at ([\d.]+):(\d+)")
        return found[1], int(found[2])

    @property
    def url(self) -> str:
        """Printed address of the page."""
        return self.wait_for(r"^page: (http://\S+)$")[1]


@contextmanager
def viewed(folder: Path, *arguments: str) -> Iterator[Viewed]:
    """Run a command with a page; at the end stop it and its children."""
    process = Viewed(folder, *arguments)
    try:
        yield process
    finally:
        process.kill()
