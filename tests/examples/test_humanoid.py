"""Humanoid of the examples: a short program that sorts a bin into two trays, to full points."""

import importlib.util
from pathlib import Path
from typing import Any

import pytest

from cellwright import Cell, load_trial
from cellwright.running.run import Outcome, RunOptions, run_cell

FOLDER = Path(__file__).parents[2] / "examples" / "humanoid"


def sorter() -> Any:
    """Return the program of the example."""
    spec = importlib.util.spec_from_file_location("humanoid", FOLDER / "humanoid.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.Sorter()


def test_example_is_short_and_loads() -> None:
    assert len((FOLDER / "humanoid.py").read_text().splitlines()) <= 60
    trial = load_trial(FOLDER / "humanoid.yaml")
    assert [robot.name for robot in trial.layout.robots] == ["qinglong"]


@pytest.mark.slow
def test_humanoid_wins_all_points() -> None:
    trial = load_trial(FOLDER / "humanoid.yaml")
    result = run_cell(Cell(trial), sorter(), RunOptions(until=60.0))
    assert (result.error, result.outcome) == ("", Outcome.DONE)
    # a point each for a part and its place, and the kit's bonus of one for each part
    assert result.score.total == sum(3 * len(kit.objects) for order in trial.orders for kit in order.kits)
