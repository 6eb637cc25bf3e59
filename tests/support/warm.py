"""Commands and programs without the start of an interpreter: forks of a process that has loaded the modules.

The start takes more than a second of processor time, which is all that many commands need. A test about the start runs
an interpreter of its own. So does a test about loaded modules: here nearly everything is loaded.
"""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any

import pytest

from cellwright.running.remote.fork_server import ForkedProcess
from tests.support.leftovers import MARK
from tests.support.waiting import TIMEOUT

MODULES = (
    "cellwright.cli.main",
    "cellwright.cli.check",
    "cellwright.cli.replay.command",
    "cellwright.cli.robot",
    "cellwright.cli.run.command",
    "cellwright.cli.serve",
    "cellwright.cli.teleop.command",
    "cellwright.cli.trials",
    "cellwright.cli.view",
    "cellwright.cli.launchers.gear.launcher",
    "cellwright.recording.format.mcap_file",
    "cellwright.running.remote.program",
    "cellwright.rendering.picture",
    "cellwright.rendering.worker.film",
    "cellwright.rendering.worker.lettering",
    "cellwright.rendering.worker.program",
    "cellwright.middleware.ros1.host.ros1",
)
"""Modules to load once; they import most of the others."""

FORK = "tests.support.warm.fork"
"""Audit event of each program that is forked, with its arguments."""

_RUN = "import runpy, sys; del sys.argv[0]; runpy.run_{}(sys.argv[0], run_name='__main__'{})"
_MODULE = _RUN.format("module", ", alter_sys=True")
_FILE = _RUN.format("path", "")
"""Programs that do what `python -m` does, and `python` with a file."""

_SERVER = """
import array, gc, importlib, io, json, os, socket, sys, time

for name in sys.argv[2:]:
    importlib.import_module(name)
gc.freeze()  # collections of children touch, and so copy, none of this memory
line = socket.socket(fileno=int(sys.argv[1]))
while True:
    text, more, _, _ = line.recvmsg(1, socket.CMSG_SPACE(20))
    if not text:
        sys.exit()
    files = array.array("i", more[0][2])
    if not os.fork():  # of one thread: modules start none
        break
    for file in files:
        os.close(file)
    try:
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass
    except ChildProcessError:
        pass
line.close()
order, report, *streams = files
child = os.fork()
if child:  # this one waits for the program, and tells its status
    for file in (order, *streams):
        os.close(file)
    status = os.waitpid(child, 0)[1]
    os.write(report, b"%d\\n" % (-os.WTERMSIG(status) if os.WIFSIGNALED(status) else os.WEXITSTATUS(status)))
    os._exit(0)
os.setsid()
os.write(report, b"%d\\n" % os.getpid())
os.close(report)
for number, file in enumerate(streams):
    os.dup2(file, number)
    os.close(file)
with open(order, encoding="utf-8") as file:
    file.seek(0)
    job = json.load(file)
os.chdir(job["folder"])
os.environ.clear()
os.environ.update(job["environment"])
time.tzset()
if os.environ.get("PYTHONUNBUFFERED"):
    for name, number, errors in (("stdout", 1, "strict"), ("stderr", 2, "backslashreplace")):
        raw = io.FileIO(number, "w", closefd=False)
        setattr(sys, name, io.TextIOWrapper(raw, "utf-8", errors, write_through=True))
folders = [each for each in os.environ.get("PYTHONPATH", "").split(os.pathsep) if each and each not in sys.path]
sys.path[1:1] = folders
sys.argv[:] = ["-c", *job["arguments"]]
exec(job["first"], {})
program = compile(job["program"], "<string>", "exec")
for name in [name for name in globals() if not name.startswith("__") and name not in ("sys", "program")]:
    del globals()[name]
exec(program)
"""


class WarmProcess(ForkedProcess):
    """A running program that was forked; it has the part of `subprocess.Popen` that Cellwright and its tests use.

    Attributes:
        stdin: its standard input, if that is a pipe.
        stdout: its standard output, if that goes to a pipe.
        stderr: its standard error, likewise.
    """

    stdin: Any
    stdout: Any

    def __init__(self, report: socket.socket, pipes: Sequence[Any]) -> None:
        stdin, stdout, self.stderr = pipes
        super().__init__(report, stdin, stdout)

    def communicate(self, timeout: float = TIMEOUT) -> tuple[str, str]:
        """Read its output to the end and wait for its end; return both outputs.

        Args:
            timeout: bound [s].

        Raises:
            subprocess.TimeoutExpired: it still runs, or another process holds the pipes.
        """
        texts = ["", ""]

        def read(number: int, stream: IO[str]) -> None:
            with stream:
                texts[number] = stream.read()

        streams = [stream for stream in (self.stdout, self.stderr) if stream is not None and not stream.closed]
        readers = [threading.Thread(target=read, args=item, daemon=True) for item in enumerate(streams)]
        for reader in readers:
            reader.start()
        for reader in readers:
            reader.join(timeout)
        if any(reader.is_alive() for reader in readers):
            raise subprocess.TimeoutExpired(f"program {self.pid}", timeout)
        self.wait(timeout)
        return texts[0], texts[1]


class WarmStart:
    """A process that has loaded the modules, and forks for each program.

    Args:
        modules: modules to load.
        python: the interpreter.
        environment: of the process; None for that of the tests.
        first: a program that runs in each child before the requested one.
    """

    def __init__(
        self,
        modules: Sequence[str] = MODULES,
        *,
        python: str = sys.executable,
        environment: Mapping[str, str] | None = None,
        first: str = "",
    ) -> None:
        self._first = first
        run = os.environ.get(MARK, "").partition(" ")[0]
        if environment is None:
            environment = os.environ
        ours, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(
                [python, "-c", _SERVER, str(theirs.fileno()), *modules],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env={**environment, "PYTHONIOENCODING": "utf-8", "COLUMNS": "80", MARK: f"{run} fixture warm"},
                pass_fds=(theirs.fileno(),),
                start_new_session=True,
            )
        self._line = ours
        ours.settimeout(TIMEOUT)

    def popen(
        self,
        command: Sequence[str],
        *,
        folder: Path,
        environment: Mapping[str, str],
        stdin: bool = False,
        stderr: IO[bytes] | int | None = None,
        text: bool | None = None,
        terminal: IO[bytes] | None = None,
    ) -> WarmProcess:
        """Start a Python command in a session of its own, with a pipe for its output.

        Args:
            command: the interpreter, which is not started; then `-m` and a module, `-c` and a program, or a file; then
                arguments.
            folder: its working folder.
            environment: all of its environment. Variables that the interpreter reads when it starts have no effect, but
                for PYTHONUNBUFFERED and PYTHONPATH.
            stdin: make its input a pipe too.
            stderr: file for its standard error, or `subprocess.STDOUT`; None for a pipe.
            text: pipes carry text, not bytes; None for text if the input is no pipe.
            terminal: takes the place of all pipes.
        """
        _, option, *words = command
        if option == "-P":  # of no effect: the modules of Cellwright are loaded
            option, *words = words
        match option:
            case "-m":
                program, arguments = _MODULE, words
            case "-c":
                program, *arguments = words
            case _:
                program, arguments = _FILE, [option, *words]
        ours: list[int | None] = [None, None, None]
        with ExitStack() as stack:

            def pipe(number: int) -> IO[bytes]:
                ends = os.pipe()
                ours[number], theirs = ends[::-1] if number == 0 else ends
                return stack.enter_context(os.fdopen(theirs, "rb" if number == 0 else "wb"))

            if terminal is not None:
                files = [terminal] * 3
            else:
                files = [pipe(0) if stdin else stack.enter_context(open(os.devnull, "rb")), pipe(1)]
                files.append(files[1] if isinstance(stderr, int) else stderr or pipe(2))
            report = self._fork(program, arguments, folder, environment, files)
        if text is None:
            text = not stdin
        kinds: dict[str, Any] = {"encoding": "utf-8", "errors": "replace"} if text else {}
        modes = ("w", "r", "r") if text else ("wb", "rb", "rb")
        pipes = [None if end is None else os.fdopen(end, mode, **kinds) for end, mode in zip(ours, modes, strict=True)]
        return WarmProcess(report, pipes)

    def run(
        self, program: str, *arguments: str, folder: Path, environment: Mapping[str, str] | None = None
    ) -> subprocess.CompletedProcess[str]:
        """Run a program as `python -c` does; return its exit status and its output, as `subprocess.run` does.

        Args:
            program: in Python.
            arguments: `sys.argv[1:]`.
            folder: its working folder.
            environment: all of its environment; None for that of the tests, in a terminal of 80 columns. Variables that
                the interpreter reads when it starts have no effect.

        Raises:
            AssertionError: it did not end; it has been killed, with all of its session.
        """
        if environment is None:
            environment = {**os.environ, "COLUMNS": "80", "PYTHONIOENCODING": "utf-8"}
        with open(os.devnull, "rb") as nothing, TemporaryFile() as out, TemporaryFile() as err:
            report = self._fork(program, arguments, folder, environment, (nothing, out, err))
            process = WarmProcess(report, (None, None, None))
            try:
                status = process.wait(TIMEOUT)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                raise AssertionError(f"no end of the program within {TIMEOUT:g} s\n{_text(out)}{_text(err)}") from None
            return subprocess.CompletedProcess(["-c", *arguments], status, _text(out), _text(err))

    def close(self) -> None:
        """End the process; programs that it has forked run on."""
        self._line.close()
        self._process.wait(TIMEOUT)

    def _fork(
        self,
        program: str,
        arguments: Sequence[str],
        folder: Path,
        environment: Mapping[str, str],
        streams: Sequence[IO[bytes]],
    ) -> socket.socket:
        """Fork a program; return the socket from which its id and its exit status come."""
        job = {
            "first": self._first,
            "program": program,
            "arguments": list(arguments),
            "folder": str(folder),
            "environment": dict(environment),
        }
        sys.audit(FORK, arguments)
        report, their_report = socket.socketpair()
        with their_report, TemporaryFile() as order:
            order.write(json.dumps(job).encode())
            order.flush()
            files = [order.fileno(), their_report.fileno(), *(stream.fileno() for stream in streams)]
            socket.send_fds(self._line, [b"."], files)
        return report


def _text(file: IO[bytes]) -> str:
    file.seek(0)
    return file.read().decode("utf-8").replace("\r\n", "\n")


_shared: dict[str, WarmStart] = {}


def warm_start(name: str = "Cellwright", make: Callable[[], WarmStart] = WarmStart) -> WarmStart:
    """Return a warm start that all tests of a worker share; made at first use.

    Args:
        name: name of the package that it has loaded.
        make: makes it.
    """
    if name not in _shared:
        _shared[name] = make()
    return _shared[name]


@pytest.fixture
def warm() -> WarmStart:
    """Return the process that has loaded Cellwright."""
    return warm_start()


def pytest_sessionfinish() -> None:
    for start in _shared.values():
        start.close()
