"""Worker process of an evaluation: how many at a time, its limits, its start and its end."""

import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import IO, Any

from cellwright.util.process import ChildProcess, own_program


def usable_processors() -> int:
    """How many processors this process may use: a container may have fewer than the machine."""
    allowed = getattr(os, "sched_getaffinity", None)  # on Linux alone
    return os.cpu_count() or 1 if allowed is None else len(allowed(0))


MEBIBYTE = 1 << 20


@dataclass(frozen=True, slots=True)
class Limits:
    """What one run may use at most.

    Attributes:
        wall: time on the wall clock [s].
        memory: memory [bytes] of its process, and of the processes that it has started; held on Linux only.
        log: what it may write to its log [bytes].
    """

    wall: float = 600.0
    memory: int = 2048 * MEBIBYTE
    log: int = 16 * MEBIBYTE


MEMORY_IS_LIMITED = sys.platform == "linux"
"""Whether this system lets the memory of a process be bounded and seen."""


def limit_memory(most: int) -> None:
    """Let this process have no more than `most` bytes of memory: what asks for more gets an error instead."""
    if sys.platform == "linux":
        import resource  # there is none on Windows

        resource.setrlimit(resource.RLIMIT_DATA, (most, most))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def memory_of_sessions() -> Counter[int]:
    """Resident memory [bytes] of every session of processes, by its leader's number; empty where it cannot be seen."""
    total: Counter[int] = Counter()
    if sys.platform == "linux":
        import resource

        page = resource.getpagesize()
        for entry in Path("/proc").iterdir():
            if entry.name.isdigit():
                try:
                    fields = (entry / "stat").read_bytes().rpartition(b")")[2].split()
                except OSError:
                    continue  # it has just ended
                total[int(fields[3])] += int(fields[21]) * page
    return total


_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Workers share the processor among them; a library that takes all of it for itself slows down the others."""

_TAIL = 30  # lines of a log that are told
_TAIL_BYTES = 16384
_KILLED = 5.0  # [s] until one that was killed is gone


@dataclass(frozen=True, slots=True)
class JobOrder:
    """What a worker process has to do; it reaches the process as JSON.

    Attributes:
        wall: time that it may take on the wall clock [s].
        memory: memory that it may have [bytes]; 0: not limited.
        files: those of the trial; none: the agent is only made, and nothing is run.
        record: file for a recording; empty for none.
    """

    agent: str
    wall: float
    memory: int
    files: Sequence[str] = ()
    seed: int = 0
    vary: bool = False
    run_log: str = ""
    record: str = ""


class WorkerProcess(ChildProcess):
    """A process of `cellwright.running.evaluation.worker`.

    Args:
        log: file that takes what it prints.
        wakes: takes this object whenever there is something new to look at.
    """

    def __init__(self, order: JobOrder, log: Path, wakes: SimpleQueue[Any] | None = None) -> None:
        self.log = log
        self.started = time.monotonic()
        self.begun: float | None = None
        self.progress: Mapping[str, Any] = {}
        self.result: Mapping[str, Any] | None = None
        self.refused = ""
        self._wakes: SimpleQueue[Any] = SimpleQueue() if wakes is None else wakes
        with log.open("wb") as stderr:
            command = own_program("cellwright.running.evaluation.worker")
            # the same order of sets in every process, one thread each for arithmetic, a log that is read as UTF-8
            given = {"PYTHONHASHSEED": "0", "PYTHONUNBUFFERED": "1", "PYTHONUTF8": "1"}
            given |= dict.fromkeys(_ONE_THREAD, "1")
            environment = {**given, **os.environ, "PYTHONIOENCODING": "utf-8"}
            super().__init__(command, environment=environment, stderr=stderr, read=self._listen)
        self.send(json.dumps(asdict(order)))

    @property
    def number(self) -> int:
        """The process's number, and that of its session."""
        return self._process.pid

    @property
    def is_over(self) -> bool:
        """Whether it has told its result or has ended."""
        return self.result is not None or bool(self.refused) or not self.is_running

    def wait(self, timeout: float) -> bool:
        """Wait until it is over, at most so long [s]; whether it is."""
        end = time.monotonic() + timeout
        while not self.is_over and time.monotonic() < end:
            time.sleep(0.01)
        return self.is_over

    def stop(self) -> str:
        """End it and all that it has started; how it had ended, in words, if it had by itself."""
        status = self._process.poll()
        self._kill()
        self.end(_KILLED)
        return "" if status is None else _ending(status)

    def log_size(self) -> int:
        """Size of its log [bytes]; 0 for one that somebody has removed."""
        try:
            return self.log.stat().st_size
        except OSError:
            return 0

    def last_lines(self) -> tuple[str, ...]:
        """The last lines of its log; none of one that somebody has removed."""
        try:
            with self.log.open("rb") as file:
                file.seek(max(0, self.log_size() - _TAIL_BYTES))
                text = file.read().decode("utf-8", errors="replace")
        except OSError:
            return ()
        return tuple(text.splitlines()[-_TAIL:])

    def _kill(self) -> None:
        if sys.platform == "win32":
            command = ["taskkill", "/F", "/T", "/PID", str(self.number)]
            with suppress(OSError):  # a system without that program: what the agent has started is left behind
                subprocess.run(command, capture_output=True, check=False)  # noqa: S603 (a number)
            self._process.kill()
        else:
            with suppress(ProcessLookupError, PermissionError):  # nobody is left; macOS says so with the second
                os.killpg(self.number, signal.SIGKILL)

    def _listen(self, output: IO[bytes]) -> None:
        for line in output:
            try:
                told = json.loads(line)
            except ValueError:
                break  # half a line: it was killed while it wrote
            if "begun" in told:
                self.begun = time.monotonic()
            self.progress = told.get("progress", self.progress)
            self.refused = told.get("refused", self.refused)
            self.result = told.get("result", self.result)
            self._wakes.put(self)
        self._wakes.put(self)


def _ending(status: int) -> str:
    if status >= 0:
        return f"exit status {status}"
    try:
        return f"killed by {signal.Signals(-status).name}"
    except ValueError:
        return f"killed by signal {-status}"
