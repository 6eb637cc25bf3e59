"""Short form of the ten hours: a restored run continues as an uncut one, and nothing accumulates."""

from __future__ import annotations

import re
import subprocess
import sys
import tracemalloc
from collections import defaultdict
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from benchmarks.soak.leg import FACES, Leg, run_leg
from cellwright.engine.snapshot import CheckpointError
from tests.support.waiting import TIMEOUT

Reports = dict[str, list[Any]]


def run(leg: Leg) -> Reports:
    reports: Reports = defaultdict(list)
    run_leg(leg, lambda kind, value: reports[kind].append(value))
    return reports


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], tuple[Reports, str]]:
    """Legs of one round that are saved, the cell's with listeners on all topics: the reports of each, and its file."""

    @cache
    def begin(face: str) -> tuple[Reports, str]:
        saved = str(tmp_path_factory.mktemp(face) / "1.npz")
        return run(Leg(face, 0, 1, (1,), save=saved, everything=face == "cell")), saved

    return begin


@pytest.mark.slow
@pytest.mark.parametrize("face", FACES)
def test_leg_from_checkpoint_reaches_states_of_uncut_run(
    face: str, first: Callable[[str], tuple[Reports, str]]
) -> None:
    whole = run(Leg(face, 0, 2, (1, 2)))
    begun, saved = first(face)
    second = run(Leg(face, 1, 2, (2,), start=saved))
    assert begun["cut"] + second["cut"] == whole["cut"]
    assert whole["cut"][0][1] != whole["cut"][1][1]
    assert [hours for hours, _ in whole["sample"]] == [0.01, 0.02]


@pytest.mark.slow
def test_cell_leg_counts_grips_parts_and_messages(first: Callable[[str], tuple[Reports, str]]) -> None:
    begun, _ = first("cell")
    counts = begun["counts"][0]
    assert counts["parts gripped"] == 1
    assert counts["parts put on the belt"] == counts["AGVs sent"] == 2
    assert counts["messages received"] > 50_000


@pytest.mark.slow
def test_traced_leg_reports_growth_by_code_line() -> None:
    (kib, places), = run(Leg("robot", 0, 2, traced=True))["grown"]  # fmt: skip
    assert -100 < kib < 200
    assert all(re.fullmatch(r"[+-]\d+\.\d KiB (\S+\.py|<.+>):\d+", line) for line in places), places
    assert not tracemalloc.is_tracing()  # it would slow down all that this process does from here on


def test_leg_round_trips_through_json() -> None:
    leg = Leg("cell", 3, 7, (5, 7), "a.npz", "b.npz", everything=True)
    assert Leg.from_json(leg.to_json()) == leg


def test_leg_with_missing_checkpoint_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CheckpointError, match=r"none\.npz"):
        run_leg(Leg("cell", 1, 2, start=str(tmp_path / "none.npz")), lambda _kind, _value: None)


@pytest.mark.slow
def test_leg_process_ends_when_its_stdin_closes() -> None:
    leg = Leg("cell", 0, 100_000)
    with subprocess.Popen(
        [sys.executable, "-m", "benchmarks.soak.leg", leg.to_json()], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdin is not None
        process.stdin.close()
        assert process.wait(TIMEOUT) == 1
