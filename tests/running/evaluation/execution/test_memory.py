"""Tests of the measured memory."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from cellwright.running.evaluation.execution.memory import MEMORY_IS_LIMITED, OwnTime, Usage, usage_below
from tests.support.waiting import wait_until


@pytest.mark.skipif(not MEMORY_IS_LIMITED, reason="cannot be seen there")
def test_memory_below_process_includes_children_in_sessions_of_their_own() -> None:
    program = "kept = b'x' * 50_000_000; print(flush=True); input()"
    start = f"[sys.executable, '-c', {program!r}], start_new_session=True"
    command = [sys.executable, "-c", f"import subprocess, sys; subprocess.run({start})"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True) as process:
        assert process.stdout is not None
        process.stdout.readline()
        memory = usage_below([process.pid, os.getpid()])
        assert 50_000_000 < memory[process.pid].memory < 150_000_000
        assert memory[os.getpid()].memory > memory[process.pid].memory + 5_000_000
        process.communicate(b"\n")
    assert usage_below([]) == {}


@pytest.mark.skipif(MEMORY_IS_LIMITED, reason="can be seen here")
def test_memory_is_unknown_where_unsupported() -> None:
    assert not usage_below([os.getpid()])


def test_own_time_leaves_out_what_the_machine_kept_from_working() -> None:
    clock = OwnTime(0.0, Usage(processor=5.0))
    assert clock.take(10.0, Usage(processor=5.5, is_held_up=True)) == 0.5
    assert clock.take(12.0, Usage(processor=5.5)) == 2.5
    assert clock.take(13.0, Usage(processor=9.5, is_held_up=True)) == 3.5  # four threads at once
    assert clock.take(14.0, Usage(processor=0.0, is_held_up=True)) == 3.5  # a child has ended unseen


@pytest.mark.skipif(not MEMORY_IS_LIMITED, reason="cannot be seen there")
def test_usage_knows_who_computes_in_any_thread_and_who_sleeps() -> None:
    spin = "import threading; threading.Thread(target=lambda: [None for _ in iter(int, 1)], daemon=True).start()"
    for work, is_held_up in ((spin, True), ("pass", False)):
        program = f"{work}; print(flush=True); input()"
        command = [sys.executable, "-c", f"import subprocess, sys; subprocess.run([sys.executable, '-c', {program!r}])"]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
            assert process.stdout is not None
            process.stdout.readline()
            number = process.pid
            wait_until(lambda: usage_below([number])[number].is_held_up is is_held_up, "its work is known")  # noqa: B023
            process.communicate(b"\n")
