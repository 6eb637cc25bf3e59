"""Report of a test run besides its results: skipped groups, started processes, and commands that repeat a failure."""

from __future__ import annotations

import os
import shlex
import sys
from collections import Counter
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest

from tests.support.leftovers import MARK
from tests.support.required import MARKERS, reason_to_skip
from tests.support.warm import FORK

_FORKED = "forked Python"
_KINDS = ("Python", _FORKED, "ROS 1 master", "page", "browser", "other program")
_COUNTS = pytest.StashKey[Counter[str]]()


def kind_of(command: list[str]) -> str:
    """Return the kind of program of a command; Cellwright with a page counts as a page."""
    words = [Path(word).name for word in command]
    if {"roscore", "rosmaster"} & set(words[:2]):
        return "ROS 1 master"
    if "--view" in words or words[1:4] == ["-m", "cellwright", "view"]:
        return "page"
    if words[0].startswith("python"):
        return "Python"
    return "browser" if words[0] == "node" else "other program"  # a driver under Node starts the browser


def pytest_report_header() -> list[str]:
    """Return the lines about the tests that cannot run here, with the reasons."""
    reasons = {marker: reason_to_skip(marker) for marker in MARKERS}
    lines = [f"tests marked {marker}: skipped, {reason}" for marker, reason in reasons.items() if reason]
    return lines or [f"tests marked {', '.join(MARKERS)}: all can run"]


def pytest_configure(config: pytest.Config) -> None:
    counts: Counter[str] = Counter()
    config.stash[_COUNTS] = counts

    def count(event: str, arguments: tuple[Any, ...]) -> None:
        if event == FORK:
            kind = kind_of(["python", *arguments[0]])
            counts[_FORKED if kind == "Python" else kind] += 1
        elif event == "subprocess.Popen" and MARK in os.environ:  # not the workers that run the tests
            command = arguments[1]
            counts[kind_of([command] if isinstance(command, str) else [str(word) for word in command])] += 1

    sys.addaudithook(count)


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """Pass the counts of an xdist worker to the controller."""
    counts: Counter[str] = node.config.stash[_COUNTS]
    counts.update(getattr(node, "workeroutput", {}).get("starts", {}))


def pytest_sessionfinish(session: pytest.Session) -> None:
    if (output := getattr(session.config, "workeroutput", None)) is not None:
        counts = session.config.stash[_COUNTS]
        output["starts"] = dict(counts)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> Generator[None, None, None]:
    """Print after the summary of pytest itself."""
    yield
    counts = config.stash[_COUNTS]
    starts = ", ".join(f"{counts[kind]} {kind}" for kind in _KINDS)
    terminalreporter.write_line(f"starts by tests, without what those start in turn: {starts}")
    red = [report for kind in ("failed", "error") for report in terminalreporter.stats.get(kind, [])]
    if red:
        terminalreporter.section(f"{len(red)} red, each with the command that runs it alone")
    for report in red:
        crash = getattr(report.longrepr, "reprcrash", None)
        words = (crash.message if crash else report.longreprtext).strip().splitlines() or [""]
        terminalreporter.write_line(report.nodeid)
        terminalreporter.write_line(f"    {words[0][:200]}")
        terminalreporter.write_line(f"    .venv/bin/pytest {shlex.quote(report.nodeid)}")
