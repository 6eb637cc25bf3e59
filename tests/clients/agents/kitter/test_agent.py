"""Kitter agent in cells that lack something."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.agent import find_agent
from cellwright.clients.agents.kitter import agent
from cellwright.clients.agents.kitter.strategy import Strategy
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.config.layout.arms import Tool
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.running.run import RunOptions, run_cell
from tests.cell.arm_cells import PEDESTAL, carried_cell, ur5_cell
from tests.clients.agents.kitter.arms import CELL
from tests.clients.agents.kitter.arms import PEDESTAL as MOUNT
from tests.support.cells import ARM_ONLY, BARE


def test_agent_in_cell_without_arm_says_so() -> None:
    result = run_cell(Cell(BARE), find_agent("kitter")(), RunOptions(until=10.0))
    assert "UsageError: no joint positions: nothing is published on /ariac/joint_states" in result.error


def test_agent_in_cell_whose_arm_has_no_cup_says_so_before_time_passes() -> None:
    cell = Cell(ur5_cell(PEDESTAL.replace("tip: tool0", "tip: tool0\n      tool: {{kind: none}}")))
    result = run_cell(cell, find_agent("kitter")(), RunOptions(until=0.01))
    assert "UsageError: kitter works with a suction cup (arm: tool: none); write an agent for it" in result.error


def test_agent_whose_arm_is_on_another_says_so_before_time_passes() -> None:
    trial = carried_cell()
    trial = replace(trial, layout=replace(trial.layout, arms=(replace(trial.arms[0], tool=Tool()), trial.arms[1])))
    result = run_cell(Cell(trial), find_agent("kitter")(), RunOptions(until=0.01))
    assert "kitter works with arms that stand by themselves (small is on gantry); write an agent for it" in result.error


PANDA = "tip: panda_hand, home: {panda_joint2: -0.4, panda_joint4: -2.2, panda_joint6: 1.9, panda_joint7: 0.8}"


def panda_cell(cup: str = "") -> Cell:
    """Return a cell with a Panda whose fingers are beside the cup; with settings of the cup."""
    model = Path(pytest.importorskip("pybullet_data").getDataPath()) / "franka_panda" / "panda.urdf"
    return Cell(load_trial(text=CELL.format(model=model, mount=MOUNT, home=PANDA.replace("home", f"{cup}home"))).trial)


def test_fingers_below_the_cup_are_refused_with_the_length_that_it_needs() -> None:
    result = run_cell(panda_cell(), find_agent("kitter")(), RunOptions(until=0.1))
    found = re.search(r"panda_\w+finger reaches \d+ mm below the suction cup, .*length: ([\d.]+)}", result.error)
    assert found is not None, result.error
    length = float(found[1])
    cell = panda_cell(f"tool: {{kind: vacuum, length: {length}}}, ")
    longer = run_cell(cell, find_agent("kitter")(), RunOptions(until=0.1))
    assert longer.error == ""


@pytest.mark.slow
def test_panda_with_a_cup_below_its_fingers_wins_all_points() -> None:
    cell = panda_cell("tool: {kind: vacuum, length: 0.14}, ")
    result = run_cell(cell, find_agent("kitter")(), RunOptions(until=60.0))
    assert (result.error, result.score.total) == ("", 6.0)


def test_agent_knows_the_parts_and_solids_of_its_cell(monkeypatch: pytest.MonkeyPatch) -> None:
    strategies: list[Strategy] = []
    monkeypatch.setattr(Strategy, "run", lambda strategy: strategies.append(strategy))
    agent.KitterAgent().run(Client(InProcess(Cell(Trial("arm", has_arm=True)))))
    (strategy,) = strategies
    assert strategy._worker.arm._clearance is not None
    assert "gear_part" in strategy._catalogue.types


def test_agent_without_a_tray_says_so(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    strategies: list[Strategy] = []
    monkeypatch.setattr(Strategy, "run", lambda strategy: strategies.append(strategy))
    agent.KitterAgent().run(Client(InProcess(Cell(ARM_ONLY))))
    assert strategies == []
    assert "no AGV and no fixed tray" in caplog.text
