"""The engine's time within a run."""

import mujoco
import pytest

from benchmarks.engine_time import CALLS, EngineTime, cost_of_timing, engine_timed
from benchmarks.step import trial_with
from cellwright.cell.cell import Cell


def test_engine_timed_counts_steps_and_restores_engine() -> None:
    before = mujoco.mj_step, mujoco.mj_step1, mujoco.mj_step2
    with engine_timed() as engine:
        cell = Cell(trial_with(1))
        for _ in range(50):
            cell.step()
        assert mujoco.mj_step is not before[0]
    assert (mujoco.mj_step, mujoco.mj_step1, mujoco.mj_step2) == before
    assert engine.steps == 50
    assert engine.calls >= 50
    assert 0.0 < engine.spent <= engine.measured
    assert engine.overhead >= 0.0


def test_step_in_two_halves_counts_once() -> None:
    cell = Cell(trial_with(1))
    model, data = cell.simulation.model, cell.simulation.data
    with engine_timed() as engine:
        mujoco.mj_step1(model, data)
        mujoco.mj_step2(model, data)
    assert (engine.steps, engine.calls) == (1, 2)


def test_engine_timed_restores_engine_after_error() -> None:
    before = mujoco.mj_step
    with pytest.raises(ZeroDivisionError), engine_timed():
        raise ZeroDivisionError
    assert mujoco.mj_step is before


def test_timing_overhead_is_subtracted() -> None:
    engine = EngineTime(within=0.25, whole=0.5)
    timed = engine.timed(lambda _model, _data: None, 1)
    timed(None, None)
    timed(None, None)
    assert engine.spent == pytest.approx(engine.measured - 0.5)
    assert engine.overhead == 1.0


def test_cost_of_timing_is_below_1_ms() -> None:
    within, whole = cost_of_timing()
    assert 0.0 <= within <= whole < 1e-3
    assert CALLS > 1000
