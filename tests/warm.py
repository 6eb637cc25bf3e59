"""Commands and programs without the start of an interpreter: each is forked from a process that has loaded the modules.

The start takes a second of processor time, which is all that many commands need. A test that is about the start runs
an interpreter of its own. So does one that is about what is loaded when: here nearly everything is.
"""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

import pytest

from tests.waiting import TIMEOUT

MODULES = (
    "cellwright.__main__",
    "cellwright.cli.check",
    "cellwright.cli.replay.command",
    "cellwright.cli.robot.command",
    "cellwright.cli.run.command",
    "cellwright.cli.serve.command",
    "cellwright.cli.teleop.command",
    "cellwright.cli.trials",
    "cellwright.recording.mcap_file",
    "cellwright.rendering.picture",
)
"""Modules that are loaded once; they bring most of the others."""

_SERVER = """
import gc, importlib, json, os, socket, sys

for name in sys.argv[2:]:
    importlib.import_module(name)
gc.freeze()  # collections of children touch, and so copy, none of this memory
line = socket.socket(fileno=int(sys.argv[1]))
while True:
    _, files, _, _ = socket.recv_fds(line, 1, 3)
    if not files:
        sys.exit()
    child = os.fork()  # of one thread: modules start none
    if not child:
        break
    for file in files:
        os.close(file)
    line.sendall(b"%d\\n" % child)
    line.sendall(b"%d\\n" % os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
line.close()
os.setsid()
for number, file in enumerate(files[:2], start=1):
    os.dup2(file, number)
    os.close(file)
with open(files[2], encoding="utf-8") as file:
    file.seek(0)
    job = json.load(file)
os.chdir(job["folder"])
os.environ.clear()
os.environ.update(job["environment"])
sys.argv[:] = ["-c", *job["arguments"]]
program = compile(job["program"], "<string>", "exec")
del gc, importlib, json, os, socket, sys, name, line, files, file, number, job, child, _
exec(program)
"""


class WarmStart:
    """A process that has loaded the modules, and forks for each program.

    Args:
        modules: what it loads.
    """

    def __init__(self, modules: tuple[str, ...] = MODULES) -> None:
        ours, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-c", _SERVER, str(theirs.fileno()), *modules],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env={**os.environ, "PYTHONIOENCODING": "utf-8", "COLUMNS": "80"},
                pass_fds=(theirs.fileno(),),
                start_new_session=True,
            )
        self._line = ours
        self._answers = ours.makefile("r", encoding="ascii")
        ours.settimeout(TIMEOUT)

    def run(
        self, program: str, *arguments: str, folder: Path, environment: Mapping[str, str] | None = None
    ) -> subprocess.CompletedProcess[str]:
        """Run a program as `python -c` does; its exit status and what it printed, as `subprocess.run` returns them.

        Args:
            program: in Python.
            arguments: `sys.argv[1:]`.
            folder: where it runs.
            environment: all of its environment; None for that of the tests, in a terminal of 80 columns. Variables
                that the interpreter reads when it starts have no effect.

        Raises:
            AssertionError: it did not end; it has been killed, with all of its session.
        """
        if environment is None:
            environment = {**os.environ, "COLUMNS": "80", "PYTHONIOENCODING": "utf-8"}
        job = {"program": program, "arguments": arguments, "folder": str(folder), "environment": dict(environment)}
        with TemporaryFile() as out, TemporaryFile() as err, TemporaryFile() as order:
            order.write(json.dumps(job).encode())
            order.flush()
            socket.send_fds(self._line, [b"."], [out.fileno(), err.fileno(), order.fileno()])
            pid = int(self._answers.readline())
            try:
                status = int(self._answers.readline())
            except TimeoutError:
                os.killpg(pid, signal.SIGKILL)
                self.close()
                raise AssertionError(f"no end of the program within {TIMEOUT:g} s\n{_text(out)}{_text(err)}") from None
            return subprocess.CompletedProcess(["-c", *arguments], status, _text(out), _text(err))

    def close(self) -> None:
        """End the process."""
        self._answers.close()
        self._line.close()
        self._process.wait(TIMEOUT)


def _text(file: IO[bytes]) -> str:
    file.seek(0)
    return file.read().decode("utf-8").replace("\r\n", "\n")


@pytest.fixture(scope="session")
def warm() -> Iterator[WarmStart]:
    """A process that has loaded Cellwright, for all tests of a run; import it in a `conftest.py`."""
    start = WarmStart()
    yield start
    start.close()
