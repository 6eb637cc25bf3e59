"""Kitter agent in cells that lack something."""

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.agent import find_agent
from cellwright.clients.agents.kitter import agent
from cellwright.clients.agents.kitter.strategy import Strategy
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.running.run import RunOptions, run_cell
from cellwright.util.errors import CellwrightError
from tests.support.cells import ARM_ONLY, BARE


def test_agent_in_cell_without_arm_says_so() -> None:
    result = run_cell(Cell(BARE), find_agent("kitter")(), RunOptions(until=10.0))
    assert "UsageError: no joint positions: nothing is published on /ariac/joint_states" in result.error


def test_cell_without_descriptions_still_gets_the_built_in_types(monkeypatch: pytest.MonkeyPatch) -> None:
    """As a cell of an earlier version, which has no services for them."""

    def refuse(_client: Client) -> None:
        raise CellwrightError("no such service")

    strategies: list[Strategy] = []
    monkeypatch.setattr(Client, "part_types", refuse)
    monkeypatch.setattr(Client, "solids", refuse)
    monkeypatch.setattr(Strategy, "run", lambda strategy: strategies.append(strategy))
    agent.KitterAgent().run(Client(InProcess(Cell(ARM_ONLY))))
    (strategy,) = strategies
    assert strategy._arm._clearance is None
    assert "gear_part" in strategy._catalogue.types
