"""Tests of a run that is restarted under way: time 0 again, with the same clients, its end where it was."""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest

import cellwright
from cellwright.cell.cell import Cell
from cellwright.engine.rate_control import RateControl
from cellwright.running.run import Outcome, RunResult, ServerOptions, Session
from cellwright.util.files import read_json_lines
from tests.support.cells import BARE, KITTING, call


def test_restarted_run_ends_at_same_time(tmp_path: Path) -> None:
    cell = Cell(KITTING)
    times: list[float] = []

    def poll() -> None:
        times.append(cell.simulation.time)
        if len(times) == 2:
            call(cell, "end_competition")
        if len(times) == 3:
            session.reset()
        if len(times) > 3:
            tempo.set_speed(None)

    tempo = RateControl(1.0)
    with Session(cell, serve=ServerOptions(port=0), rate=tempo, record=tmp_path / "a.jsonl") as session:
        session.on_poll.append(poll)
        result = session.run(until=1.5)
    assert isinstance(result, RunResult)
    assert times[2] > 0.0
    assert times[3] < times[2] + 0.3, "it counts from 0 again"
    assert (result.outcome, result.simulated, result.competition_state) == (Outcome.UNTIL, 1.5, "init")
    kinds = [line["kind"] for line in read_json_lines(tmp_path / "a.jsonl")]
    assert kinds.count("reset") == 1
    assert kinds.index("reset") > kinds.index("state")
    other = Cell(KITTING)
    other.simulation.step_until(1_500_000_000)
    assert result.state_hash == other.state_hash()


@pytest.mark.parametrize("target", [BARE, "tandem"])
def test_reset_under_way_keeps_end_of_run(target: cellwright.Trial | str) -> None:
    tempo, polls = RateControl(1.0), itertools.count(1)

    def poll() -> None:
        if next(polls) == 2:
            session.reset()
            tempo.set_speed(None)
        elif session.node.simulation.time > 1.0:
            session.stop.request("it has no end")

    with Session(target, serve=ServerOptions(port=0), rate=tempo) as session:
        session.on_poll.append(poll)
        result = session.run(until=0.4)
    assert result.simulated == pytest.approx(0.4, abs=0.005)
    assert session.number == 1, "the same run"
