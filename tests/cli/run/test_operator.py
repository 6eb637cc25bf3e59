"""A person in place of an agent, on the command line."""

from __future__ import annotations

import json
import os
import sys
from contextlib import closing
from pathlib import Path

import pytest

from cellwright.clients.agents.operator.requests import COMMAND, REPORT
from cellwright.clients.client.client import Client
from cellwright.middleware.messages.standard import String
from cellwright.middleware.messages.std_srvs import TriggerRequest
from tests.cli.conftest import CommandLine
from tests.support.processes import Process
from tests.support.quick_children import QUICK_PAGES
from tests.support.warm import warm_start


@pytest.mark.parametrize(
    "more", [("--agent", "lesson"), ("--policy", "hold"), ("--over", "socket"), ("--connect", "127.0.0.1:1")]
)
def test_what_does_not_go_with_a_person_is_refused(more: tuple[str, ...], cellwright: CommandLine) -> None:
    ran = cellwright("run", "lesson", "--operator", *more)
    assert ran.status == 2
    assert f"--operator: {more[0]} does not go with it" in ran.err


def test_person_cannot_be_evaluated(cellwright: CommandLine) -> None:
    ran = cellwright("eval", "lesson", "--agent", "operator")
    assert ran.status == 2
    assert "a person works the cell, once; use cellwright run TRIAL --operator" in ran.err


@QUICK_PAGES
def test_run_is_worked_over_topics_and_scored(tmp_path: Path) -> None:
    words = ("run", "lesson", "--operator", "--view-port", "0", "--no-picture", "--json", "--speed", "max")
    run = Process([sys.executable, "-m", "cellwright", *words], os.environ, tmp_path, warm=warm_start())
    try:
        found = run.wait_for(r"^operator: works on the page, and over topics at ([\d.]+:\d+)")
        with closing(Client.connect(found[1], node="/me")) as client:
            report = client.latest(REPORT)
            report.wait()
            assert json.loads(report.message.data)["begun"] is False
            client.publish(COMMAND, String("start"))
            client.wait_until(lambda: client.competition_state == "go")
            client.call("/ariac/end_competition", TriggerRequest())
        assert run.finish() == 0
    finally:
        run.kill()
    assert json.loads(run.out)["agent"] == "operator"
