"""Cancelled goals of the arm's action, also those that are cancelled before they come."""

from __future__ import annotations

import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.interface.action_server import MAX_PUBLISHED, MAX_REMEMBERED
from cellwright.engine.clock import NANOSECONDS
from cellwright.engine.snapshot import restore_snapshot, take_snapshot
from cellwright.middleware.messages.conversions import nanoseconds
from cellwright.util.errors import RejectedCommandError
from tests.cell.interface.goals import (
    ACTIVE,
    FAR,
    NEAR,
    PREEMPTED,
    RECALLED,
    RECALLING,
    SUCCEEDED,
    Client,
    arm_cell,
    cancel,
    hashes_of,
    send,
    velocity,
)
from tests.support.cells import ARM_ONLY, INITIAL, run, run_to, way


def rail(cell: Cell) -> float:
    assert cell.arm is not None
    return cell.arm.read().positions[0]


def test_goal_that_was_cancelled_before_it_came_is_recalled() -> None:
    cell, client = arm_cell()
    cancel(cell, "mine")
    assert client.statuses() == {"mine": RECALLING}
    run(cell, 4.9)
    before = rail(cell)
    send(cell, way(FAR), "mine", given=7)
    assert client.results() == [("mine", RECALLED, 0)]
    assert nanoseconds(client.result.messages[0].status.goal_id.stamp) == 7
    assert client.statuses() == {"mine": RECALLED}
    run(cell, 1.0)
    assert rail(cell) == pytest.approx(before, abs=1e-6)
    with pytest.raises(RejectedCommandError, match="send another id"):
        send(cell, way(FAR), "mine")


def test_recalled_goal_need_not_be_valid() -> None:
    cell, client = arm_cell()
    cancel(cell, "bad")
    send(cell, way(FAR[:3]), "bad")
    assert client.results() == [("bad", RECALLED, 0)]
    assert cell.bus.refusals.total == 0


def test_cancel_is_forgotten_after_5_s_without_its_goal() -> None:
    cell, client = arm_cell()
    cancel(cell, "mine")
    run(cell, 5.1)
    send(cell, way(NEAR), "mine")
    assert client.statuses() == {"mine": ACTIVE}


def test_cancel_of_next_goal_while_older_one_is_active_is_remembered() -> None:
    cell, client = arm_cell()
    send(cell, way(NEAR), "older")
    run(cell, 0.3)
    cancel(cell, "next")
    send(cell, way(FAR), "next")
    assert client.results() == [("next", RECALLED, 0)]
    run(cell, 1.5)
    assert client.results()[1:] == [("older", SUCCEEDED, 0)]


@pytest.mark.parametrize("name", ["", "another"])
def test_goal_stamped_up_to_last_cancel_is_recalled(name: str) -> None:
    cell, client = arm_cell()
    cancel(cell, name, until=500)
    cancel(cell, name, until=300)  # an earlier one shortens nothing
    send(cell, way(FAR), "early", given=400)
    send(cell, way(FAR), "same time", given=500)
    assert [(each, RECALLED, 0) for each in ("early", "same time")] == client.results()
    send(cell, way(FAR), "without a stamp")
    send(cell, way(FAR), "later", given=501)
    assert client.results()[2:] == [("without a stamp", PREEMPTED, 0)]
    assert client.statuses()["later"] == ACTIVE


def test_cancel_of_everything_spares_goals_that_come_later() -> None:
    cell, client = arm_cell()
    cancel(cell)
    send(cell, way(NEAR), "mine", given=1)
    assert client.statuses() == {"mine": ACTIVE}


def test_flood_of_cancels_is_refused_and_keeps_earlier_ones() -> None:
    cell, client = arm_cell()
    for number in range(MAX_REMEMBERED):
        cancel(cell, f"goal {number}")
    with pytest.raises(RejectedCommandError, match="at most 1000 goals may be cancelled before they arrive"):
        cancel(cell, "one more")
    assert len(client.statuses()) == MAX_PUBLISHED
    for number in range(200):
        with pytest.raises(RejectedCommandError):
            send(cell, way(FAR[:3]), f"bad {number}")
    send(cell, way(FAR), "goal 0")
    assert client.results()[-1] == ("goal 0", RECALLED, 0)


def test_cancel_with_id_that_no_goal_may_have_is_refused() -> None:
    cell, client = arm_cell()
    with pytest.raises(RejectedCommandError, match="at most 255 characters"):
        cancel(cell, "x" * 256)
    assert cell.bus.refusals.total == 1
    assert len(client.status) == 0 or client.statuses() == {}


def test_restored_run_remembers_cancellations() -> None:
    cell, _ = arm_cell()
    run(cell, 1.0)
    cancel(cell, "mine", until=NANOSECONDS // 2)
    moment = take_snapshot(cell.simulation)
    other, without = Cell(ARM_ONLY), Cell(ARM_ONLY)
    run(without, 1.0)
    assert without.state_hash() != cell.state_hash()  # what a goal will do is state
    restore_snapshot(other.simulation, moment)
    heard = Client(other)
    for each in (cell, other):
        send(each, way(FAR), "mine")
        send(each, way(FAR), "early", given=NANOSECONDS // 2)
        run_to(each, 1.5)
    assert heard.results() == [("mine", RECALLED, 0), ("early", RECALLED, 0)]
    assert hashes_of((cell, other)) == {cell.state_hash()}
    cell.reset()
    send(cell, way(FAR), "mine", given=NANOSECONDS // 2)
    assert rail(cell) == pytest.approx(INITIAL[0], abs=1e-3)
    run(cell, 1.5)
    assert rail(cell) == pytest.approx(FAR[0], abs=0.02)


@pytest.mark.parametrize(
    ("name", "until"),
    [("mine", 0), ("", 0), ("", 500_000_000), ("unheard of", 600_000_000)],
    ids=["by name", "everything", "all up to its time", "all up to a later time"],
)
def test_cancelled_goal_stops_arm(name: str, until: int) -> None:
    cell, client = arm_cell()
    send(cell, way(FAR), "mine", given=500_000_000)
    run(cell, 0.6)
    assert velocity(cell) > 0.3
    cancel(cell, name, until)
    assert client.results() == [("mine", PREEMPTED, 0)]
    assert client.statuses()["mine"] == PREEMPTED
    run(cell, 0.5)
    assert velocity(cell) == 0.0
    assert len(client.feedback) == 6


@pytest.mark.parametrize(("name", "until"), [("another", 0), ("", 499_999_999), ("another", 499_999_999)])
def test_cancel_of_other_goal_stops_nothing(name: str, until: int) -> None:
    cell, client = arm_cell()
    send(cell, way(NEAR), "mine", given=500_000_000)
    run(cell, 0.6)
    cancel(cell, name, until)
    run(cell, 1.0)
    assert client.results() == [("mine", SUCCEEDED, 0)]
