"""Evaluation of trials with a task: a run passes by the success of its task alone."""

import json
from pathlib import Path

import pytest

from tests.cli.conftest import CommandLine


@pytest.mark.slow
def test_runs_pass_by_success(cellwright: CommandLine, tmp_path: Path) -> None:
    ran = cellwright("eval", "place_on_tray", "--agent", "kitter", "--sweep", "time_limit=1,20", "--json")
    found = json.loads(ran.out)
    rows = {each["trial"]: (each["passed"], each["outcome"], each["points"]) for each in found["results"]}
    assert rows == {
        "place_on_tray time_limit=1": (False, "time_limit", 0.0),
        "place_on_tray time_limit=20": (True, "done", 1.0),
    }
    assert (ran.status, found["passed"], found["share"]) == (1, 1, 0.5)
    assert [each["is_task"] for each in found["trials"]] == [True, True]
    assert "success     50% of the runs" in ran.err
    assert "<span>success rate" in (tmp_path / "evaluation/report.html").read_text()
