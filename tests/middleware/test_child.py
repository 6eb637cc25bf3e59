"""Child processes: output, end, and cleanup."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.child import Child, Lines, RestartDelay, describe_exit
from tests.support.processes import is_running
from tests.support.waiting import TIMEOUT, wait_until

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="ROS 1 is not there")


def child(program: str, said: list[str] | None = None, errors: list[str] | None = None) -> Child:
    """Start a child that runs a Python program."""
    return Child(
        [sys.executable, "-c", program],
        os.environ,
        python=sys.executable,
        on_output=None if said is None else said.append,
        on_error=(lambda _line: None) if errors is None else errors.append,
    )


def ended(process: Child) -> int:
    """Wait for its end; return its exit status."""
    wait_until(lambda: process.poll() is not None, "end")
    status = process.poll()
    assert status is not None
    process.stop()
    return status


def test_child_output_is_passed_on_by_line() -> None:
    said: list[str] = []
    errors: list[str] = []
    program = "import sys; print('one\\n\\ntwo'); print('three', file=sys.stderr); sys.exit(3)"
    assert ended(child(program, said, errors)) == 3
    assert said == ["one", "two"]
    assert errors == ["three"]


def test_child_output_is_complete_at_its_end() -> None:
    said: list[str] = []
    assert ended(child("print('x' * 999 + '\\n', end='', flush=True)\nfor n in range(50): print(n)", said)) == 0
    assert said == ["x" * 999, *map(str, range(50))]


def test_child_with_much_output_does_not_block_parent() -> None:
    said: list[str] = []
    process = child("while True: print('x' * 1000)", said)
    wait_until(lambda: process.poll() is None and len(said) > 100, "output")
    for _ in range(20):
        before = len(said)
        assert process.poll() is None  # its output never ends: reading all of it would block
        assert len(said) - before < 1000
    process.stop()
    assert process.poll() == -signal.SIGTERM


@given(st.lists(st.binary(max_size=40), max_size=8))
def test_child_output_in_random_pieces_gives_whole_lines(pieces: list[bytes]) -> None:
    said: list[str] = []
    read, write = os.pipe()
    lines = Lines(read, said.append)
    try:
        for piece in pieces:
            os.write(write, piece)
            lines.read()
    finally:
        os.close(read)
        os.close(write)
    whole = b"".join(pieces).split(b"\n")[:-1]
    texts = [line.decode(errors="replace").rstrip() for line in whole]
    assert said == [text for text in texts if text]


def test_stop_sends_first_signal() -> None:
    said: list[str] = []
    program = """
import signal, sys, time
signal.signal(signal.SIGTERM, lambda *_: sys.exit(7))
print('there', flush=True)
time.sleep(60)  # it shall just live on
"""
    process = child(program, said)
    wait_until(lambda: process.poll() is None and said == ["there"], "start")
    process.stop()
    assert process.poll() == 7


def test_child_that_ignores_signals_is_killed() -> None:
    said: list[str] = []
    program = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); print('there', flush=True)\n"
    process = child(f"{program}time.sleep(60)", said)
    wait_until(lambda: process.poll() is None and said == ["there"], "start")
    process.stop([(signal.SIGTERM, 0.2), (signal.SIGKILL, TIMEOUT)])
    assert process.poll() == -signal.SIGKILL


def test_stop_of_ended_child_has_no_effect() -> None:
    process = child("raise SystemExit(4)")
    assert ended(process) == 4
    process.stop()
    assert process.poll() == 4


def test_child_of_missing_program_is_reported() -> None:
    errors: list[str] = []
    process = Child(["/no/such/program"], os.environ, python=sys.executable, on_error=errors.append)
    assert ended(process) == 1
    assert errors == ["/no/such/program: No such file or directory"]


def test_child_ignores_ctrl_c_of_terminal() -> None:
    process = child("import time; time.sleep(60)")
    assert os.getpgid(process.pid) != os.getpgid(0)
    process.stop()


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel ties no process to its parent")
@pytest.mark.parametrize("is_early", [False, True], ids=["later", "at once"])
def test_child_ends_with_killed_parent(*, is_early: bool) -> None:
    pause = "" if is_early else "time.sleep(0.3)"  # stands for no condition: usually the child is tied by then
    parent = f"""
import os, sys, time
from cellwright.middleware.child import Child
child = Child([sys.executable, '-c', 'import time; time.sleep(60)'], os.environ, python=sys.executable)
{pause}
print(child.pid, flush=True)
os.kill(os.getpid(), 9)
"""
    ran = subprocess.run([sys.executable, "-c", parent], capture_output=True, text=True, timeout=TIMEOUT, check=False)
    assert ran.returncode == -signal.SIGKILL
    pid = int(ran.stdout)
    wait_until(lambda: not is_running(pid), "end of the child")


@pytest.mark.parametrize(
    ("status", "words"), [(0, "ended with status 0"), (75, "ended with status 75"), (-9, "was ended by SIGKILL")]
)
def test_describe_exit_names_status_or_signal(status: int, words: str) -> None:
    assert describe_exit(status) == words
    assert describe_exit(-250) == "was ended by signal 250"


def test_restart_delay_grows_with_repeated_failures() -> None:
    timeout = RestartDelay()
    assert [timeout.after(0.1) for _ in range(8)] == [0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 8.0]
    assert timeout.after(20.0) == 0.0
    assert timeout.after(0.1) == 0.25


@given(st.lists(st.floats(0.0, 100.0), max_size=30))
def test_restart_delay_is_bounded(lives: list[float]) -> None:
    timeout = RestartDelay()
    for lasted in lives:
        wait = timeout.after(lasted)
        assert 0.0 <= wait <= 8.0
        assert wait == 0.0 or lasted < 10.0
