"""Tests of the pictures of the worst runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.rendering.backend import BACKEND, RAYS
from cellwright.running.evaluation.outputs import state_pictures
from cellwright.running.evaluation.outputs.state_pictures import MAX_PICTURES, draw_worst
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.state import StateReporter, state_file, write_state
from tests.rendering.test_png import decode
from tests.running.evaluation.made_results import result
from tests.running.evaluation.results.test_state import Sent
from tests.support.cells import KITTING


def with_state(results: list[Result], folder: Path) -> list[Result]:
    """Write a state for each result."""
    sent = Sent()
    StateReporter(Cell(KITTING), sent)
    for each in results:
        write_state(state_file(folder, each.log_name), each.name, sent.scene, sent.frames[0])
    return results


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["", RAYS])
def test_worst_runs_have_pictures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, backend: str) -> None:
    monkeypatch.setenv(BACKEND, backend)
    monkeypatch.setattr(state_pictures, "MAX_BY_RAYS" if backend else "MAX_PICTURES", 2)
    results = with_state([result(), *(result(seed, seed=seed) for seed in (4, 3, 2))], tmp_path)
    misses: list[str] = []
    pictures = draw_worst(tmp_path, results, misses.append)
    assert (set(pictures), misses) == ({"tiny-2", "tiny-3"}, [])
    drawn = decode(pictures["tiny-2"])
    assert drawn.shape == (270, 480, 3)
    assert len({tuple(each) for each in drawn[::9, ::9].reshape(-1, 3).tolist()}) > 50
    assert pictures["tiny-2"] == pictures["tiny-3"]  # the same state


def test_nothing_is_drawn_without_states_or_losses(tmp_path: Path) -> None:
    assert draw_worst(tmp_path, [result(0.0, seed=seed) for seed in range(MAX_PICTURES)], pytest.fail) == {}
    assert draw_worst(tmp_path, with_state([result()], tmp_path), pytest.fail) == {}


def test_renderer_that_is_unknown_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(BACKEND, "chalk")
    misses: list[str] = []
    assert draw_worst(tmp_path, with_state([result(1.0)], tmp_path), misses.append) == {}
    assert len(misses) == 1
    assert misses[0].startswith("no pictures in the report: CELLWRIGHT_RENDERING=chalk: unknown backend")
