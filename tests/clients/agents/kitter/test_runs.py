"""The agent at work in the cell: it wins every point that can be won."""

import logging
import math
import re
from collections.abc import Iterator
from fractions import Fraction
from functools import cache
from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.agent import find_agent
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.moving import moved
from cellwright.running.run import Outcome, RunOptions, RunResult, run_cell
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.distances import LINKS, LinkDistances
from tests.support.own_parts import write_trial


class LogTexts(logging.Handler):
    """A handler that keeps the texts of a log."""

    def __init__(self, level: int = logging.INFO) -> None:
        super().__init__(level)
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.texts.append(record.getMessage())


@cache
def run(*names: str) -> RunResult:
    trial = load_trial([find_trial(name) for name in names]).trial
    return run_cell(Cell(trial), find_agent("kitter")(), RunOptions(until=300.0))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("names", "points"),
    [
        (("lesson",), 8.0),  # of 12: every ordered pose is off the tray
        (("qual1a", "kitter_sensors"), 15.0),
        (("final01", "kitter_sensors"), 6.0),
        (("qual2b", "kitter_sensors"), 12.0),  # gaskets come on the belt
        (("final02", "kitter_sensors"), 9.0),  # the belt brings the first order's parts
        (("sample_scenario2", "kitter_sensors"), 6.0),
        (("sample_scenario3", "kitter_sensors"), 12.0),
    ],
)
def test_agent_wins_all_attainable_points(names: tuple[str, ...], points: float) -> None:
    result = run(*names)
    assert result.error == ""
    assert result.outcome is Outcome.DONE
    assert result.score.total == points


def test_agent_wins_the_same_points_where_the_cell_stands_elsewhere() -> None:
    trial = load_trial([find_trial("final01"), find_trial("kitter_sensors")]).trial
    there = moved(trial, Pose.from_rpy((2.0, 1.0, 0.0), (0.0, 0.0, math.pi / 2)))
    result = run_cell(Cell(there), find_agent("kitter")(), RunOptions(until=60.0))
    assert (result.error, result.outcome, result.score.total) == ("", Outcome.DONE, 6.0)


@pytest.mark.slow
@pytest.mark.parametrize(("trial", "points"), [("final02", 9.0), ("sample_scenario3", 12.0)])
def test_links_keep_away_from_everything_all_the_time(trial: str, points: float) -> None:
    """Commands keep 10 mm; the servos, which give way, need some of it. The cup may touch."""
    cell = Cell(load_trial([find_trial(trial), find_trial("kitter_sensors")]).trial)
    distances = LinkDistances(cell, LINKS[:-1])
    nearest: list[tuple[tuple[str, str], float]] = []
    cell.simulation.watch("links", Fraction(1, 50), lambda _index: nearest.extend(distances.now(0.02).items()))
    result = run_cell(cell, find_agent("kitter")(), RunOptions(until=300.0))
    assert result.score.total == points
    assert nearest, "they do come within 20 mm of something"
    pair, distance = min(nearest, key=lambda each: each[1])
    assert distance >= 0.008, pair


def test_placed_parts_fit_ordered_poses() -> None:
    (kit,) = run("qual1a", "kitter_sensors").score.orders[0].kits
    for part in kit.parts:
        assert part.fit is not None
        assert part.fit.distance < 0.005
        assert part.fit.yaw_difference < 0.03


@pytest.mark.slow
def test_faulty_parts_are_replaced_without_loss_of_points() -> None:
    """Two of the four rods and two of the four gaskets are faulty."""
    result = run("qual3a", "kitter_sensors")
    assert result.score.total == 27.0


@pytest.mark.slow
def test_part_dropped_over_tray_costs_no_points() -> None:
    """One of the rods is dropped on the tray, by force."""
    result = run("final10", "kitter_sensors")
    assert result.score.total == 15.0


def run_own(folder: Path, *types: str, roll: str = "0") -> tuple[RunResult, list[str]]:
    """Run a trial with parts of its own; return the result, and the agent's final lines on missing parts."""
    trial = load_trial([write_trial(folder, *types, roll=roll), find_trial("kitter_sensors")]).trial
    logger, lines = logging.getLogger("cellwright.clients.agents.kitter"), LogTexts(logging.WARNING)
    logger.addHandler(lines)
    try:
        return run_cell(Cell(trial), find_agent("kitter")(), RunOptions(until=300.0)), lines.texts
    finally:
        logger.removeHandler(lines)


@pytest.mark.slow
def test_trial_parts_are_brought_for_full_score(tmp_path: Path) -> None:
    result, warnings = run_own(tmp_path, "my_box", "my_can", "my_step")
    assert (result.error, result.outcome) == ("", Outcome.DONE)
    assert result.score.total == result.evidence.attainable.maximum == 9.0
    assert warnings == []


@pytest.mark.slow
def test_parts_ordered_on_their_side_are_placed_so(tmp_path: Path) -> None:
    result, warnings = run_own(tmp_path, "my_box", "my_step", roll="pi/2")
    assert (result.outcome, result.score.total, warnings) == (Outcome.DONE, 6.0, [])


@pytest.mark.slow
def test_unsuitable_parts_are_logged_at_end_with_reason(tmp_path: Path) -> None:
    result, warnings = run_own(tmp_path, "my_ball", "my_anvil")
    assert (result.outcome, result.score.total) == (Outcome.DONE, 0.0)
    assert [line.partition(" s: ")[2] for line in warnings] == [
        "not brought for order_0_kit_0: 1 my_ball: its flat top is too small: a disc of 2 mm radius (needs 6 mm)",
        "not brought for order_0_kit_0: 1 my_anvil: it is too heavy: 25 kg, the arm carries 10 kg",
    ]
    sentences = [part.sentence() for each in result.evidence.orders for kit in each.kits for part in kit.parts]
    assert sentences == ["not on the tray at submission: never gripped"] * 2


@pytest.fixture(scope="module")
def again() -> Iterator[tuple[RunResult, list[str]]]:
    """A second run of one of the trials, and the lines of its log."""
    logger, lines = logging.getLogger("cellwright.clients.agents.kitter"), LogTexts()
    level = logger.level
    logger.addHandler(lines)
    logger.setLevel(logging.INFO)
    try:
        trial = load_trial([find_trial("final01"), find_trial("kitter_sensors")]).trial
        yield run_cell(Cell(trial), find_agent("kitter")(), RunOptions(until=300.0)), lines.texts
    finally:
        logger.setLevel(level)
        logger.removeHandler(lines)


@pytest.mark.slow
def test_second_run_ends_in_same_state(again: tuple[RunResult, list[str]]) -> None:
    assert again[0].state_hash == run("final01", "kitter_sensors").state_hash


@pytest.mark.slow
def test_log_lines_have_time_and_action(again: tuple[RunResult, list[str]]) -> None:
    _, lines = again
    assert all(re.match(r"\d+\.\d s: ", line) for line in lines)
    assert any("fetching a piston_rod_part" in line for line in lines)
    assert any("of the tray, as ordered" in line for line in lines)
