"""Child processes: their output, and their end."""

from __future__ import annotations

import sys
import tempfile
from io import BytesIO
from typing import IO

import pytest

from cellwright.util.process import ChildProcess, json_lines
from tests.support.waiting import TIMEOUT, wait_until

ECHO = """
import sys
line = sys.stdin.readline()
print('ready', line.strip(), flush=True)
print('something', 'the last', '', sep='\\n', file=sys.stderr, flush=True)
sys.stdin.read()
"""
DEAF = "import sys, time; print('ready', flush=True); time.sleep(600)"


def test_child_gets_lines_and_ends_with_its_stdin() -> None:
    child = ChildProcess([sys.executable, "-c", ECHO], stderr=tempfile.TemporaryFile())  # noqa: SIM115
    child.send({"for": "you"})
    assert child.ready_line(TIMEOUT) == 'ready {"for": "you"}'
    assert child.is_running
    wait_until(lambda: child.last_output() == "the last", "what it wrote to its stderr")
    child.end(TIMEOUT)
    assert child._process.returncode == 0
    assert child.last_output() == "", "its file is closed"


def test_lines_to_ended_process_are_dropped() -> None:
    child = ChildProcess([sys.executable, "-c", ""])
    child._process.wait(TIMEOUT)
    child.send("something")
    assert child.ready_line() == ""
    child.end(0.0)


def test_messages_end_with_half_a_line() -> None:
    assert list(json_lines([b'{"a": 1}\n', b"[2]\n", b'{"b": '])) == [{"a": 1}, [2]]


def test_child_that_ignores_end_of_stdin_is_killed() -> None:
    child = ChildProcess([sys.executable, "-c", DEAF])
    assert child.ready_line() == "ready"
    assert child.ready_line(0.0) == "", "nothing more comes"
    child.end(0.0)
    assert not child.is_running


def test_child_output_is_read_to_the_end() -> None:
    heard = BytesIO()

    def read(output: IO[bytes]) -> None:
        heard.write(output.read())

    child = ChildProcess([sys.executable, "-c", "print('one'); print('two')"], read=read)
    child.end(TIMEOUT)
    assert heard.getvalue().split() == [b"one", b"two"]


def test_missing_program_raises_os_error() -> None:
    log = tempfile.TemporaryFile()  # noqa: SIM115
    with pytest.raises(OSError, match="no-such-program"):
        ChildProcess(["/no-such-program"], stderr=log)
    assert log.closed
