from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.soak.soak import SoakError, SoakResult, borders, soak


@pytest.mark.slow
@given(st.integers(1, 3000), st.integers(1, 50))
def test_borders_cut_rounds_into_even_pieces(rounds: int, pieces: int) -> None:
    found = borders(rounds, pieces)
    sizes = {b - a for a, b in pairwise(found)}
    assert (found[0], found[-1]) == (0, rounds)
    assert len(found) == min(rounds, pieces) + 1
    assert max(sizes) - min(sizes) <= 1


@pytest.mark.slow
def test_soak_runs_and_compares_processes(tmp_path: Path) -> None:
    progress: list[str] = []
    found = soak("cell", 2, 2, tmp_path, traced=0, on_progress=progress.append)
    assert found.first_difference is None
    assert list(found.whole) == list(found.pieces) == [1, 2]
    assert [each.hours for each in found.samples] == pytest.approx([0.01, 0.02])
    assert found.counts["messages received"] > 500
    assert len(progress) == 2
    assert progress[1].startswith("cell: 0.02 of 0.02 h")


def test_soak_with_early_exit_of_process_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(SoakError, match=r"cell: rounds 0 to .*: exit status 1"):
        soak("cell", 2, 2, tmp_path)


def test_first_difference_is_earliest_unequal_cut() -> None:
    assert SoakResult("cell", 2, whole={1: "a", 2: "b"}, pieces={1: "a", 2: "b"}).first_difference is None
    assert SoakResult("cell", 2, whole={1: "a", 2: "b"}, pieces={1: "a", 2: "c"}).first_difference == 2
    assert SoakResult("cell", 2, whole={1: "a", 2: "b"}, pieces={}).first_difference == 1
