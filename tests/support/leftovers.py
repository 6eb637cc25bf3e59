"""Cleanup of a run: the processes of a test carry its mark and end with it, and nothing outlives the run.

A test that passed must have ended its processes; those of a failed test are killed. After all tests the controller of a
run checks again, removes the run's temporary files, and kills processes that earlier runs left when they died.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
import zlib
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest

from tests.support.processes import kill, name_of, restore_signals_in_children, with_variable
from tests.support.waiting import TIMEOUT, wait_until

MARK = "TEST_MARK"
"""Environment variable of every process that a test starts: the run's identity, a space, and the test or fixture."""

_RUN = "TEST_RUN"
_CHECKOUT = f"@{zlib.crc32(os.fsencode(Path(__file__).resolve())):08x}"
"""End of the names of all runs of this checkout: a run leaves those of others alone."""

_FAILED = pytest.StashKey[bool]()
_STARTS = ("subprocess.Popen", "os.fork", "os.forkpty", "os.posix_spawn")


class Starts:
    """Counter of the processes that this one starts: a test that starts none needs no check of the process table."""

    total = 0
    checked = 0

    @classmethod
    def count(cls, event: str, _: tuple[object, ...]) -> None:
        """Audit hook of the interpreter."""
        cls.total += event in _STARTS


def marked(run: str, owner: str | None = None) -> list[int]:
    """Return the processes with the mark of a run; with `owner` those that this test or fixture started."""
    marks = {pid: mark.partition(" ")[::2] for pid, mark in with_variable(MARK).items()}
    return [pid for pid, mark in marks.items() if mark[0] == run and owner in (None, mark[1])]


def identity(pid: int | str) -> str:
    """Return a unique name of a process, from its id and its start; empty if the process is gone."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
    except OSError:
        return ""
    return f"{pid}@{stat.rpartition(')')[2].split()[19]}"


def end_orphans() -> list[str]:
    """Kill the processes of runs of this checkout whose controller is gone; return their command lines."""
    runs = {pid: mark.partition(" ")[0] for pid, mark in with_variable(MARK).items()}
    orphans = [
        pid
        for pid, run in runs.items()
        if run.endswith(_CHECKOUT) and identity(run.partition("@")[0]) + _CHECKOUT != run
    ]
    names = [name_of(pid) for pid in orphans]
    kill(orphans)
    return names


def end_processes(run: str, owner: str, *, failed: bool) -> None:
    """End the processes of a test.

    Args:
        run: identity of the run.
        owner: the test.
        failed: kill them at once; otherwise each must end without help.

    Raises:
        AssertionError: the test passed, and a process of it did not end.
    """

    def names() -> list[str]:
        return [name_of(pid) for pid in marked(run, owner)]

    try:
        if not failed:
            wait_until(lambda: not names(), "end of the processes that the test started", seen=names, timeout=TIMEOUT)
    finally:
        kill(marked(run, owner))


class Controller:
    """Cleanup in the process that runs all tests, or that controls the workers."""

    def __init__(self) -> None:
        self.folder = tempfile.mkdtemp(prefix="cellwright-tests-")
        os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", tempfile.gettempdir())  # kept for the inspection of a failure
        os.environ["TMPDIR"] = tempfile.tempdir = self.folder
        self.run = os.environ[_RUN] = identity(os.getpid()) + _CHECKOUT
        os.environ.pop(MARK, None)  # set by the test that started this run
        self.orphans = end_orphans()
        self.left: list[str] = []

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Check for processes after the workers have ended, and fail the run if a shared fixture has left any."""
        left = marked(self.run)
        self.left = [name_of(pid) for pid in left]
        kill(left)
        shutil.rmtree(self.folder, ignore_errors=True)
        if left and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        for name in self.orphans:
            terminalreporter.write_line(f"left by an earlier run, and killed: {name}")
        for name in self.left:
            terminalreporter.write_line(f"ERROR left at the end of this run, and killed: {name}")


def pytest_configure(config: pytest.Config) -> None:
    sys.addaudithook(Starts.count)
    restore_signals_in_children()
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(Controller(), "leftovers-controller")


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, Any, Any]:
    os.environ[MARK] = f"{os.environ[_RUN]} {item.nodeid}"
    try:
        return (yield)
    finally:
        del os.environ[MARK]


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef: pytest.FixtureDef[Any]) -> Generator[None, Any, Any]:
    """Mark the processes of a shared fixture as its own: they outlive the test that needed it first."""
    mark = os.environ[MARK]
    if fixturedef.scope != "function":
        os.environ[MARK] = f"{os.environ[_RUN]} fixture {fixturedef.argname}"
    try:
        return (yield)
    finally:
        os.environ[MARK] = mark


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    item.stash[_FAILED] = item.stash.get(_FAILED, False) or report.failed
    return report


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_teardown(item: pytest.Item) -> Generator[None, None, None]:
    failed = True
    try:
        yield
        failed = item.stash.get(_FAILED, False)
    finally:
        if Starts.checked != Starts.total:
            Starts.checked = Starts.total
            end_processes(os.environ[_RUN], item.nodeid, failed=failed)
