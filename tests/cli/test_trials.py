"""Tests of the list of bundled trials, and of running them."""

import json
import shlex
from pathlib import Path
from typing import Any

import pytest

from cellwright.config.trial.catalogue import bundled, bundled_tasks
from tests.cli.conftest import CommandLine


@pytest.fixture
def listed(cellwright: CommandLine) -> dict[str, Any]:
    ran = cellwright("trials", "--json")
    assert (ran.status, ran.err) == (0, "")
    return dict(json.loads(ran.out))


def of(listed: dict[str, Any], name: str) -> dict[str, Any]:
    (found,) = [trial for trial in listed["trials"] if trial["name"] == name]
    return dict(found)


def test_json_lists_all_bundled_trials(listed: dict[str, Any]) -> None:
    assert [trial["name"] for trial in listed["trials"]] == [*bundled(), *bundled_tasks()]
    assert len(bundled()) == 29


def test_json_has_the_sentence_of_a_task(listed: dict[str, Any]) -> None:
    task = of(listed, "pick_from_bin")
    assert (task["scenario"], task["task"]) == ("task", "Pick up a gear from the bin.")
    assert of(listed, "lesson")["task"] is None


def test_json_has_scenario_of_each_final(listed: dict[str, Any]) -> None:
    scenarios = [trial["scenario"] for trial in listed["trials"] if trial["name"].startswith("final")]
    assert scenarios == (["final, baseline"] * 5 + ["final, dropped part"] * 5 + ["final, in-process kit change"] * 5)


def test_json_describes_a_final(listed: dict[str, Any]) -> None:
    final = of(listed, "final14")
    assert final["time_limit"] == 500
    assert not final["has_arm"]
    assert final["points"] == 24
    assert final["orders"][0]["parts"] == {"disk_part": 1, "piston_rod_part": 2, "pulley_part": 1}
    assert final["orders"][1]["wanted_parts"] == 3
    assert [demand["kind"] for demand in final["demands"]] == ["interrupt", "belt_only"]
    assert of(listed, "lesson")["time_limit"] is None


def test_json_lists_sensor_files_with_cost(listed: dict[str, Any]) -> None:
    (kitter,) = listed["sensors"]
    kinds = list(kitter["sensors"].values())
    assert kitter["name"] == "kitter_sensors"
    assert kitter["has_arm"]
    assert kitter["sensor_cost"] == 500 * kinds.count("logical_camera") + 100 * (
        len(kinds) - kinds.count("logical_camera")
    )


@pytest.mark.slow
def test_table_lists_orders_and_difficulties(cellwright: CommandLine) -> None:
    ran = cellwright("trials")
    lines = [line.rstrip() for line in ran.out.splitlines()]
    assert (ran.status, ran.err) == (0, "")
    assert max(map(len, lines)) <= 80
    assert "2 x (1 pulley_part, 1 gear_part, 1 disk_part)" in ran.out
    assert "- pulley_part dropped over AGV 1, onto the tray" in ran.out
    assert lines[-1].startswith("kitter_sensors: an arm, ")


def test_bundled_agent_on_trial_without_arm_is_refused_with_remedy(cellwright: CommandLine) -> None:
    ran = cellwright("run", "final01", "--agent", "lesson")
    assert (ran.status, ran.out) == (2, "")
    assert ran.err == (
        "error: final01: the trial has no arm, and agent lesson requires one; "
        "add a file with one, such as: cellwright run final01+kitter_sensors\n"
    )


def test_own_agent_on_trial_without_arm_gets_warning(cellwright: CommandLine, agents: str) -> None:
    ran = cellwright("run", "final01", "--agent", f"{agents}:Ends", "--no-picture")
    assert ran.status == 0
    assert ran.err.startswith("warning: final01: the trial has no arm; add a file")


@pytest.mark.parametrize("names", [("final01+kitter_sensors",), ("final01", "kitter_sensors")])
def test_final_with_bundled_sensors_runs(names: tuple[str, ...], cellwright: CommandLine, agents: str) -> None:
    ran = cellwright("run", *names, "--agent", f"{agents}:Ends", "--no-picture", "--json")
    assert ran.status == 0
    assert "warning" not in ran.err
    assert json.loads(ran.out)["trial"] == "final01"


def test_remedy_for_trial_without_arm_names_command_that_works(
    cellwright: CommandLine, tmp_path: Path, agents: str
) -> None:
    (tmp_path / "my trial.yaml").write_text("time_limit: 60\n")
    ran = cellwright("run", "my trial.yaml")
    assert ran.err.endswith("add a file with one, such as: cellwright run 'my trial.yaml+kitter_sensors'\n")
    command = ran.err.partition("such as: cellwright ")[2]
    ran = cellwright(*shlex.split(command), "--agent", f"{agents}:Ends", "--no-picture")
    assert (ran.status, ran.err) == (3, "")  # it has no order


@pytest.mark.parametrize("content", ["{}", "time_limit: 60"])
def test_remedy_for_text_that_no_file_continues_names_the_entry(
    cellwright: CommandLine, tmp_path: Path, content: str
) -> None:
    (tmp_path / "e.yaml").write_text(content)
    ran = cellwright("run", "e.yaml")
    assert ran.status == 2
    assert ran.err.endswith("; add one to the file, such as `arm: {type: ur10}`, and sensors\n")
