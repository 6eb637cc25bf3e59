"""Worker process of an evaluation: its start, its limits and its end, and the number of processors."""

import errno
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
    """Return the number of processors that this process may use: a container may have fewer than the machine."""
    allowed = getattr(os, "sched_getaffinity", None)  # Linux only
    return os.cpu_count() or 1 if allowed is None else len(allowed(0))


MEBIBYTE = 1 << 20


@dataclass(frozen=True, slots=True)
class RunLimits:
    """Limits of one run.

    Attributes:
        wall: wall time [s].
        memory: memory [bytes] of its process and of the processes that it has started; enforced on Linux only.
        log: size of its log [bytes].
    """

    wall: float = 600.0
    memory: int = 2048 * MEBIBYTE
    log: int = 16 * MEBIBYTE


MEMORY_IS_LIMITED = sys.platform == "linux"
"""True if this system can limit and report the memory of a process."""


def limit_memory(max_bytes: int) -> None:
    """Limit the memory of this process to `max_bytes`: an allocation beyond that raises an error."""
    if sys.platform == "linux":
        import resource  # not on Windows

        resource.setrlimit(resource.RLIMIT_DATA, (max_bytes, max_bytes))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def memory_of_sessions() -> Counter[int]:
    """Return the resident memory [bytes] of every session of processes, by its leader's id; empty where unknown."""
    total: Counter[int] = Counter()
    if sys.platform == "linux":
        import resource

        page = resource.getpagesize()
        for entry in Path("/proc").iterdir():
            if entry.name.isdigit():
                try:
                    fields = (entry / "stat").read_bytes().rpartition(b")")[2].split()
                except OSError:
                    continue  # the process has just ended
                total[int(fields[3])] += int(fields[21]) * page
    return total


def oom_kills() -> int:
    """Return how many processes the kernel of this machine has killed so far for want of memory; 0 where unknown."""
    with suppress(OSError, ValueError):
        for line in Path("/proc/vmstat").read_text(encoding="ascii").splitlines():
            if line.startswith("oom_kill "):
                return int(line.split()[1])
    return 0


_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Variables that limit numerical libraries to one thread each: workers share the processor among them."""

_TAIL_LINES = 30  # lines of a log that a result holds
_TAIL_BYTES = 16384
_KILL_TIMEOUT = 5.0  # [s] that a killed process may take to end
NO_MEMORY = "while the machine had no memory left"
"""End of the fault of a run that the kernel, most likely, has killed for want of memory."""

_OUTSIDE = frozenset(f"killed by {name}" for name in ("SIGKILL", "SIGTERM"))  # what a machine ends processes with
DISK_FULL = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))
"""Errors of a file when the disk, or the user's part of it, is full."""

_DISK_FULL_TEXTS = tuple(f"OSError: [Errno {number}]" for number in DISK_FULL)


@dataclass(frozen=True, slots=True)
class JobOrder:
    """Order for a worker process, which receives it as JSON.

    Attributes:
        wall: limit of wall time [s].
        memory: limit of memory [bytes]; 0: unlimited.
        files: files of the trial; none: the agent is only made, and nothing is run.
        overrides: values that replace those of the files, as `KEY=VALUE`.
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
    overrides: Sequence[str] = ()


class WorkerProcess(ChildProcess):
    """A process of `cellwright.running.evaluation.worker`.

    Args:
        log: file for its output.
        wakes: receives this object whenever its state has changed.
    """

    def __init__(self, order: JobOrder, log: Path, wakes: SimpleQueue[Any] | None = None) -> None:
        self.log = log
        self.started = time.monotonic()
        self.begun: float | None = None
        self.progress: Mapping[str, Any] = {}
        self.scene = self.frame = ""
        """Its scene and its newest state, as a `StateReporter` sends them."""
        self.result: Mapping[str, Any] | None = None
        self.refused = ""
        self.kills_itself = False
        """True if the program has sent its own process SIGKILL or SIGTERM."""
        self._oom_kills = oom_kills()
        self._wakes: SimpleQueue[Any] = SimpleQueue() if wakes is None else wakes
        with log.open("wb") as stderr:
            command = own_program("cellwright.running.evaluation.worker")
            # the same order of sets in every process, one thread each for arithmetic, a log that is read as UTF-8
            variables = {"PYTHONHASHSEED": "0", "PYTHONUNBUFFERED": "1", "PYTHONUTF8": "1"}
            variables |= dict.fromkeys(_ONE_THREAD, "1")
            environment = {**variables, **os.environ, "PYTHONIOENCODING": "utf-8"}
            super().__init__(command, environment=environment, stderr=stderr, read=self._listen)
        self.send(json.dumps(asdict(order)))

    @property
    def number(self) -> int:
        """Id of the process, which is the id of its session too."""
        return self._process.pid

    @property
    def is_over(self) -> bool:
        """True if the process has sent its result or has ended."""
        return self.result is not None or bool(self.refused) or not self.is_running

    def wait(self, timeout: float) -> bool:
        """Wait until it is over, at most `timeout` [s]; return whether it is."""
        end = time.monotonic() + timeout
        while not self.is_over and time.monotonic() < end:
            time.sleep(0.01)
        return self.is_over

    def stop(self) -> str:
        """End the process and all that it has started; return how it had ended in words, if it had ended before."""
        status = self._process.poll()
        self._kill()
        self.end(_KILL_TIMEOUT)
        return "" if status is None else _ending(status)

    def machine_fault(self, ending: str) -> str:
        """Return what the machine did to the run, in one line; empty if nothing is known.

        Args:
            ending: what `stop` returned.
        """
        if self.result is not None:
            error = self.result.get("error", "").strip().rpartition("\n")[2]
            return f"the disk is full: {error}" if error.startswith(_DISK_FULL_TEXTS) else ""
        if self.kills_itself or self.refused or ending not in _OUTSIDE:
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
            with suppress(OSError):  # without that program, the processes of the agent are left behind
                subprocess.run(command, capture_output=True, check=False)  # noqa: S603 (a number)
            self._process.kill()
        else:
            with suppress(ProcessLookupError, PermissionError):  # no process is left; macOS raises the second
                os.killpg(self.number, signal.SIGKILL)

    def _listen(self, output: IO[bytes]) -> None:
        for line in output:
            try:
                report = json.loads(line)
            except ValueError:
                break  # half a line: the process was killed while it wrote
            if "begun" in report:
                self.begun = time.monotonic()
            self.progress = report.get("progress", self.progress)
            self.scene, self.frame = report.get("scene", self.scene), report.get("frame", self.frame)
            self.refused = report.get("refused", self.refused)
            self.kills_itself = report.get("kills", self.kills_itself)
            self.result = report.get("result", self.result)
            self._wakes.put(self)
        self._wakes.put(self)


def _ending(status: int) -> str:
    if status >= 0:
        return f"exit status {status}"
    try:
        return f"killed by {signal.Signals(-status).name}"
    except ValueError:
        return f"killed by signal {-status}"
