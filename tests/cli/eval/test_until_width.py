"""Tests of `cellwright eval --until-width`: how many seeds run, count, and are planned."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.conftest import CommandLine
from tests.support.quick_children import QUICK_WORKERS

WORK = ("eval", "tiny.yaml", "--agent", "third.py:Third", "--jobs", "1", "--min-score", "100%", "--json")
THIRD = '''
from pathlib import Path


class Third:
    """Fails in each third of its runs."""

    def run(self, client):
        with open("runs.txt", "a") as file:
            file.write("run\\n")
        client.start_competition()
        client.sleep(1.1)
        if len(Path("runs.txt").read_text().split()) % 3:
            client.control_agv(1, "order_0_kit_0")
        else:
            client.end_competition()
'''


def count() -> int:
    return len(Path("runs.txt").read_text().split())


@QUICK_WORKERS
@pytest.mark.slow
def test_seeds_run_until_the_interval_is_narrow_and_a_wider_one_takes_fewer_of_them(tiny: CommandLine) -> None:
    Path("third.py").write_text(THIRD)
    ran = tiny(*WORK, "--until-width", "0.6", "--min", "3", "--max", "20")
    # Wilson's intervals of 2 of 3, 3 of 4, 4 of 5 and 4 of 6: 0.73, 0.65, 0.59 wide
    document = json.loads(ran.out)
    assert (ran.status, document["runs"], document["passed"], count()) == (1, 5, 4, 5)
    low, high = document["passed_interval"]
    assert 0.5 < high - low <= 0.6
    assert "at most 20 runs, agent third.py:Third" in ran.err
    assert "seeds       tiny: 5 of at most 20 seeds, interval 58.8 % wide" in ran.err
    plan = json.loads(Path("evaluation/plan.json").read_text())
    assert [run["seed"] for run in plan["runs"]] == [1, 2, 3, 4, 5]

    # results that are there are looked at first, in the order of their seeds
    ran = tiny(*WORK, "--until-width", "0.7", "--min", "3", "--max", "20")
    assert (json.loads(ran.out)["runs"], count()) == (4, 5)
    ran = tiny(*WORK, "--until-width", "0.5", "--min", "3", "--max", "6")
    assert (json.loads(ran.out)["runs"], count()) == (6, 6)
    assert "seeds       tiny: 6 of at most 6 seeds, interval 60.3 % wide, more than was asked for" in ran.err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--until-width", "0"), "--until-width 0: give a share of more than 0, at most 1, such as 0.14"),
        (("--until-width", "1.5"), "--until-width 1.5: give a share of more than 0, at most 1, such as 0.14"),
        (("--until-width", "nan"), "--until-width nan: give a share of more than 0, at most 1, such as 0.14"),
        (("--until-width", "0.2", "--min", "1"), "--min 1: give a number from 2 to 10000"),
        (("--until-width", "0.2", "--min", "9", "--max", "8"), "--max 8: must be at least --min (got 9); give more"),
        (("--min", "3"), "--min: belongs to --until-width; add it, or give --seeds"),
        (("--until-width", "0.2", "--seeds", "4"), "--seeds: does not go with --until-width; leave one out"),
        (("--until-width", "0.2", "--shard", "1/2"), "--shard: does not go with --until-width, which needs the"),
        (("--until-width", "0.2", "--agents", "*.py:A"), "--agents: does not go with --until-width"),
        (("--until-width", "0.2", "--repeat"), "--repeat: does not go with --until-width"),
    ],
)
def test_rule_that_cannot_be_followed_is_refused(tiny: CommandLine, options: tuple[str, ...], message: str) -> None:
    ran = tiny("eval", "tiny.yaml", *options)
    assert ran.status == 2
    assert message in ran.err
    assert not Path("evaluation").exists()
