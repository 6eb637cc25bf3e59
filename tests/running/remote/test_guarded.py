"""Tests of a guarded program: what it starts ends with it."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from typing import IO

import pytest

from cellwright.running.remote.guarded import GuardedProcess
from tests.support.waiting import wait_until

STARTS = """
import subprocess, sys
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"], start_new_session=True)
print(child.pid, flush=True)
sys.stdin.read()
"""


def reader(lines: list[str]) -> Callable[[IO[bytes]], None]:
    def read(output: IO[bytes]) -> None:
        with output:
            lines.extend(line.decode() for line in iter(output.readline, b""))

    return read


def runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.skipif(sys.platform != "linux", reason="has no guard elsewhere")
def test_detached_child_ends_with_its_program() -> None:
    lines: list[str] = []
    process = GuardedProcess(
        [sys.executable, "-c", STARTS], relays=True, environment=dict(os.environ), stderr=2, read=reader(lines)
    )
    try:
        wait_until(lambda: bool(lines), "the number of the child")
        states = [process.is_running]
        assert runs(int(lines[0]))
    finally:
        process.end(10.0)
    assert [*states, process.is_running] == [True, False]
    wait_until(lambda: not runs(int(lines[0])), "the end of the child")
