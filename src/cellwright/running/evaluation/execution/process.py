"""Worker process of an evaluation: its start, its limits and its end, and the number of processors."""

import errno
import math
import os
import secrets
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from queue import SimpleQueue
from typing import IO, Any

from cellwright.middleware.wire import guard
from cellwright.running.evaluation.execution.channel import ChannelError, Message, Progress, Report, read_messages
from cellwright.running.evaluation.execution.memory import OwnTime, oom_kills
from cellwright.running.evaluation.results.result import POINT_TOLERANCE
from cellwright.running.evaluation.results.seal import KEY_VARIABLE
from cellwright.running.remote.fork_server import CAN_FORK, ForkServer
from cellwright.running.remote.guarded import GuardedProcess, guarding_server
from cellwright.running.run import Outcome
from cellwright.util.errors import printable
from cellwright.util.process import own_program

_WORKER = "cellwright.running.evaluation.execution.worker"
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Variables that limit numerical libraries to one thread each: workers share the processor among them."""
_TAIL_LINES = 30  # lines of a log that a result holds
_TAIL_BYTES = 16384
_STACK_TIMEOUT = 1.0  # [s] that a process may take to write where it is
_KILL_TIMEOUT = 10.0  # [s] that a process with all that it has started may take to end
_MAX_REASON = 1000  # characters
NO_MEMORY = "while the machine had no memory left"
"""End of the fault of a run that the kernel, most likely, has killed for want of memory."""
_OUTSIDE = frozenset(f"killed by {name}" for name in ("SIGKILL", "SIGTERM"))  # what a machine ends processes with
DISK_FULL = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))
"""Errors of a file when the disk, or the user's part of it, is full."""
_DISK_FULL_TEXTS = tuple(f"OSError: [Errno {number}]" for number in DISK_FULL)


def usable_processors() -> int:
    """Return the number of processors that this process may use: a container may have fewer than the machine."""
    allowed = getattr(os, "sched_getaffinity", None)  # Linux only
    return os.cpu_count() or 1 if allowed is None else len(allowed(0))


@dataclass(frozen=True, slots=True)
class JobOrder:
    """Order for a worker process, which receives it as JSON.

    Attributes:
        wall: limit of wall time [s].
        memory: limit of memory [bytes]; 0: unlimited.
        files: files of the trial; none: the agent is only made, and nothing is run.
        overrides: values that replace those of the files, as `KEY=VALUE`.
        record: file for a recording; empty for none.
        over: `socket` for an agent in a process of its own; empty for one in the worker's.
        replays: recording whose commands are played instead of running the agent; empty for none.
        end: simulation time [s] up to which they are played.
        key: key that signs the lines of the worker.
        start: simulation time [s] until the competition must have started.
    """

    agent: str
    wall: float
    memory: int
    files: Sequence[str] = ()
    seed: int = 0
    vary: bool = False
    run_log: str = ""
    record: str = ""
    overrides: Sequence[str] = ()
    over: str = ""
    replays: str = ""
    end: float = 0.0
    key: str = ""
    start: float = math.inf


def worker_server() -> ForkServer | None:
    """Return a new fork server for workers; None where there is none.

    Raises:
        OSError: it cannot be started.
    """
    return guarding_server([_WORKER], _environment()) if CAN_FORK else None


class WorkerProcess(GuardedProcess):
    """A process of `cellwright.running.evaluation.execution.worker`.

    Args:
        log: file for its output.
        server: the server that forks for it, from `worker_server`; None to start it.
        wakes: receives this object whenever its state has changed.
        attainable: the most points that the run can have.
    """

    def __init__(
        self,
        order: JobOrder,
        log: Path,
        server: ForkServer | None,
        wakes: SimpleQueue[Any] | None = None,
        attainable: float = math.inf,
    ) -> None:
        self.log = log
        self.started = time.monotonic()
        self.begun: float | None = None
        self.progress = Progress(0.0, 0.0)
        self.scene = self.frame = ""
        """Its scene and its newest state, as a `StateReporter` sends them."""
        self.result: Report | None = None
        self.made = False
        """True if the agent could be made, and no run was ordered."""
        self.refused = ""
        self.invalid = ""
        """Fault of its newest line; empty if there is none."""
        self.kills_itself = False
        """True if the program has sent its own process, or its guard, a signal that ends it."""
        self.own_time: OwnTime | None = None
        """Time that it has taken of its own accord, since it began; None before that."""
        self._attainable = attainable
        self._worker = 0  # its id, which the program may have forged
        self._key = secrets.token_hex(16)
        self._oom_kills = oom_kills()
        self._wakes: SimpleQueue[Any] = SimpleQueue() if wakes is None else wakes
        self._folder = tempfile.TemporaryDirectory(prefix="cellwright-", ignore_cleanup_errors=True)
        try:
            with log.open("wb") as stderr:
                super().__init__(
                    [_WORKER, self._folder.name] if server is not None else own_program(_WORKER, self._folder.name),
                    folder=self._folder.name,
                    relays=True,
                    environment=_environment(),
                    stderr=stderr,
                    read=self._listen,
                    server=server,
                )
        except BaseException:
            self._folder.cleanup()
            raise
        self.send(asdict(replace(order, key=self._key)))

    @property
    def number(self) -> int:
        """Id of the process whose descendants are those of the run."""
        return self._process.pid

    @property
    def is_over(self) -> bool:
        """True if the process has sent its result or an invalid line, or has ended."""
        return self.result is not None or self.made or bool(self.refused or self.invalid) or not self.is_running

    def wait(self, timeout: float) -> bool:
        """Wait until it is over, at most `timeout` [s]; return whether it is."""
        end = time.monotonic() + timeout
        while not self.is_over and time.monotonic() < end:
            time.sleep(0.01)
        return self.is_over

    def stop(self) -> str:
        """End the process and all that it has started; return how it had ended in words, if it had ended before."""
        status = self._process.poll()
        if not self._is_guarded:
            self._kill()
        self.end(_KILL_TIMEOUT)
        self._folder.cleanup()
        return "" if status is None else _ending(status)

    def write_stacks(self, members: Sequence[int]) -> None:
        """Let the program, if it is Python, write to the log where it is; it ends by that.

        Args:
            members: ids of all descendants of the process.
        """
        if sys.platform == "win32":
            return
        programs = [number for number in members if _is_program(number)]
        for number in [*programs, *({self._worker} & set(members))]:
            with suppress(OSError):  # it has just ended
                os.kill(number, signal.SIGABRT)
            self.wait(_STACK_TIMEOUT)

    def machine_fault(self, ending: str) -> str:
        """Return what the machine, or a policy's server, did to the run, in one line; empty if nothing is known.

        Args:
            ending: the value of `stop`.
        """
        if self.result is not None:
            error = self.result.error.strip().rpartition("\n")[2]
            if self.result.outcome == Outcome.INFRASTRUCTURE.name.lower():
                return printable(error, _MAX_REASON)
            return f"the disk is full: {error}" if error.startswith(_DISK_FULL_TEXTS) else ""
        # A program that ends itself must not have its run repeated as if the machine had ended it.
        if self.kills_itself or self.refused or self.invalid or ending not in _OUTSIDE:
            return ""
        return f"{ending} {NO_MEMORY if oom_kills() > self._oom_kills else 'from outside'}"

    def log_size(self) -> int:
        """Return the size of its log [bytes]; 0 if the log was removed."""
        try:
            return self.log.stat().st_size
        except OSError:
            return 0

    def last_lines(self) -> tuple[str, ...]:
        """Return the last lines of its log; none if the log was removed."""
        try:
            with self.log.open("rb") as file:
                file.seek(max(0, self.log_size() - _TAIL_BYTES))
                text = file.read().decode("utf-8", errors="replace")
        except OSError:
            return ()
        return tuple(text.splitlines()[-_TAIL_LINES:])

    def _kill(self) -> None:
        if sys.platform == "win32":
            command = ["taskkill", "/F", "/T", "/PID", str(self.number)]
            # without that program, the processes of the agent are left behind
            with suppress(OSError):
                subprocess.run(command, capture_output=True, check=False)  # noqa: S603 (a number)
            self._process.kill()
        else:
            # no process is left; macOS raises the second
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.number, signal.SIGKILL)

    def _listen(self, output: IO[bytes]) -> None:
        try:
            for message in read_messages(output, self._key):
                self._take(message)
                self._wakes.put(self)
        except ChannelError as error:
            self.invalid = str(error)
        self._wakes.put(self)

    def _take(self, message: Message) -> None:
        if self.result is not None or self.made:
            raise ChannelError("a line follows the result")
        points = [each.points for each in (message.progress, message.result) if each is not None]
        if any(each > self._attainable + POINT_TOLERANCE for each in points):
            raise ChannelError(f"{max(points):g} points, of {self._attainable:g} attainable ones")
        if message.begun is not None:
            self.begun, self._worker = time.monotonic(), message.begun
        self.progress = message.progress or self.progress
        self.scene, self.frame = message.scene or self.scene, message.frame or self.frame
        if message.refused is not None:
            self.refused = printable(message.refused, _MAX_REASON)
        self.kills_itself = self.kills_itself or message.kills is True
        self.made = message.made is True
        self.result = message.result


def _is_program(number: int) -> bool:
    """Return whether a process is that of an agent; its guard is not."""
    try:
        words = Path(f"/proc/{number}/cmdline").read_bytes().split(b"\0")
    except OSError:
        return False
    return words[1:3] == [b"-m", b"cellwright.running.remote.program"]


def _environment() -> dict[str, str]:
    """Return the variables of a worker."""
    # the same order of sets in every process, one thread each for arithmetic, a log that is read as UTF-8
    variables = {"PYTHONHASHSEED": "0", "PYTHONUNBUFFERED": "1", "PYTHONUTF8": "1"}
    variables |= dict.fromkeys(_ONE_THREAD, "1")
    environment = {**variables, **os.environ, "PYTHONIOENCODING": "utf-8"}
    environment.pop(KEY_VARIABLE, None)
    return environment


def _ending(status: int) -> str:
    if status == guard.STOPPED:
        return guard.STOPPED_WORDS
    if status >= 0:
        return f"exit status {status}"
    try:
        return f"killed by {signal.Signals(-status).name}"
    except ValueError:
        return f"killed by signal {-status}"
