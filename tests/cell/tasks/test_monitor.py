"""Monitor of a task: success, the time for which it must hold, rewards and snapshots."""

import pytest

from cellwright import Cell
from cellwright.cell.tasks.monitor import TaskMonitor
from cellwright.util.pose import Pose
from tests.cell.tasks.cells import BASE, go, task_cell

GEAR = "bin1|gear_part_2"
ON_TRAY = "{on_tray: {part: gear_part, tray: tray1}}"


def monitor(cell: Cell) -> TaskMonitor:
    assert cell.task is not None
    return cell.task


def put(cell: Cell) -> None:
    """Put a gear on the tray, where it lies at once."""
    cell.parts.place(cell.parts.part(GEAR), cell.trays[1].world_T_tray @ Pose((0.0, 0.0, 0.0)))
    go(cell, 0.1)


def test_trial_without_a_task_has_no_monitor() -> None:
    from cellwright.config.trial.gear2017 import load_trial

    cell = Cell(load_trial(text=BASE).trial)
    assert cell.task is None
    assert "task" not in cell.simulation.devices
    go(cell, 0.1)
    assert cell.competition.state == "init"


def test_success_is_noted_once_and_ends_with_the_conditions() -> None:
    cell = task_cell(ON_TRAY)
    assert not monitor(cell).success
    put(cell)
    assert monitor(cell).success
    first = cell.simulation.now
    cell.parts.place(cell.parts.part(GEAR), Pose((1.0, -1.9, 0.1)))
    go(cell, 0.1)
    assert not monitor(cell).success
    assert monitor(cell).succeeded_at == first


def test_all_conditions_of_a_list_must_hold() -> None:
    cell = task_cell(f"[{ON_TRAY}, {{held: {{part: gear_part}}}}]")
    put(cell)
    assert not monitor(cell).success
    assert 0.5 < monitor(cell).potential() < 1.0


def test_conditions_must_hold_for_a_time_without_a_break() -> None:
    cell = task_cell(ON_TRAY, "  hold_for: 0.2\n")
    put(cell)
    begun = cell.simulation.now
    assert not monitor(cell).success
    go(cell, 0.1)
    cell.parts.place(cell.parts.part(GEAR), Pose((1.0, -1.9, 0.1)))
    go(cell, 0.1)
    assert not monitor(cell).success
    put(cell)
    assert not monitor(cell).success
    again = cell.simulation.now
    go(cell, 0.2)
    assert monitor(cell).success
    assert monitor(cell).succeeded_at == again + 200_000_000 > begun


def test_sparse_reward_is_success_alone() -> None:
    cell = task_cell(ON_TRAY)
    assert monitor(cell).reward() == 0.0 < monitor(cell).potential()
    put(cell)
    assert monitor(cell).reward() == 1.0


def test_shaped_reward_is_the_potential() -> None:
    cell = task_cell(ON_TRAY, "  reward: shaped\n")
    assert 0.0 < monitor(cell).reward() == monitor(cell).potential()


def test_asking_changes_no_run() -> None:
    hashes = []
    for asks in (False, True):
        cell = task_cell(ON_TRAY, "  reward: shaped\n")
        for _ in range(20):
            go(cell, 0.05)
            assert not asks or monitor(cell).reward() < 1.0
        put(cell)
        assert not asks or monitor(cell).success
        hashes.append(cell.state_hash())
    assert hashes[0] == hashes[1]


def test_snapshot_takes_the_time_of_the_conditions_back() -> None:
    cell = task_cell(ON_TRAY, "  hold_for: 0.2\n")
    put(cell)
    assert not monitor(cell).success
    early = cell.snapshot()
    go(cell, 0.2)
    assert monitor(cell).success
    late, time = cell.snapshot(), monitor(cell).succeeded_at
    cell.restore(early)
    assert monitor(cell).succeeded_at is None
    go(cell, 0.1)
    assert not monitor(cell).success
    cell.restore(late)
    assert monitor(cell).succeeded_at == time
    cell.reset()
    assert not monitor(cell).success
    assert monitor(cell).succeeded_at is None


@pytest.mark.parametrize("success", [ON_TRAY, "{kit: full}", "{held: {part: disk_part, lifted: 0.1}}"])
def test_same_task_in_a_reset_cell(success: str) -> None:
    cell = task_cell(success)
    go(cell, 1.5)
    before = monitor(cell).potential(), cell.state_hash()
    cell.reset()
    go(cell, 1.5)
    assert (monitor(cell).potential(), cell.state_hash()) == before
