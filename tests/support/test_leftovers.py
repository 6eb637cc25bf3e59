"""Tests of the cleanup of a run: no process of a test outlives it, even if the run itself fails."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support import leftovers
from tests.support.leftovers import MARK, end_processes, identity, marked
from tests.support.processes import Process, name_of
from tests.support.waiting import wait_until

ROOT = Path(__file__).parents[2]
LEAVES = """
import subprocess, sys

def start():
    program = "print('here', flush=True); import time; time.sleep(600)"  # lives until it is killed
    child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, start_new_session=True)
    child.stdout.readline()
    open({pids!r}, "a").write(f"{{child.pid}}\\n")
    return child

def test_that_fails():
    start()
    assert False, "as it should"

def test_that_passes():
    start().kill()
"""
PLUGINS = ["-p", "tests.support.leftovers", "-p", "no:cacheprovider", "-p", "no:xdist"]


def run_in(folder: Path, *arguments: str) -> Process:
    """Run pytest as a separate run, on the tests in a folder."""
    command = [sys.executable, "-m", "pytest", "--rootdir", str(folder), *PLUGINS, *arguments, str(folder)]
    return Process(command, {**os.environ, "PYTHONPATH": str(ROOT)}, folder)


def started(run: str, owner: str) -> subprocess.Popen[bytes]:
    """Start a process with a mark, which can be read a moment after its start."""
    child = subprocess.Popen(["sleep", "600"], env={**os.environ, MARK: f"{run} {owner}"})
    wait_until(lambda: child.pid in marked(run, owner), "the mark of the process")
    return child


@pytest.mark.slow
def test_failed_test_leaves_no_process(tmp_path: Path) -> None:
    pids = tmp_path / "pids"
    (tmp_path / "test_leaves.py").write_text(LEAVES.format(pids=str(pids)))
    ran = run_in(tmp_path)
    assert ran.finish() == 1
    assert "1 failed, 1 passed" in ran.out
    for pid in pids.read_text().split():
        wait_until(lambda pid=pid: not name_of(int(pid)), f"end of process {pid}")  # type: ignore[misc]


def test_passed_test_that_leaves_process_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = identity(os.getpid())  # as of a run that goes on: another worker may look for orphans at any time
    child = started(run, "test_x")
    monkeypatch.setattr(leftovers, "TIMEOUT", 0.2)
    with pytest.raises(AssertionError, match=r"no end of the processes(?s:.*)sleep 600"):
        end_processes(run, "test_x", failed=False)
    assert child.wait() == -signal.SIGKILL


def test_processes_of_others_are_not_ended() -> None:
    run = identity(os.getpid())
    child = started(run, "fixture browser")
    end_processes(run, "test_x", failed=True)
    assert child.poll() is None
    assert marked(run) == marked(run, "fixture browser") == [child.pid]
    child.kill()
    child.wait()


@pytest.mark.slow
def test_killed_run_is_cleaned_up_by_next_run(tmp_path: Path) -> None:
    pids = tmp_path / "pids"
    (tmp_path / "test_leaves.py").write_text(LEAVES.format(pids=str(pids)) + "    start().wait()\n")
    first = run_in(tmp_path, "-k", "passes")
    wait_until(lambda: pids.exists() and len(pids.read_text().splitlines()) == 2, "child that lives on")
    first.signal(signal.SIGKILL)
    assert first.finish() == -signal.SIGKILL
    child = int(pids.read_text().split()[1])
    assert name_of(child)
    second = run_in(tmp_path, "-k", "nothing")
    assert second.finish() == pytest.ExitCode.NO_TESTS_COLLECTED, second.out + second.err
    wait_until(lambda: not name_of(child), "end of the child")


def test_identity_distinguishes_processes() -> None:
    mine = identity(os.getpid())
    assert mine.startswith(f"{os.getpid()}@")
    assert identity(os.getpid()) == mine != identity(1)
    assert identity(0) == ""
