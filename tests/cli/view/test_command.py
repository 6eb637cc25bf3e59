"""Tests of `cellwright view`: the page opens, and bad input gives one line."""

from __future__ import annotations

import os
import re
import signal
import sys
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from cellwright.viewer.services.scene import ITS_OWN_PAGE
from cellwright.viewer.web.connection import ServerConnection
from tests.cli.conftest import CommandLine
from tests.running.test_serving import serving
from tests.support.quick_children import QUICK_PAGES
from tests.support.waiting import TIMEOUT
from tests.support.warm import WarmProcess, warm_start


@contextmanager
def viewing(folder: Path, *arguments: str) -> Iterator[WarmProcess]:
    """Yield a running `cellwright view` with these arguments; it is killed at the end."""
    command = [sys.executable, "-m", "cellwright", "view", *arguments, "--view-port", "0"]
    process = warm_start().popen(command, folder=folder, environment={**os.environ, "PYTHONUNBUFFERED": "1"})
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def next_line(process: WarmProcess, pattern: str) -> re.Match[str]:
    """Return the match of the next line of output with a pattern."""
    assert process.stdout is not None
    line = process.stdout.readline()
    found = re.fullmatch(pattern, line.rstrip("\n"))
    assert found, line + process.communicate(timeout=TIMEOUT)[1]
    return found


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no such signal there")
def test_viewed_trial_starts_paused_and_accepts_more_viewers(tmp_path: Path) -> None:
    with viewing(tmp_path, "lesson") as process:
        url = next_line(process, r"page: (http://127\.0\.0\.1:\d+/)")[1]
        ready = next_line(process, r"ready: lesson at (127\.0\.0\.1):(\d+), real time")
        with urllib.request.urlopen(url, timeout=TIMEOUT) as answer:
            assert (answer.status, "<html" in answer.read().decode().lower()) == (200, True)
        link = ServerConnection((ready[1], int(ready[2])))
        panel = link.ask("cellwright/panel")
        assert (panel["kind"], panel["development"], panel["clock"]["tick"]) == ("cell", True, 0)
        assert panel["control"]["paused"]
        with viewing(tmp_path, f"{ready[1]}:{ready[2]}") as other:
            assert next_line(other, r"page: (http://127\.0\.0\.1:\d+/)")[1] != url
            other.send_signal(signal.SIGINT)
            assert other.wait(TIMEOUT) == 0
        assert link.ask("cellwright/control", action="resume")["paused"] is False
        link.close()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=TIMEOUT)
    assert (process.returncode, err) == (0, "")
    assert "score       0 of 12 points" in out


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no such signal there")
def test_view_of_served_competition_is_refused(cellwright: CommandLine, tmp_path: Path) -> None:
    with serving(tmp_path, "lesson") as (_, (host, port)):
        ran = cellwright("view", f"{host}:{port}")
    assert (ran.status, ran.out) == (2, "")
    assert ran.err == f"error: {host}:{port}: cannot be shown: {ITS_OWN_PAGE}\n"


@QUICK_PAGES
@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["no_such_trial"], "error: unknown trial 'no_such_trial'"),
        (["no.yaml"], "error: no.yaml: there is no such file"),
        (["no.mcap"], "error: no.mcap: there is no such file"),
        (["127.0.0.1:1"], "error: 127.0.0.1:1: cannot be shown: no server answers"),
        (["lesson", "--view-port", "70000"], "error: --view-port 70000: give a port"),
        (["lesson", "--view-host", "no such host"], "error: page cannot start: no such host: cannot listen"),
    ],
)
def test_invalid_input_prints_one_line(words: list[str], reason: str, cellwright: CommandLine) -> None:
    ran = cellwright("view", *words)
    assert (ran.status, ran.err.count("\n")) == (2, 1)
    assert ran.err.startswith(reason)
    assert "Traceback" not in ran.out
