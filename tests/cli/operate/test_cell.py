"""Tests of `cellwright operate cell`: keys of a terminal move the arm of a run."""

from __future__ import annotations

import json
import os
import sys
from contextlib import closing
from pathlib import Path

import pytest

from cellwright.clients.agents.operator.requests import REPORT
from cellwright.clients.client.client import Client
from tests.cli.conftest import CommandLine
from tests.cli.operate.test_keyboard import Terminal, termios
from tests.support.processes import Process
from tests.support.quick_children import QUICK_PAGES
from tests.support.warm import warm_start


@QUICK_PAGES
@pytest.mark.slow
def test_keys_move_the_arm_and_the_terminal_is_restored(tmp_path: Path) -> None:
    words = ("run", "lesson", "--operator", "--view-port", "0", "--no-picture", "--until", "300")
    run = Process([sys.executable, "-m", "cellwright", *words], os.environ, tmp_path, warm=warm_start())
    try:
        address = run.wait_for(r"^operator: works on the page, and over topics at ([\d.]+:\d+)")[1]
        with closing(Client.connect(address, node="/watcher")) as client:
            report = client.latest(REPORT)
            report.wait()
            height = json.loads(report.message.data)["arms"]["arm"]["joints"]
            terminal = Terminal(address, "cell")
            try:
                terminal.read(lambda: "quit; the arms stay" in terminal.text)
                terminal.type("R")
                assert client.wait_until(
                    lambda: json.loads(report.message.data)["arms"]["arm"]["joints"] != height, 60.0
                )
                terminal.type(" ")
                assert client.wait_until(lambda: json.loads(report.message.data)["stopped"], 60.0)
                terminal.type("\x1b")
                assert terminal.status() == 0
                assert termios.tcgetattr(terminal.other) == terminal.before
            finally:
                terminal.close()
    finally:
        run.kill()


def test_cell_without_terminal_names_the_topics(cellwright: CommandLine) -> None:
    ran = cellwright("operate", "cell")
    assert (ran.status, ran.out) == (2, "")
    assert "requires a terminal; without one publish on the topics /cellwright/operator/" in ran.err
