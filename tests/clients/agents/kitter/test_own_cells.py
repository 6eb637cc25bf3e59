"""The agent at work in the cells of `examples/cells`, which it does not know beforehand."""

from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.agent import find_agent
from cellwright.config.trial.gear2017 import load_trial
from cellwright.running.run import Outcome, RunOptions, run_cell

CELLS = sorted((Path(__file__).parents[4] / "examples" / "cells").glob("*.yaml"))


@pytest.mark.slow
@pytest.mark.parametrize("file", CELLS, ids=lambda file: file.stem)
def test_agent_wins_all_points_of_an_own_cell(file: Path) -> None:
    trial = load_trial([file]).trial
    result = run_cell(Cell(trial), find_agent("kitter")(), RunOptions(until=120.0))
    assert (result.error, result.outcome) == ("", Outcome.DONE)
    # a point each for a part and its place, and the kit's bonus of one for each part
    assert result.score.total == sum(3 * len(kit.objects) for order in trial.orders for kit in order.kits)
