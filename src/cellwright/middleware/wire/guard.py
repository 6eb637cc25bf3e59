"""Guard of a program: ends it and all its descendants once the process that started the guard is gone.

    python3 guard.py STDIN FOLDER PROGRAM ARGUMENT…

Linux only. The guard ends like the program: same exit status, or same signal. It then kills what the program left
running, and names it on stderr. When stdin ends, because the process at its other end has died or closed it, the guard
kills everything at once, stopped or not, and removes FOLDER. It forwards SIGTERM. STDIN is `empty`, or `relayed`: the
program then reads what the guard does, and what it leaves running is not named. A program that is stopped for ten
seconds is killed: it would never end. This file runs alone, under any Python 3.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import select
import signal
import sys
import time
from collections.abc import Callable, Iterator

_PR_SET_PDEATHSIG, _PR_SET_CHILD_SUBREAPER = 1, 36

_KILLING = 5.0  # time for killed processes to disappear [s]

RELAYED, EMPTY = "relayed", "empty"
STOPPED = 125
"""Exit status after a program that was stopped."""
STOPPED_WORDS = "the program was stopped for 10 s, and has been ended"
_POLL, _MAX_POLLS = 0.1, 100  # [s] and their number; the guard counts, so that its own stops do not matter


def main() -> None:
    """Run the program until it ends, or stdin does."""
    stdin, folder, program = sys.argv[1], sys.argv[2], sys.argv[3:]
    watch(stdin, folder, lambda: _become(program))


def watch(stdin: str, folder: str, begin: Callable[[], object]) -> None:
    """Guard a program until it ends, or stdin does; then exit.

    Args:
        stdin: as above.
        folder: as above.
        begin: becomes the program, or is it; it is called in a process of its own.
    """
    libc = ctypes.CDLL(None)
    # Orphaned descendants of the program come here, even hidden ones.
    libc.prctl(_PR_SET_CHILD_SUBREAPER, 1)
    wake_reader, wake_writer = os.pipe()
    for end in (wake_reader, wake_writer):
        os.set_blocking(end, False)
    signal.signal(signal.SIGCHLD, lambda _number, _frame: None)
    signal.set_wakeup_fd(wake_writer, warn_on_full_buffer=False)
    reader, writer = os.pipe() if stdin == RELAYED else (os.open(os.devnull, os.O_RDONLY), -1)
    child = os.fork()
    if child == 0:
        libc.prctl(_PR_SET_PDEATHSIG, int(signal.SIGKILL))
        signal.set_wakeup_fd(-1)
        os.dup2(reader, 0)
        for end in {reader, writer, wake_reader, wake_writer} - {-1}:
            os.close(end)
        os.setpgid(0, 0)  # a program that signals its own group leaves the guard alone
        for usual in (signal.SIGINT, signal.SIGCHLD):
            signal.signal(usual, signal.SIG_DFL)
        begin()
        sys.exit()
    os.close(reader)
    signal.signal(signal.SIGTERM, lambda number, _frame: os.kill(child, number))
    is_stopped, polls = False, 0
    status: int | None = None
    while status is None:
        ready = select.select([0, wake_reader], [], [], _POLL if is_stopped else None)[0]
        if wake_reader in ready:
            os.read(wake_reader, 4096)
        if 0 in ready:
            text = os.read(0, 4096)
            if not text:
                import shutil  # rarely needed, and slow to import

                kill_descendants()
                shutil.rmtree(folder, ignore_errors=True)
                os._exit(0)
            if writer >= 0:
                with contextlib.suppress(BrokenPipeError):  # the program reads no more
                    os.write(writer, text)
        for found in _changes(child):
            if os.WIFSTOPPED(found) or os.WIFCONTINUED(found):
                is_stopped, polls = os.WIFSTOPPED(found), 0
            else:
                status = found
        if is_stopped and status is None and not ready:
            polls += 1
            if polls == _MAX_POLLS:
                kill_descendants()
                _say(STOPPED_WORDS)
                os._exit(STOPPED)
    left = kill_descendants()
    if left and stdin == EMPTY:
        names = ", ".join(left[:5]) + (f" and {len(left) - 5} more" if len(left) > 5 else "")
        processes = "a process" if len(left) == 1 else f"{len(left)} processes"
        _say(f"the agent left {processes} running, now ended: {names}")
    if os.WIFSIGNALED(status):
        number = os.WTERMSIG(status)
        if number != signal.SIGKILL:
            signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)
    os._exit(os.WEXITSTATUS(status))


def _changes(child: int) -> Iterator[int]:
    """Yield the statuses of the program that have changed; orphans that have ended are cleared away."""
    with contextlib.suppress(ChildProcessError):
        while True:
            ended, found = os.waitpid(-1, os.WNOHANG | os.WUNTRACED | os.WCONTINUED)
            if not ended:
                return
            if ended == child:
                yield found


def _say(line: str) -> None:
    with contextlib.suppress(OSError):
        sys.stderr.write(f"{line}\n")
        sys.stderr.flush()


def _become(program: list[str]) -> None:
    try:
        os.execvp(program[0], program)  # noqa: S606
    except OSError as error:
        sys.stderr.write(f"{program[0]}: {error.strerror}\n")
        sys.stderr.flush()
        os._exit(1)


def kill_descendants(root: int | None = None) -> list[str]:
    """Kill all descendants of a process, by default of this one, until there is none; return their command lines."""
    names: dict[int, str] = {}
    end = time.monotonic() + _KILLING
    while time.monotonic() < end:
        found = _descendants(os.getpid() if root is None else root)
        if not found:
            break
        new = {pid: _name(pid) for pid in found if pid not in names}
        names.update(new)
        for pid in found:
            with contextlib.suppress(OSError):  # it is gone, or another user's
                os.kill(pid, signal.SIGKILL)
        time.sleep(0.002)
        if root is None:
            with contextlib.suppress(ChildProcessError):
                while os.waitpid(-1, os.WNOHANG)[0]:
                    pass
    return list(names.values())


def _descendants(root: int) -> list[int]:
    """Return the running descendants of a process."""
    parents: dict[int, int] = {}
    ended: set[int] = set()
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            try:
                with open(f"/proc/{entry}/stat", "rb") as file:
                    state, parent = file.read().rpartition(b")")[2].split()[:2]
            except (OSError, ValueError):
                continue
            parents[int(entry)] = int(parent)
            if state in (b"Z", b"X"):
                ended.add(int(entry))
    found: list[int] = []
    below = {root}
    while below:
        below = {pid for pid, parent in parents.items() if parent in below}
        found += below - ended
    return found


def _name(pid: int) -> str:
    try:
        with open(f"/proc/{pid}/cmdline", "rb") as file:
            return file.read(200).replace(b"\0", b" ").decode(errors="replace").strip() or str(pid)
    except OSError:
        return str(pid)


if __name__ == "__main__":
    main()
