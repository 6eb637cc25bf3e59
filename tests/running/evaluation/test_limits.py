"""Tests of the measured memory."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from cellwright.running.evaluation.process import MEMORY_IS_LIMITED, memory_of_sessions


@pytest.mark.skipif(not MEMORY_IS_LIMITED, reason="cannot be seen there")
def test_memory_of_session_includes_child_processes() -> None:
    program = "kept = b'x' * 50_000_000; print(flush=True); input()"
    command = [sys.executable, "-c", f"import subprocess, sys; subprocess.run([sys.executable, '-c', {program!r}])"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True) as process:
        assert process.stdout is not None
        process.stdout.readline()
        memory = memory_of_sessions()
        assert 50_000_000 < memory[process.pid] < 150_000_000
        assert memory[os.getsid(0)] > 10_000_000
        process.communicate(b"\n")


@pytest.mark.skipif(MEMORY_IS_LIMITED, reason="can be seen here")
def test_memory_of_sessions_is_empty_where_unsupported() -> None:
    assert not memory_of_sessions()
