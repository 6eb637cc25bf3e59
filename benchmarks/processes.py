"""Other processes of a benchmark: a served cell or robot, and the environment of ROS 1."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from cellwright.util.errors import UsageError

_ADDRESS = re.compile(r" at ([^\s,]+):(\d+)")
PATIENCE = 30.0
"""Longest time [s] that a process may take to end on request."""


class ServerProcess:
    """A process of `cellwright` that serves something.

    Args:
        arguments: of the command.
        environment: None for this process's own.

    Raises:
        UsageError: it ended before it served anything.
    """

    def __init__(self, *arguments: str, environment: Mapping[str, str] | None = None) -> None:
        command = [sys.executable, "-m", "cellwright", *arguments]
        self._process = subprocess.Popen(  # noqa: S603
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment
        )
        self._lines: list[str] = []
        self._reader: threading.Thread | None = None
        lines: list[str] = []
        while (found := _ADDRESS.search(lines[-1] if lines else "")) is None:
            lines.append(self._line())
            if not lines[-1]:
                self.close()
                raise UsageError(f"{' '.join(arguments)}: no server started: {''.join(lines).strip()[:300]}")
        self.address = found[1], int(found[2])
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> ServerProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def result(self) -> dict[str, Any]:
        """Return the JSON that it prints after its normal end."""
        self._process.wait()
        if self._reader is not None:
            self._reader.join()
        begin = self._lines.index("{\n")
        document: dict[str, Any] = json.loads("".join(self._lines[begin:]))
        return document

    def close(self) -> None:
        """End it as by Ctrl-C."""
        end(self._process)
        if self._reader is not None:
            self._reader.join()
        if self._process.stdout is not None:
            self._process.stdout.close()

    def _line(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline()

    def _read(self) -> None:
        while line := self._line():
            self._lines.append(line)


def end(process: subprocess.Popen[str]) -> None:
    """End a process as by Ctrl-C, and kill it if that fails."""
    if process.poll() is None:
        if os.name == "posix":
            process.send_signal(signal.SIGINT)
        else:
            process.terminate()  # there is no Ctrl-C for one process alone
    try:
        process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


@contextmanager
def ros1_environment() -> Iterator[dict[str, str]]:
    """Yield an environment for programs of ROS 1, with a free master address and folders."""
    with tempfile.TemporaryDirectory(prefix="cellwright-", ignore_cleanup_errors=True) as folder:
        yield {
            **os.environ,
            "ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}",
            "ROS_IP": "127.0.0.1",
            "ROS_HOME": folder,
            "ROS_LOG_DIR": folder,
        }


def free_port() -> int:
    """Return a port without a listener."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])
