"""Tests of the measured memory."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from cellwright.running.evaluation.memory import MEMORY_IS_LIMITED, memory_below


@pytest.mark.skipif(not MEMORY_IS_LIMITED, reason="cannot be seen there")
def test_memory_below_process_includes_children_in_sessions_of_their_own() -> None:
    program = "kept = b'x' * 50_000_000; print(flush=True); input()"
    start = f"[sys.executable, '-c', {program!r}], start_new_session=True"
    command = [sys.executable, "-c", f"import subprocess, sys; subprocess.run({start})"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True) as process:
        assert process.stdout is not None
        process.stdout.readline()
        memory = memory_below([process.pid, os.getpid()])
        assert 50_000_000 < memory[process.pid] < 150_000_000
        assert memory[os.getpid()] > memory[process.pid] + 5_000_000
        process.communicate(b"\n")
    assert memory_below([]) == {}


@pytest.mark.skipif(MEMORY_IS_LIMITED, reason="can be seen here")
def test_memory_is_unknown_where_unsupported() -> None:
    assert not memory_below([os.getpid()])
