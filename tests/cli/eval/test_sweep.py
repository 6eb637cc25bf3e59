"""Tests of `cellwright eval --sweep`, from its values to runs that repeat each of its own."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.cli.conftest import CommandLine
from tests.running.evaluation.programs import TRIAL
from tests.support.quick_children import QUICK_WORKERS

KEY = "models_to_spawn.agv1::kit_tray_1::kit_tray_1::tray.models.one.pose.xyz[0]"
DELIVER = """
class Deliver:
    def run(self, client):
        client.start_competition()
        client.sleep(1.1)
        client.control_agv(1, "order_0_kit_0")
"""
WORK = ("eval", "tiny.yaml", "--agent", "programs.py:Deliver", "--jobs", "1")


@pytest.fixture
def tiny(cellwright: CommandLine) -> CommandLine:
    Path("tiny.yaml").write_text(TRIAL, encoding="utf-8")
    Path("programs.py").write_text(DELIVER, encoding="utf-8")
    return cellwright


@QUICK_WORKERS
@pytest.mark.slow
def test_each_value_is_a_trial_that_its_recording_its_command_and_a_file_repeat(tiny: CommandLine) -> None:
    ran = tiny(*WORK, "--sweep", f"{KEY}=0.1,0.05", "--record", "--json")
    assert ran.status == 0
    names = [f"tiny {KEY}=0.1", f"tiny {KEY}=0.05"]
    document = json.loads(ran.out)
    assert [(each["trial"], each["overrides"]) for each in document["trials"]] == [
        (names[0], {KEY: "0.1"}),
        (names[1], {KEY: "0.05"}),
    ]
    assert [each["points"] for each in document["results"]] == [6.0, 5.0]
    cases = ElementTree.parse("evaluation/junit.xml").getroot().iter("testcase")
    assert [case.get("classname") for case in cases] == names
    plan = json.loads(Path("evaluation", "plan.json").read_text(encoding="utf-8"))
    assert [run["trial"] for run in plan["runs"]] == names
    report = Path("evaluation", "report.html").read_text(encoding="utf-8")
    assert f"<h2>Share of the attainable points against {KEY}</h2>" in report

    second = document["results"][1]
    recordings = sorted(Path("evaluation", "recordings").iterdir())
    assert len(recordings) == 2
    for recording in recordings:
        verified = tiny("replay", str(recording), "--verify")
        assert (verified.status, "equal       up to tick" in verified.out) == (0, True)
    program, *words = shlex.split(second["command"])
    assert program == "cellwright"
    alone = json.loads(tiny(*words, "--no-picture", "--json").out)
    Path("written.yaml").write_text(TRIAL.replace("xyz: [0.1, 0.1, 0.006]", "xyz: [0.05, 0.1, 0.006]"))
    words[words.index("--set") : words.index("--set") + 2] = []
    words = [word.replace("tiny.yaml", "written.yaml") for word in words]
    written = json.loads(tiny(*words, "--no-picture", "--json").out)
    assert (alone["overrides"], written["overrides"]) == ([f"{KEY}=0.05"], [])
    assert alone["state_hash"] == written["state_hash"] == second["state_hash"]
    assert document["results"][0]["state_hash"] != second["state_hash"]


@QUICK_WORKERS
@pytest.mark.slow
def test_sweep_resumes_and_merges_as_other_evaluations_do(tiny: CommandLine) -> None:
    sweep = ("--sweep", "time_limit=60,70", "--sweep", "cellwright.arm.servo=original,precise")
    assert tiny(*WORK, "--sweep", "time_limit=60", "--out", "whole").status == 0
    assert "1 run" in tiny(*WORK, "--out", "whole").out  # the trial itself is not one of its variants
    assert "have a result" not in tiny(*WORK, *sweep, "--out", "whole").out
    assert "4 of them have a result already" in tiny(*WORK, *sweep, "--out", "whole").out
    for number in (1, 2):
        assert tiny(*WORK, *sweep, "--shard", f"{number}/2", "--out", f"shards/{number}").status == 0
    assert tiny("eval", "merge", "shards/1", "shards/2", "--out", "merged").status == 0
    trials = [
        [each["trial"] for each in json.loads(Path(name, "summary.json").read_text(encoding="utf-8"))["trials"]]
        for name in ("whole", "merged")
    ]
    assert trials[0] == trials[1]
    assert trials[0] == [
        f"tiny time_limit={limit} cellwright.arm.servo={servo}"
        for limit in (60, 70)
        for servo in ("original", "precise")
    ]
    compared = json.loads(tiny("eval", "compare", "whole", "merged", "--json").out)
    assert [each["trial"] for each in compared["trials"]] == trials[0]


@pytest.mark.parametrize(
    ("sweep", "error"),
    [
        (
            "options.belt_population_cycle=1,2",
            "--sweep: options.belt_population_cycle: unknown option, ignored; did you",
        ),
        ("time_limit=60,abc", "--sweep: time_limit: must be a number (got the text 'abc')"),
        (
            "models_over_bins={bin7: {models: {}}}",
            "--sweep: models_over_bins: no effect on the cell unless options.ins",
        ),
        (
            "orders.order_0.parts.one.pose.xyz[3]=1",
            "--sweep: orders.order_0.parts.one.pose.xyz[3]: orders.order_0.parts.one",
        ),
        ("time_limit=60,60.0", "--sweep time_limit: 60 and 60.0 make the same trial tiny; sweep a key that it uses"),
        ("time_limit", "--sweep: must be KEY=A,B,C (got 'time_limit'); write it as in time_limit=60,120"),
    ],
)
def test_sweep_without_effect_starts_nothing(sweep: str, error: str, tiny: CommandLine) -> None:
    ran = tiny(*WORK, "--sweep", sweep)
    assert ran.status == 2
    assert ran.err.startswith(f"error: {error}")
    assert not Path("evaluation").exists()


def test_error_names_one_of_several_trials(tiny: CommandLine) -> None:
    Path("other.yaml").write_text(TRIAL.replace("order_0", "first"), encoding="utf-8")
    ran = tiny("eval", "tiny.yaml", "other.yaml", "--sweep", "orders.order_0.kit_count=1,2")
    assert ran.status == 2
    assert ran.err.startswith("error: other.yaml: --sweep: orders.order_0: the required entry ")


def test_warning_of_all_variants_is_printed_once(tiny: CommandLine) -> None:
    Path("warned.yaml").write_text(TRIAL.replace("options: {", "options: {insert_agv: true, "), encoding="utf-8")
    ran = tiny("eval", "warned.yaml", "--sweep", "time_limit=1,2,x")
    assert (ran.status, ran.err.count("insert_agv")) == (2, 0)
    ran = tiny("eval", "warned.yaml", "--sweep", "time_limit=1,2", "--agent", "programs.py:Missing")
    assert (ran.status, ran.err.count("unknown option, ignored; did you mean insert_agvs")) == (2, 1)
