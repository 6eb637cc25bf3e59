"""Tests of the points in the output of `run`: as text, as JSON, in a log, and as scored in the finals."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from cellwright.cell.kitting.kit_score import Fit, KitScore, PartFinding, Verdict
from cellwright.cell.kitting.scorer import Averages, GameScore, OrderScore
from cellwright.cli.run.command import finals_score
from cellwright.config.sensors import SensorConfig
from cellwright.config.trial.trial import Trial
from cellwright.util.files import read_json_lines
from cellwright.util.pose import Pose
from tests.cli.conftest import CommandLine

GIVES_UP = ("run", "lesson", "--agent", "agents.py:GivesUp", "--no-picture")


def test_lesson_has_8_of_12_reachable_points(cellwright: CommandLine, agents: str) -> None:
    assert agents == "agents.py"
    ran = cellwright(*GIVES_UP)
    assert "order_0, kit order_0_kit_0: not submitted, no points" in ran.out
    assert ran.out.count("not submitted\n") == 4
    assert "reachable   8 of 12: see out of reach" in ran.out
    assert "out of reach: 4 of 4 places lie 0.48 to 0.49 m off the tray" in ran.out
    assert "sensors     cost 1300 $" in ran.out
    assert "finals" not in ran.out
    score = json.loads(cellwright(*GIVES_UP, "--json").out)["score"]
    assert (score["total"], score["reachable"], score["best"], score["trial_score"]) == (0.0, 8.0, 12.0, None)
    assert "at most 8 of 12 points are attainable" in score["reachable_reason"]
    assert [part["cause"] for part in score["orders"][0]["kits"][0]["parts"]] == ["not submitted"] * 4


@pytest.mark.usefixtures("agents")
def test_averages_print_finals_score(cellwright: CommandLine) -> None:
    ran = cellwright(*GIVES_UP, "--averages", "1300,100")
    assert "finals      0.00 = cost 0.00 (factor 1.00) + order_0 0.00 (time 0.00)" in ran.out
    score = json.loads(cellwright(*GIVES_UP, "--averages", "2600,100", "--json").out)["score"]["trial_score"]
    assert (score["cost_factor"], score["total"]) == (5.0, 0.0)


@pytest.mark.usefixtures("agents")
def test_log_contains_agent_seed_and_outcome(cellwright: CommandLine, tmp_path: Path) -> None:
    plain = json.loads(cellwright(*GIVES_UP, "--json").out)
    ran = cellwright(*GIVES_UP, "--log", "a.jsonl", "--json")
    assert json.loads(ran.out)["state_hash"] == plain["state_hash"]
    first, *_, last = read_json_lines(tmp_path / "a.jsonl")
    assert (first["kind"], first["trial"], first["agent"], first["seed"]) == ("run", "lesson", "agents.py:GivesUp", 0)
    assert (last["kind"], last["outcome"], last["state_hash"]) == ("result", "gave_up", plain["state_hash"])
    assert last["score"]["reachable"] == 8.0


@pytest.mark.slow
@pytest.mark.usefixtures("agents")
def test_varied_run_is_marked_and_differs_by_seed(cellwright: CommandLine) -> None:
    assert cellwright(*GIVES_UP, "--vary").out.startswith("trial lesson, varied, agent agents.py:GivesUp, seed 0")
    documents = [json.loads(cellwright(*GIVES_UP, "--json", *more).out) for more in VARIED]
    plain, first, again, _ = documents
    assert plain["circumstances"] == {"friction": 1.0, "belt_delay": 0.0, "gripper_phase": None, "seed": None}
    assert first["circumstances"]["seed"] == 1
    assert first["state_hash"] == again["state_hash"]
    assert len({each["state_hash"] for each in documents}) == 3


VARIED = ((), ("--vary", "--seed", "1"), ("--vary", "--seed", "1"), ("--vary", "--seed", "2"))


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--log", "a.txt", "--log a.txt: give a file whose name ends in .jsonl"),
        ("--log", "no/a.jsonl", "--log no/a.jsonl: there is no folder no"),
        ("--averages", "1300", "--averages 1300: each order needs an average time (got 1 orders and 0 times)"),
        ("--averages", "1300,x", "--averages 1300,x: an average must be finite and above 0 (got nan)"),
        ("--averages", "0,100", "--averages 0,100: an average must be finite and above 0 (got 0.0)"),
    ],
)
@pytest.mark.usefixtures("agents")
def test_invalid_log_or_averages_are_refused(option: str, value: str, message: str, cellwright: CommandLine) -> None:
    ran = cellwright(*GIVES_UP, option, value)
    assert (ran.status, ran.out, ran.err) == (2, "", f"error: {message}\n")


def test_finals_score_of_points_in_zero_time_is_missing_with_warning(capsys: pytest.CaptureFixture[str]) -> None:
    placed = PartFinding("gear_part", Pose(), Verdict.PLACED, Fit("bin5|gear_part_1", 0.0, 1.0, 0.0))
    order = OrderScore("order_0", (KitScore("order_0_kit_0", is_submitted=True, parts=(placed,)),))
    trial = Trial("t", sensors=(SensorConfig("a", "break_beam", Pose()),))
    assert finals_score(trial, GameScore((order,)), Averages(100.0, (1.0,))) is None
    assert (
        capsys.readouterr().err
        == "warning: the trial has no finals score: order 'order_0' earned 3.0 points in 0.0 s\n"
    )
    timed = replace(order, time_taken=10**9)
    found = finals_score(trial, GameScore((timed,)), Averages(100.0, (1.0,)))
    assert found is not None
    assert found.total == 4.5
