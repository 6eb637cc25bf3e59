"""The agent at work in the cell: every point that there is to get."""

import logging
import re
from collections.abc import Iterator
from functools import cache

import pytest

from cellwright.agents.agent import find_agent
from cellwright.cell import Cell
from cellwright.description.catalogue import find_trial
from cellwright.description.gear2017 import load_trial
from cellwright.run import Outcome, RunOptions, RunResult, run_cell


class Lines(logging.Handler):
    """A handler that keeps the texts of a log."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.said: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.said.append(record.getMessage())


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
    ],
)
def test_full_marks(names: tuple[str, ...], points: float) -> None:
    result = run(*names)
    assert result.error == ""
    assert result.outcome is Outcome.DONE
    assert result.score.total == points


def test_parts_lie_where_they_were_ordered() -> None:
    (kit,) = run("qual1a", "kitter_sensors").score.orders[0].kits
    for part in kit.parts:
        assert part.fit is not None
        assert part.fit.distance < 0.005
        assert part.fit.yaw_difference < 0.03


@pytest.mark.slow
def test_faulty_parts_are_thrown_out_and_replaced() -> None:
    """Two of the four rods and two of the four gaskets are faulty."""
    result = run("qual3a", "kitter_sensors")
    assert result.score.total == 27.0


@pytest.mark.slow
def test_a_part_lost_over_the_tray_costs_nothing() -> None:
    """One of the rods is dropped on the tray, by force."""
    result = run("final10", "kitter_sensors")
    assert result.score.total == 15.0


@pytest.fixture(scope="module")
def again() -> Iterator[tuple[RunResult, list[str]]]:
    """A second run of one of the trials, and the lines of its log."""
    logger, lines = logging.getLogger("cellwright.agents.kitter"), Lines()
    level = logger.level
    logger.addHandler(lines)
    logger.setLevel(logging.INFO)
    try:
        trial = load_trial([find_trial("final01"), find_trial("kitter_sensors")]).trial
        yield run_cell(Cell(trial), find_agent("kitter")(), RunOptions(until=300.0)), lines.said
    finally:
        logger.setLevel(level)
        logger.removeHandler(lines)


@pytest.mark.slow
def test_a_second_run_is_the_same(again: tuple[RunResult, list[str]]) -> None:
    assert again[0].state_hash == run("final01", "kitter_sensors").state_hash


@pytest.mark.slow
def test_the_log_tells_what_it_does(again: tuple[RunResult, list[str]]) -> None:
    _, lines = again
    assert all(re.match(r"\d+\.\d s: ", line) for line in lines)
    assert any("fetching a piston_rod_part" in line for line in lines)
    assert any("of the tray, as ordered" in line for line in lines)
