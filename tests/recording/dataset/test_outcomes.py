"""Outcomes of frames: by the task, and by score and orders without one."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest

from cellwright import Cell
from cellwright.cell.competition import Competition
from cellwright.cell.kitting.effects import EndReason
from cellwright.recording.dataset.outcomes import FrameOutcome, Outcomes
from cellwright.util.pose import Pose
from tests.cell.tasks.cells import go, task_cell, trial

ON_TRAY = "{on_tray: {part: gear_part, tray: tray1}}"


def put(cell: Cell) -> None:
    cell.parts.place(cell.parts.part("bin1|gear_part_2"), cell.trays[1].world_T_tray @ Pose())


def without_task(**changes: object) -> Cell:
    return Cell(replace(trial(ON_TRAY), task=None, **changes))  # type: ignore[arg-type]


def test_success_of_the_task_is_rewarded_and_ends_the_episode() -> None:
    cell = task_cell(ON_TRAY)
    outcomes = Outcomes(cell)
    go(cell, 0.1)
    assert outcomes.read() == FrameOutcome(0.0, is_success=False, is_terminated=False, is_over=False)
    put(cell)
    go(cell, 1.0)
    assert outcomes.read() == FrameOutcome(1.0, is_success=True, is_terminated=True, is_over=True)


def test_shaped_reward_is_the_potential() -> None:
    cell = task_cell(ON_TRAY, "  reward: shaped\n")
    outcomes = Outcomes(cell)
    go(cell, 0.1)
    assert cell.task is not None
    assert outcomes.read().reward == cell.task.potential() != 0.0


def test_reading_moves_no_success_that_must_hold() -> None:
    read, alone = (task_cell(ON_TRAY, "  hold_for: 0.5\n  reward: shaped\n") for _ in range(2))
    outcomes = Outcomes(read)
    assert alone.task is not None
    alone.task.watch()
    for cell in (read, alone):
        go(cell, 0.046)
        put(cell)
        go(cell, 0.004)
        for _ in range(30):
            outcomes.read()
            go(cell, 0.05)
    assert read.task is not None
    assert read.task.succeeded_at == alone.task.succeeded_at is not None


def test_competition_that_is_ended_before_success_terminates() -> None:
    cell = task_cell(ON_TRAY)
    outcomes = Outcomes(cell)
    cell.competition.start()
    cell.competition.end()
    go(cell, 0.1)
    assert outcomes.read() == FrameOutcome(0.0, is_success=False, is_terminated=True, is_over=True)


def test_time_limit_ends_without_terminating() -> None:
    cell = without_task(time_limit=0.2)
    outcomes = Outcomes(cell)
    cell.competition.start()
    go(cell, 0.5)
    assert outcomes.read() == FrameOutcome(0.0, is_success=False, is_terminated=False, is_over=True)


def test_without_task_the_reward_is_what_the_frame_gained(monkeypatch: pytest.MonkeyPatch) -> None:
    cell = without_task()
    points = iter([1.0, 3.0, 3.0])
    monkeypatch.setattr(Competition, "score", lambda _: SimpleNamespace(total=next(points)))
    outcomes = Outcomes(cell)
    assert [outcomes.read().reward for _ in range(2)] == [2.0, 0.0]


def test_without_task_complete_orders_are_the_success() -> None:
    cell = without_task()
    outcomes = Outcomes(cell)
    cell.competition.referee.end_reason = EndReason.ORDERS_COMPLETE
    assert outcomes.read() == FrameOutcome(0.0, is_success=True, is_terminated=True, is_over=True)
