"""Workers of an evaluation without the start of an interpreter: each is forked from a process that has loaded theirs.

The start takes most of the processor time of a short job. Tests of the start itself, of what a worker leaves behind,
and of equal results in several processes, have workers that the evaluation starts itself.
"""

from __future__ import annotations

import json
import os
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Mapping, Sequence
from tempfile import TemporaryFile
from typing import IO, Any

from tests.waiting import TIMEOUT

_SERVER = """
import cellwright.evaluation.worker
import gc, json, os, socket, sys

gc.freeze()  # collections of children touch, and so copy, none of this memory
line, keepers = socket.socket(fileno=int(sys.argv[1])), []
while True:
    _, files, _, _ = socket.recv_fds(line, 1, 5)
    if not files:
        break
    keeper = os.fork()  # of one thread: modules start none
    if not keeper:
        break
    for file in files:
        os.close(file)
    keepers.append(keeper)
    keepers = [each for each in keepers if not os.waitpid(each, os.WNOHANG)[0]]
line.close()
if not files:
    for keeper in keepers:
        os.waitpid(keeper, 0)
    sys.exit()
stdin, stdout, stderr, answers, order = files
child = os.fork()
if child:  # the keeper: it says how the worker ended
    for file in (stdin, stdout, stderr, order):
        os.close(file)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    os.write(answers, b"%d\\n" % status)
    os._exit(0)
os.setsid()
for number, file in enumerate((stdin, stdout, stderr)):
    os.dup2(file, number)
    os.close(file)
with open(order, encoding="utf-8") as file:
    file.seek(0)
    job = json.load(file)
os.chdir(job["folder"])
os.environ.clear()
os.environ.update(job["environment"])
sys.argv[:] = ["-c", *job["arguments"]]
os.write(answers, b"%d\\n" % os.getpid())
os.close(answers)
program = compile(job["program"], "<string>", "exec")
del gc, json, os, socket, line, files, file, number, job, keeper, keepers, child, _
del stdin, stdout, stderr, answers, order
exec(program)
"""


class ForkedWorkers:
    """A process that has loaded the worker's modules, and forks for each worker.

    Args:
        environment: of a worker; what the interpreter reads when it starts comes from here.
    """

    def __init__(self, environment: Mapping[str, str]) -> None:
        ours, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", _SERVER, str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env=dict(environment),
                pass_fds=(theirs.fileno(),),
                start_new_session=True,
            )
        self._line = ours

    def start(self, command: Sequence[str], *, stderr: IO[bytes], env: Mapping[str, str], **_: object) -> ForkedWorker:
        """Fork a worker; it takes the arguments that `WorkerProcess` gives to `subprocess.Popen`."""
        _python, apart, word, program, *arguments = command
        assert (apart, word) == ("-P", "-c")
        job = {"program": program, "arguments": arguments, "folder": os.getcwd(), "environment": dict(env)}
        (stdin, to_stdin), (from_stdout, stdout), (answers, to_answers) = os.pipe(), os.pipe(), os.pipe()
        with TemporaryFile() as order:
            order.write(json.dumps(job).encode())
            order.flush()
            socket.send_fds(self._line, [b"."], [stdin, stdout, stderr.fileno(), to_answers, order.fileno()])
        for file in (stdin, stdout, to_answers):
            os.close(file)
        return ForkedWorker(to_stdin, from_stdout, answers)

    def close(self) -> None:
        """End the process."""
        self._line.close()
        self._process.wait(TIMEOUT)


class ForkedWorker:
    """A forked process, as far as `WorkerProcess` uses `subprocess.Popen`."""

    def __init__(self, stdin: int, stdout: int, answers: int) -> None:
        self.stdin = os.fdopen(stdin, "wb")
        self.stdout = os.fdopen(stdout, "rb")
        self._answers = os.fdopen(answers, "rb", buffering=0)
        self.returncode: int | None = None
        self.pid = int(self._answers.readline())  # it has a session of its own by now

    def poll(self) -> int | None:
        if self.returncode is None and select.select([self._answers], [], [], 0.0)[0]:
            self._take_status()
        return self.returncode

    def wait(self) -> int:
        if self.returncode is None:
            assert select.select([self._answers], [], [], TIMEOUT)[0], f"no end of the worker within {TIMEOUT:g} s"
        status = self.poll()
        assert status is not None
        return status

    def _take_status(self) -> None:
        self.returncode = int(self._answers.readline() or -signal.SIGKILL)
        self._answers.close()


class Stand:
    """The module `subprocess` as `cellwright.evaluation.worker_process` uses it, with forked workers."""

    PIPE = subprocess.PIPE

    def __init__(self, workers: ForkedWorkers) -> None:
        self.Popen: Any = workers.start
