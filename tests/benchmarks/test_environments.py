"""Environments for learning, with few steps."""

from __future__ import annotations

import pytest

from benchmarks.environments import measure


@pytest.mark.slow
def test_steps_resets_pictures_and_cells_have_figures() -> None:
    progress: list[str] = []
    figures = {figure.label: figure for figure in measure(progress.append, quick=True)}
    assert progress == ["one environment", "pictures", "1 cells", "4 cells"]
    assert [*figures] == [
        "steps, state alone",
        "a reset, with another variation",
        "steps, three pictures of 84 x 84",
        "1 cell as a vector: steps of all",
        "4 cells in one process: steps of all",
    ]
    assert all(figure.value > 0.0 for figure in figures.values())
    assert figures["steps, state alone"].minimum == 2000.0
    assert figures["4 cells in one process: steps of all"].note.endswith("MiB a cell")
