"""Guard: a program leaves no process behind, for any end of it and of its parent."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from cellwright.middleware.wire import guard
from tests.support.processes import name_of
from tests.support.waiting import TIMEOUT, wait_until

GUARD = Path(guard.__file__)

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only there a process can take on orphans")

STUBBORN = "trap '' TERM; echo ready; while :; do sleep 600; done"
HIDES = f'setsid sh -c "{STUBBORN}" & echo $!; kill -STOP $$'


def guarded(folder: Path, *program: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-I", "-S", str(GUARD), "empty", str(folder), *program]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def finish(process: subprocess.Popen[str]) -> tuple[str, str]:
    """Return the output of a process at its end; its stdin stays open until then."""
    assert process.stdout is not None
    assert process.stderr is not None
    said = process.stdout.read(), process.stderr.read()
    process.wait(TIMEOUT)
    return said


def test_guard_ends_with_status_or_signal_of_program(tmp_path: Path) -> None:
    with guarded(tmp_path, "sh", "-c", 'echo "$1"; exit 5', "sh", "two words") as process:
        assert finish(process) == ("two words\n", "")
    assert process.returncode == 5
    with guarded(tmp_path, "sh", "-c", "kill -SEGV $$") as process:
        finish(process)
    assert process.returncode == -signal.SIGSEGV
    assert tmp_path.is_dir()


def test_guard_of_missing_program_names_it(tmp_path: Path) -> None:
    with guarded(tmp_path, "/no/such/program") as process:
        assert finish(process) == ("", "/no/such/program: No such file or directory\n")
    assert process.returncode == 1


def test_guard_forwards_sigterm(tmp_path: Path) -> None:
    with guarded(tmp_path, "sh", "-c", "trap 'exit 7' TERM; echo ready; while :; do sleep 0.01; done") as process:
        assert process.stdout is not None
        process.stdout.readline()
        process.terminate()
        assert process.wait(TIMEOUT) == 7


def test_guard_ends_and_names_processes_left_running(tmp_path: Path) -> None:
    script = f'setsid sh -c "{STUBBORN}" & sleep 0.01; exit 3'
    with guarded(tmp_path, "sh", "-c", script) as process:
        _, err = finish(process)
    assert process.returncode == 3
    assert re.search(r"the agent left (a process|2 processes) running, now ended: .*sh -c", err)


def test_guard_ends_all_descendants_with_parent(tmp_path: Path) -> None:
    """The program is stopped, and its child ignores SIGTERM in a session of its own."""
    folder = tmp_path / "files"
    folder.mkdir()
    with guarded(folder, "sh", "-c", HIDES) as process:
        assert process.stdout is not None
        assert process.stdin is not None
        lines = {process.stdout.readline().strip() for _ in range(2)}
        child = int((lines - {"ready"}).pop())
        process.stdin.close()
        process.wait(TIMEOUT)
    wait_until(lambda: not name_of(child), "end of the child")
    assert not folder.exists()


def test_guard_relays_stdin_and_names_no_leftovers(tmp_path: Path) -> None:
    command = [sys.executable, "-I", "-S", str(GUARD), "relayed", str(tmp_path)]
    script = "read line; echo got $line; sleep 600 & exit 4"
    with subprocess.Popen(
        [*command, "sh", "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None
        process.stdin.write("an order\n")
        process.stdin.flush()
        assert finish(process) == ("got an order\n", "")
    assert process.returncode == 4


@pytest.mark.slow
def test_guard_ends_program_that_stays_stopped_and_not_one_that_goes_on(tmp_path: Path) -> None:
    """The second is stopped twice for a moment; the first for good, with a child that ignores signals."""
    with guarded(tmp_path, "sh", "-c", f'setsid sh -c "{STUBBORN}" & kill -STOP $$') as stopped:
        goes_on = (
            "(sleep 0.3; kill -CONT $$) & kill -STOP $$; echo on; (sleep 0.3; kill -CONT $$) & kill -STOP $$; exit 6"
        )
        with guarded(tmp_path, "sh", "-c", goes_on) as other:
            finish(other)
        assert other.returncode == 6
        _, err = finish(stopped)
    assert stopped.returncode == guard.STOPPED
    assert err == f"{guard.STOPPED_WORDS}\n"
