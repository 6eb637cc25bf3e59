"""Evaluation of trials with a task: a run passes by the success of its task alone."""

import json

import pytest

from tests.cli.conftest import CommandLine


@pytest.mark.slow
def test_runs_pass_by_success(cellwright: CommandLine) -> None:
    ran = cellwright("eval", "pick_from_bin", "place_on_tray", "--agent", "kitter", "--seeds", "1", "--json")
    found = json.loads(ran.out)
    rows = {each["trial"]: (each["passed"], each["outcome"], each["points"]) for each in found["results"]}
    assert rows == {"pick_from_bin": (True, "done", 1.0), "place_on_tray": (False, "task_failed", 0.0)}
    assert (ran.status, found["passed"], found["share"]) == (1, 1, 0.5)
