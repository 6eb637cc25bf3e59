"""Guard of a program: ends it and all its descendants once the process that started the guard is gone.

    python3 guard.py FOLDER PROGRAM ARGUMENT…

Linux only. The guard ends like the program: same exit status, or same signal. It then kills what the program left
running, and names it on stdout. When stdin ends, because the process at its other end has died or closed it, the guard
kills everything at once, stopped or not, and removes FOLDER. It forwards SIGTERM. This file runs alone, under any
Python 3.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import select
import signal
import sys
import time

_PR_SET_PDEATHSIG, _PR_SET_CHILD_SUBREAPER = 1, 36

_KILLING = 5.0  # time for killed processes to disappear [s]


def main() -> None:
    """Run the program until it ends, or stdin does."""
    folder, program = sys.argv[1], sys.argv[2:]
    libc = ctypes.CDLL(None)
    libc.prctl(_PR_SET_CHILD_SUBREAPER, 1)  # its orphaned descendants come here, even hidden ones
    wake_reader, wake_writer = os.pipe()
    for end in (wake_reader, wake_writer):
        os.set_blocking(end, False)
    signal.signal(signal.SIGCHLD, lambda _number, _frame: None)
    signal.set_wakeup_fd(wake_writer, warn_on_full_buffer=False)
    child = os.fork()
    if child == 0:
        libc.prctl(_PR_SET_PDEATHSIG, int(signal.SIGKILL))
        _become(program)
    signal.signal(signal.SIGTERM, lambda number, _frame: os.kill(child, number))
    status: int | None = None
    while status is None:
        ready = select.select([0, wake_reader], [], [])[0]
        if wake_reader in ready:
            os.read(wake_reader, 4096)
        if 0 in ready and not os.read(0, 4096):
            import shutil  # rarely needed, and slow to import

            _kill_all()
            shutil.rmtree(folder, ignore_errors=True)
            sys.exit(0)
        ended, found = os.waitpid(child, os.WNOHANG)
        status = found if ended else None
    left = _kill_all()
    if left:
        names = ", ".join(left[:5]) + (f" and {len(left) - 5} more" if len(left) > 5 else "")
        processes = "a process" if len(left) == 1 else f"{len(left)} processes"
        sys.stdout.write(f"the agent left {processes} running, now ended: {names}\n")
        sys.stdout.flush()
    if os.WIFSIGNALED(status):
        number = os.WTERMSIG(status)
        if number != signal.SIGKILL:
            signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)
    sys.exit(os.WEXITSTATUS(status))


def _become(program: list[str]) -> None:
    nowhere = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nowhere, 0)
    signal.set_wakeup_fd(-1)
    for number in (signal.SIGINT, signal.SIGCHLD):
        signal.signal(number, signal.SIG_DFL)
    try:
        os.execvp(program[0], program)  # noqa: S606
    except OSError as error:
        sys.stderr.write(f"{program[0]}: {error.strerror}\n")
        sys.stderr.flush()
        os._exit(1)


def _kill_all() -> list[str]:
    """Kill all descendants until there is none; return their command lines."""
    names: dict[int, str] = {}
    end = time.monotonic() + _KILLING
    while time.monotonic() < end:
        found = _descendants()
        if not found:
            break
        for pid, name in found.items():
            names[pid] = name
            with contextlib.suppress(OSError):  # it is gone, or another user's
                os.kill(pid, signal.SIGKILL)
        time.sleep(0.002)
        with contextlib.suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
    return list(names.values())


def _descendants() -> dict[int, str]:
    """Return the running descendants of this process, with their command lines."""
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
    found: dict[int, str] = {}
    below = {os.getpid()}
    while below:
        below = {pid for pid, parent in parents.items() if parent in below}
        found.update((pid, _name(pid)) for pid in below - ended)
    return found


def _name(pid: int) -> str:
    try:
        with open(f"/proc/{pid}/cmdline", "rb") as file:
            return file.read(200).replace(b"\0", b" ").decode(errors="replace").strip() or str(pid)
    except OSError:
        return str(pid)


if __name__ == "__main__":
    main()
