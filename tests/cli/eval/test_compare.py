"""Tests of `cellwright eval compare`, from its arguments to its exit status."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.summary import summary_document
from tests.cli.conftest import CommandLine
from tests.running.evaluation.made_results import LOST, result


def write(name: str, results: list[Result]) -> None:
    Path(name).mkdir()
    (Path(name) / "summary.json").write_text(json.dumps(summary_document(results, None, 0)))


@pytest.fixture
def compare(cellwright: CommandLine) -> CommandLine:
    """Return the command line in a folder with evaluations: `old`, and `new`, which is worse by 1 to 3 of 12 points."""
    write("old", [result(8.0 + seed % 3, seed=seed) for seed in range(1, 21)])
    lost = [result(6.0 + seed % 2, seed=seed, agent="new.py:New") for seed in range(1, 22)]
    write("new", [LOST if each.seed == 3 else each for each in lost])
    return cellwright


def test_regression_has_status_1_and_lists_turned_runs(compare: CommandLine) -> None:
    ran = compare("eval", "compare", "old", "new")
    assert (ran.status, ran.err) == (1, "")
    lines = ran.out.splitlines()
    assert lines[0].startswith(
        "A           old, agent my.py:Mine: 75.4% of the attainable points (95 %: 72.1 to 78.5 %)"
    )
    assert lines[1].endswith("19 of 20 runs done (95 %: 76.4 to 99.1 %)")
    turned = [line for line in lines if line.startswith("  tiny seed")]
    assert turned[0] == "  tiny seed 3: 8 -> 0 of 12 points, done -> wall limit (still running after 5 s)"
    assert len(turned) == 10
    assert "unpaired    0 runs of A, 1 of B" in lines
    assert "seeds   points   runs done" in [line.rstrip() for line in lines]
    assert "needed      seeds to show B - A as it was seen: 5 for points, 157 for runs done" in lines
    assert "tiny    time, s      19   20   20      +0   0 to 0" in [line.rstrip() for line in lines]
    assert lines[-2:] == [
        "chance      0.5 of such a loss of runs done, if B loses nothing",
        "verdict     worse: B loses more than 0 %",
    ]
    assert max(map(len, lines[2:])) <= 80


def test_margin_and_gain_have_status_0(compare: CommandLine) -> None:
    assert compare("eval", "compare", "old", "new", "--margin", "40").status == 0
    ran = compare("eval", "compare", "new/summary.json", "old")
    assert ran.status == 0
    assert ran.out.splitlines()[-1] == "verdict     better: B gains"


def test_inconclusive_comparison_has_its_own_status_and_names_the_seeds(cellwright: CommandLine) -> None:
    write("old", [result(6.0, seed=seed, vary=True) for seed in range(1, 4)])
    write("new", [result(4.0, seed=seed, vary=True) for seed in range(1, 4)])
    ran = cellwright("eval", "compare", "old", "new")
    assert ran.status == 3
    words = "inconclusive: a loss of more than 0 % may be chance or not; about 1 more seed would tell"
    assert ran.out.splitlines()[-1] == f"verdict     {words}"
    assert cellwright("eval", "compare", "old", "new", "--strict").status == 1
    document = json.loads(cellwright("eval", "compare", "old", "new", "--json").out)
    assert (document["verdict"], document["regression"], document["more_seeds"]) == ("inconclusive", False, 1)
    assert document["chances"] == {"points": 0.05, "runs done": None}


def test_comparison_as_json_has_figures_and_pairs(compare: CommandLine) -> None:
    ran = compare("eval", "compare", "old", "new", "--margin", "1", "--json")
    document = json.loads(ran.out)
    assert ran.status == 1
    assert (document["regression"], document["margin"], document["pairs"]) == (True, 0.01, 20)
    low, high = document["interval"]
    assert low < document["difference"] < high < -0.01
    assert document["turned"][0]["outcomes"] == ["done", "wall_limit"]
    assert document["trials"][0]["worse"] == 20


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("old",), "Missing argument 'B'"),
        (("old", "none"), "error: none: cannot be read: No such file or directory; give the folder of an evaluation\n"),
        (("old", "new", "--margin", "-1"), "error: --margin -1: give a number from 0 to 100\n"),
        (("old", "new", "--margin", "nan"), "error: --margin nan: give a number from 0 to 100\n"),
    ],
)
def test_invalid_input_is_refused(compare: CommandLine, arguments: tuple[str, ...], message: str) -> None:
    ran = compare("eval", "compare", *arguments)
    assert ran.status == 2
    assert message in ran.err
    assert ran.out == ""


def test_trial_of_eval_may_follow_other_options(compare: CommandLine) -> None:
    ran = compare("eval", "--seeds", "1", "compare")  # no command behind an option: a trial that is not there
    assert (ran.status, ran.out) == (2, "")
    assert "unknown trial 'compare'" in ran.err
