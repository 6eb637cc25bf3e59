"""Fork server: a process that has loaded modules, and forks for each program that it is asked for.

An interpreter that loads Cellwright needs a second of processor time, often more than the run that follows. A fork
takes a hundredth of that. Linux only: elsewhere libraries do not expect a fork.
"""

import errno
import gc
import json
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from importlib import import_module
from typing import IO

from cellwright.util.process import own_program

CAN_FORK = sys.platform == "linux"
"""True if this system has fork servers."""
_FILES = 4
"""Files that come with a request: a socket for order and report, stdin, stdout and stderr."""


class ForkServer:
    """A fork server. It ends when it is closed, or with this process; programs that it has forked run on.

    Args:
        modules: names of the modules that it loads; none may start a thread.
        environment: complete environment of the server. What an interpreter reads at its start counts from here.

    Raises:
        OSError: it cannot be started.
    """

    def __init__(self, modules: Sequence[str], environment: Mapping[str, str]) -> None:
        self._line, theirs = socket.socketpair()
        with theirs, ExitStack() as stack:
            stack.callback(self._line.close)
            self._process = subprocess.Popen(  # noqa: S603 - our own program
                own_program(__name__, str(theirs.fileno()), *modules),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env=dict(environment),
                pass_fds=(theirs.fileno(),),
                start_new_session=True,  # a Ctrl-C on the terminal is for this process
            )
            stack.pop_all()
        self.close = weakref.finalize(self, _close, self._line, self._process)
        """Ends the server, and waits for that."""

    @property
    def is_running(self) -> bool:
        """True if it can fork: it has neither ended nor been closed."""
        return self.close.alive and self._process.poll() is None

    def popen(
        self, command: Sequence[str], *, env: Mapping[str, str], stderr: IO[bytes] | int, **_: object
    ) -> "ForkedProcess":
        """Fork for a program, in a session of its own and in the working folder of this process.

        Arguments are those with which `ChildProcess` calls `subprocess.Popen`; stdin and stdout are pipes.

        Args:
            command: name of a module whose `main` is the program, and the program's arguments, as for `own_program`.
            env: complete environment of the program.
            stderr: target of its stderr: a file, a file's number, or `subprocess.STDOUT`.

        Raises:
            OSError: the machine has no room for another process, or the server has ended.
        """
        order = {"command": list(command), "folder": os.getcwd(), "environment": dict(env)}
        with ExitStack() as stack:
            report, their_report = map(stack.enter_context, socket.socketpair())
            their_stdin, stdin = map(stack.enter_context, _pipe())
            stdout, their_stdout = map(stack.enter_context, _pipe())
            error = stderr if isinstance(stderr, int) else stderr.fileno()
            error = their_stdout.fileno() if error == subprocess.STDOUT else error
            files = [their_report.fileno(), their_stdin.fileno(), their_stdout.fileno(), error]
            with suppress(ConnectionError):  # the server has died, which the report shows
                socket.send_fds(self._line, [b"."], files)
            for end in (their_report, their_stdin, their_stdout):
                end.close()
            with suppress(ConnectionError):
                report.sendall(json.dumps(order).encode())
                report.shutdown(socket.SHUT_WR)
            process = ForkedProcess(report, stdin, stdout)
            stack.pop_all()
        return process


class ForkedProcess:
    """A program that was forked, with the part of `subprocess.Popen` that is used; several threads may wait for it.

    Args:
        report: the socket from which its id and its exit status come.
        stdin: its standard input.
        stdout: its standard output.

    Attributes:
        pid: id of its process.
        returncode: its exit status, negative for a signal; None as far as is known while it runs.

    Raises:
        OSError: it was not forked.
    """

    def __init__(self, report: socket.socket, stdin: IO[bytes], stdout: IO[bytes]) -> None:
        self.returncode: int | None = None
        self.stdin, self.stdout = stdin, stdout
        self._report, self._text, self._has_ended, self._lock = report, b"", False, threading.Lock()
        self._read(None, lines=1)
        self.pid = int(self._text.split()[0]) if self._text else 0
        if not self._text:
            raise ChildProcessError("the fork server has ended")
        if self.pid < 0:
            raise OSError(-self.pid, os.strerror(-self.pid))
        weakref.finalize(self, report.close)  # not before: threads may read it

    def poll(self) -> int | None:
        """Return the exit status; None while it runs."""
        if self.returncode is None and self._read(0.0, lines=2):
            status = self._text.split()[1:]
            # a server that was killed tells nothing more, and its programs were most likely killed too
            self.returncode = int(status[0]) if status else -signal.SIGKILL
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Return the exit status, after at most `timeout` [s]; None for no bound.

        Raises:
            subprocess.TimeoutExpired: it still runs.
        """
        if self.returncode is None and not self._read(timeout, lines=2):
            raise subprocess.TimeoutExpired(f"program {self.pid}", timeout or 0.0)
        status = self.poll()
        assert status is not None
        return status

    def send_signal(self, number: int) -> None:
        """Send a signal to it, if it runs."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def terminate(self) -> None:
        """Send it SIGTERM."""
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """Send it SIGKILL."""
        self.send_signal(signal.SIGKILL)

    def _read(self, timeout: float | None, *, lines: int) -> bool:
        """Read the report until it has a number of lines, or its end; return False if nothing comes for a time [s]."""
        while self._text.count(b"\n") < lines and not self._has_ended:
            if not select.select([self._report], [], [], timeout)[0]:
                return False
            with self._lock:
                if self._text.count(b"\n") < lines:  # otherwise another thread has read it meanwhile
                    data = b""
                    with suppress(ConnectionResetError):  # its end, if the order was not read
                        data = self._report.recv(64)
                    self._has_ended = not data
                    self._text += data
        return True


def main() -> None:
    """Load the modules, and fork for each request; in a fork, run the program that was ordered."""
    _, _, line, *modules = sys.argv
    for name in modules:
        import_module(name)
    gc.freeze()  # collections in forks touch, and so copy, none of this memory
    report, streams = _await_order(socket.socket(fileno=int(line)))
    os.setsid()
    for target, stream in enumerate(streams):
        os.dup2(stream, target)
    order = json.loads(b"".join(iter(lambda: report.recv(1 << 16), b"")))
    report.detach()
    for number in map(int, os.listdir("/proc/self/fd")):
        if number >= len(streams):  # a program that is started has none of them either
            with suppress(OSError):  # that of the list itself
                os.close(number)
    _run(**order)


def _await_order(line: socket.socket) -> tuple[socket.socket, list[int]]:
    """Fork for each request; return, in a fork alone, the socket for order and report, and the standard streams."""
    ends, wake = os.pipe()
    for end in (ends, wake):
        os.set_blocking(end, False)
    signal.signal(signal.SIGCHLD, lambda _number, _frame: None)
    signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
    reports: dict[int, socket.socket] = {}
    while True:
        ready = select.select([line.fileno(), ends], [], [])[0]
        if ends in ready:
            os.read(ends, 4096)
            _report_ends(reports)
        if line.fileno() not in ready:
            continue
        files = socket.recv_fds(line, 1, _FILES)[1]
        if not files:
            os._exit(0)
        report, streams = socket.socket(fileno=files[0]), files[1:]
        try:
            child = os.fork()
        except OSError as error:
            child = -(error.errno or errno.EAGAIN)
        if child == 0:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            for each in (line, *reports.values()):
                each.detach()  # their numbers are closed with all others
            return report, streams
        for stream in streams:
            os.close(stream)
        _send(report, child)
        if child > 0:
            reports[child] = report
        else:
            report.close()


def _report_ends(reports: dict[int, socket.socket]) -> None:
    with suppress(ChildProcessError):
        while (ended := os.waitpid(-1, os.WNOHANG))[0]:
            with reports.pop(ended[0]) as report:
                _send(report, os.waitstatus_to_exitcode(ended[1]))


def _send(report: socket.socket, number: int) -> None:
    with suppress(OSError):  # who asked has ended
        report.send(b"%d\n" % number)


def _run(command: Sequence[str], folder: str, environment: Mapping[str, str]) -> None:
    """Run `main` of a module as a new process of this command would."""
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    time.tzset()
    if "numpy.random" in sys.modules:
        # no seed of a fork is another one's; Python does so for its own numbers
        sys.modules["numpy.random"].seed()
    sys.argv[2:] = command[1:]
    import_module(command[0]).main()


def _pipe() -> tuple[IO[bytes], IO[bytes]]:
    reader, writer = os.pipe()
    return os.fdopen(reader, "rb"), os.fdopen(writer, "wb")


def _close(line: socket.socket, process: "subprocess.Popen[bytes]") -> None:
    line.shutdown(socket.SHUT_RDWR)  # also where a fork of this process has it
    line.close()
    process.wait()
