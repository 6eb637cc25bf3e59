"""Parent watch: a program that ends with its parent."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from cellwright.middleware import wire as link
from tests.support.waiting import TIMEOUT

PARENT_WATCH = Path(link.__file__).with_name("parent_watch.py")

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="a process does not become another one there")


def tied(*program: str, parent: int | None = None) -> subprocess.CompletedProcess[str]:
    """Run a program through the parent watch."""
    command = [
        sys.executable,
        "-I",
        "-S",
        str(PARENT_WATCH),
        str(parent or os.getpid()),
        str(int(signal.SIGKILL)),
        *program,
    ]
    return subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=False)


def test_parent_watch_becomes_program_with_its_arguments() -> None:
    ran = tied("sh", "-c", 'echo "$1"; exit 5', "sh", "two words")
    assert (ran.stdout, ran.stderr, ran.returncode) == ("two words\n", "", 5)


def test_parent_watch_of_missing_program_names_it() -> None:
    ran = tied("/no/such/program")
    assert (ran.stdout, ran.stderr, ran.returncode) == ("", "/no/such/program: No such file or directory\n", 1)


def test_parent_watch_resets_ignored_sigint() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        ran = tied("sh", "-c", "kill -INT $$; echo not reached")
    finally:
        signal.signal(signal.SIGINT, before)
    assert (ran.stdout, ran.returncode) == ("", -signal.SIGINT)


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel ties no process to its parent")
def test_parent_watch_of_ended_parent_starts_nothing() -> None:
    ran = tied("echo", "not reached", parent=1)
    assert (ran.stdout, ran.returncode) == ("", 0)
