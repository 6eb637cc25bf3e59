"""Policies in `cellwright eval`: latencies are compared, and a server that fails is no result."""

import json
import re
from pathlib import Path

import pytest

from tests.cli.conftest import CommandLine

TRIAL = """\
options: {insert_agvs: true}
time_limit: 0.2
orders:
  order_0: {announcement_condition: time, announcement_condition_value: 0, parts: {a: {type: gear_part, pose: {}}}}
"""


@pytest.mark.slow
def test_each_latency_is_a_row_of_the_report(cellwright: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "short.yaml").write_text(TRIAL)
    ran = cellwright("eval", "short.yaml", "--policy", "hold", "--latency", "0ms", "--latency", "60ms", "--json")
    results = [json.loads(line) for line in (tmp_path / "evaluation/results.jsonl").read_text().splitlines()]
    assert {each["trial"] for each in results} == {"short latency_ms=0", "short latency_ms=60"}
    assert {each["outcome"] for each in results} == {"time_limit"}
    assert ran.status == 1


@pytest.mark.slow
def test_server_that_is_lost_is_repeated_and_left(cellwright: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "short.yaml").write_text(TRIAL)
    ran = cellwright("eval", "short.yaml", "--policy", "ws://127.0.0.1:1")
    assert ran.status == 75
    assert "ws://127.0.0.1:1: cannot be reached" in ran.out
    assert "no result after 3 starts" in ran.err
    folder = tmp_path / "evaluation"
    assert not (folder / "results.jsonl").read_text()
    assert re.search(r"short +1 .*infrastructure, not counted", ran.out)
    found = json.loads((folder / "summary.json").read_text())
    assert (found["runs"], found["share"], found["trials"]) == (0, None, [])
    [lost] = found["infrastructure"]
    assert (lost["trial"], lost["seed"]) == ("short", 1)
    assert "ws://127.0.0.1:1: cannot be reached" in lost["fault"]
    page = (folder / "report.html").read_text()
    assert "1 run lost to the infrastructure, not counted" in page
    assert "short seed 1: ws://127.0.0.1:1: cannot be reached" in page


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--policy", "run.mcap"], "--policy: a recording is one run"),
        (["--policy", "hold", "--agents", "*.py:A"], "--policy: does not go with --agents"),
        (["--policy", "hold", "--policy-map", "none.yaml"], "none.yaml: cannot be read"),
        (["--latency", "1ms"], "--latency requires --policy"),
    ],
)
def test_options_that_do_not_go_together_are_refused(
    arguments: list[str], reason: str, cellwright: CommandLine
) -> None:
    ran = cellwright("eval", "lesson", *arguments)
    assert (ran.status, ran.out) == (2, "")
    assert reason in ran.err
