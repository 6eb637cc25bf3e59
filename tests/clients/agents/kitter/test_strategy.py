"""Decisions of the strategy, with fakes of client, eyes and hands."""

from __future__ import annotations

import logging
import math
import re

import pytest

from cellwright.clients.agents.kitter.perception import Sighting, TrackedBeltPart
from cellwright.clients.agents.kitter.strategy import BELT_TIMEOUT, LOST_TIMEOUT, MAX_LOSSES, MAX_SENDINGS
from cellwright.clients.agents.kitter.supply import ATTEMPTS
from cellwright.middleware.messages.osrf_gear import Order
from tests.clients.agents.kitter.fakes import (
    PULLEY,
    TRAY,
    TURNED_PULLEY,
    FakeCell,
    belt_part,
    flat,
    gears,
    kit,
    order,
    places,
    upside_down,
    work,
)
from tests.clients.agents.kitter.places import BELT


def test_kit_is_built_as_ordered_and_sent() -> None:
    cell = work(FakeCell(bins=gears(3)), [order(("gear_part", 0.1, 0.1), ("gear_part", -0.1, 0.1))])
    assert places(cell) == [(-0.1, 0.1), (0.1, 0.1)]
    assert cell.sent == [(1, "order_0_kit_0")]
    assert len(cell.bins) == 1


def test_second_kit_goes_to_other_agv() -> None:
    cell = work(FakeCell(bins=gears(2)), [order(("gear_part", 0.1, 0.1), kits=2)])
    assert cell.sent == [(1, "order_0_kit_0"), (2, "order_0_kit_1")]


def test_failed_grasp_is_retried_at_other_points() -> None:
    cell = work(FakeCell(bins=gears(1), failed_grasps=2), [order(("gear_part", 0.1, 0.1))])
    assert cell.attempts == [0, 1, 2]
    assert places(cell) == [(0.1, 0.1)]


def test_unavailable_part_is_given_up_and_rest_is_sent() -> None:
    cell = work(FakeCell(bins=gears(1)), [order(("disk_part", -0.1, 0.1), ("gear_part", 0.1, 0.1))])
    assert places(cell) == [(0.1, 0.1)]
    assert cell.sent == [(1, "order_0_kit_0")]
    assert LOST_TIMEOUT < cell.time < 30.0, "another one may still roll; nothing more is awaited"


def test_part_that_belt_may_bring_is_awaited_longer() -> None:
    cell = work(FakeCell(bins=gears(1)), [order(("disk_part", -0.1, 0.1), ("gear_part", 0.1, 0.1))], ("disk_part",))
    assert cell.placed == [("gear_part", 2)]
    assert cell.sent == [(2, "order_0_kit_0")]
    assert BELT_TIMEOUT < cell.time < BELT_TIMEOUT + 60.0


def test_belt_part_that_comes_in_the_wait_is_taken() -> None:
    late = belt_part("disk_part", arrives=50.0)
    cell = work(FakeCell(bins=gears(1), coming=[late]), [order(("disk_part", -0.1, 0.1))], ("disk_part",))
    assert cell.placed == [("disk_part", 2)]
    assert cell.time > 50.0


def test_missing_parts_are_logged_at_end_with_reason(caplog: pytest.LogCaptureFixture) -> None:
    announced = order(
        ("cone_part", 0.1, 0.1), ("cone_part", -0.1, 0.1), ("gear_part", 0.1, -0.1), ("disk_part", 0.0, 0.0)
    )
    cell = work(FakeCell(bins=gears(1)), [announced])
    assert places(cell) == [(0.1, -0.1)]
    warnings = [record.getMessage().partition(" s: ")[2] for record in caplog.records if record.levelname == "WARNING"]
    assert warnings == [
        "not brought for order_0_kit_0: 2 cone_part: it has no flat top for the cup",
        "not brought for order_0_kit_0: 1 disk_part: none was seen",
    ]


def test_part_is_given_up_after_all_grasp_attempts() -> None:
    cell = work(FakeCell(bins=gears(1), failed_grasps=100), [order(("gear_part", 0.1, 0.1))])
    assert len(cell.attempts) == ATTEMPTS
    assert cell.sent == [(1, "order_0_kit_0")]


def test_unknown_type_does_not_delay_kit() -> None:
    cell = work(FakeCell(bins=gears(1)), [order(("u_joint_part", -0.1, 0.1), ("gear_part", 0.1, 0.1))])
    assert places(cell) == [(0.1, 0.1)]


def test_belt_part_is_taken_first() -> None:
    disk = TrackedBeltPart("disk_part", BELT, [flat(1.21, 2.0, 0.907)])
    cell = FakeCell(bins=gears(1), coming=[disk])
    work(cell, [order(("gear_part", 0.1, 0.1), ("disk_part", -0.1, 0.1))], ("disk_part",))
    assert [part.type for part in cell.tray] == ["disk_part", "gear_part"]
    assert cell.coming == []


def test_faulty_part_is_thrown_away_and_replaced() -> None:
    cell = work(FakeCell(bins=gears(2)), [order(("gear_part", 0.1, 0.1))], bad=1)
    assert cell.thrown == ["gear_part"]
    assert cell.bins == []
    assert places(cell) == [(0.1, 0.1)]


def test_faulty_part_stuck_on_tray_gets_replacement_beside_it() -> None:
    cell = work(FakeCell(bins=gears(2), failed_removals=ATTEMPTS), [order(("gear_part", 0.1, 0.1))], bad=1)
    assert cell.bins == [], "another one was fetched from a bin"
    assert cell.thrown == ["gear_part"], "in the end there was a hold of the faulty one"
    ((x, y),) = places(cell)
    assert (x - 0.1) ** 2 + (y - 0.1) ** 2 > 0.0784**2, "the other one was put beside it"
    assert cell.sent == [(1, "order_0_kit_0")]


def test_agv_that_refuses_is_requested_again() -> None:
    cell = work(FakeCell(bins=gears(1), agv_refusals=2), [order(("gear_part", 0.1, 0.1))])
    assert cell.sent == [(1, "order_0_kit_0")]


def test_kit_refused_by_agv_does_not_delay_next() -> None:
    cell = work(
        FakeCell(bins=gears(2), agv_refusals=MAX_SENDINGS), [order(("gear_part", 0.1, 0.1), kits=2)], kits_sent=1
    )
    assert cell.sent == [(2, "order_0_kit_1")]


def test_kit_waits_for_absent_agv() -> None:
    cell = work(FakeCell(bins=gears(1), agv_absent_until=200.0), [order(("gear_part", 0.1, 0.1))])
    assert cell.sent == [(1, "order_0_kit_0")]
    assert cell.time > 200.0


def test_misplaced_part_is_corrected_once() -> None:
    cell = work(FakeCell(bins=gears(1), shift=0.025), [order(("gear_part", 0.1, 0.1))])
    assert places(cell) == [(0.1, 0.1)]
    assert len(cell.attempts) == 2


def test_part_lost_over_tray_is_picked_up_again() -> None:
    cell = work(FakeCell(bins=gears(2), losses=1), [order(("gear_part", 0.1, 0.1))])
    assert places(cell) == [(0.1, 0.1)]
    assert len(cell.bins) == 1
    assert cell.thrown == []


def test_stray_part_is_removed_from_tray() -> None:
    stray = Sighting("disk_part", flat(0.3, 3.15, 0.755))
    cell = work(FakeCell(bins=gears(1), tray=[stray]), [order(("gear_part", 0.1, 0.1))])
    assert cell.thrown == ["disk_part"]
    assert [part.type for part in cell.tray] == ["gear_part"]


def test_parts_ordered_off_tray_are_placed_apart_on_it() -> None:
    cell = work(FakeCell(bins=gears(2)), [order(("gear_part", 0.74, -0.14), ("gear_part", 0.73, -0.17))])
    (x0, y0), (x1, y1) = places(cell)
    assert (x0 - x1) ** 2 + (y0 - y1) ** 2 > 0.0784**2
    assert max(x0, x1) < 0.25


def test_incomplete_kit_is_sent_in_time() -> None:
    cell = FakeCell(bins=gears(9), failed_grasps=1000)
    cell.bins = [Sighting("gear_part", flat(-0.5 + 0.06 * i, 0.0 + 0.06 * j)) for i in range(8) for j in range(8)]
    work(cell, [order(("gear_part", 0.1, 0.1))])
    assert cell.sent == [(1, "order_0_kit_0")]
    assert 455.0 < cell.time < 500.0


@pytest.mark.parametrize("orders", [[], [Order("order_0", [])]])
def test_strategy_without_order_sends_nothing(orders: list[Order]) -> None:
    assert work(FakeCell(bins=gears(1)), orders).sent == []


def sides(cell: FakeCell) -> list[tuple[str, bool]]:
    return [(part.type, part.is_turned) for part in cell.tray]


@pytest.mark.parametrize("is_turned", [False, True])
def test_part_with_ordered_side_up_is_not_turned_over(is_turned: bool) -> None:
    announced = upside_down("pulley_part", 0.1, 0.1) if is_turned else order(("pulley_part", 0.1, 0.1))
    cell = work(FakeCell(bins=[PULLEY, TURNED_PULLEY]), [announced])
    assert cell.turns == []
    assert sides(cell) == [("pulley_part", is_turned)]
    assert places(cell) == [(0.1, 0.1)]
    assert cell.bins == [PULLEY if is_turned else TURNED_PULLEY]


@pytest.mark.parametrize("is_turned", [False, True])
def test_part_with_other_side_up_is_turned_over_where_ordered(is_turned: bool) -> None:
    announced = upside_down("pulley_part", 0.1, 0.1) if is_turned else order(("pulley_part", 0.1, 0.1))
    cell = work(FakeCell(bins=[PULLEY if is_turned else TURNED_PULLEY]), [announced])
    assert cell.turns == [(0.1, 0.1)]
    assert sides(cell) == [("pulley_part", is_turned)]
    assert places(cell) == [(0.1, 0.1)]
    yaw = (TRAY.inverse() @ cell.tray[0].world_T_part).yaw
    assert math.remainder(yaw, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
    assert cell.sent == [(1, "order_0_kit_0")]


def test_part_turned_over_elsewhere_is_moved_where_ordered() -> None:
    cell = FakeCell(bins=[PULLEY], has_room_to_turn=lambda x, _y: x < -0.05)
    work(cell, [upside_down("pulley_part", 0.1, 0.1)])
    ((x, _),) = cell.turns
    assert x < -0.05
    assert sides(cell) == [("pulley_part", True)]
    assert places(cell) == [(0.1, 0.1)]
    assert cell.thrown == []


def test_part_whose_side_the_cup_does_not_hold_is_turned_over_again() -> None:
    cell = work(FakeCell(bins=[PULLEY], failed_turns=2), [upside_down("pulley_part", 0.1, 0.1)])
    assert cell.turns == [(0.1, 0.1)]
    assert [part_type for part_type, _ in cell.placed] == ["pulley_part"] * 3
    assert sides(cell) == [("pulley_part", True)]
    assert places(cell) == [(0.1, 0.1)]


def test_part_that_is_never_turned_over_is_given_up(caplog: pytest.LogCaptureFixture) -> None:
    cell = work(FakeCell(bins=[PULLEY], failed_turns=100), [upside_down("pulley_part", 0.1, 0.1)])
    assert len(cell.placed) == MAX_LOSSES
    assert cell.sent == [(1, "order_0_kit_0")]
    assert f"1 pulley_part: it did not stay on the tray, {MAX_LOSSES} times" in caplog.text


def test_part_without_room_to_turn_is_thrown_away() -> None:
    cell = FakeCell(bins=[PULLEY], has_room_to_turn=lambda _x, _y: False)
    work(cell, [upside_down("pulley_part", 0.1, 0.1)])
    assert (cell.thrown, cell.tray, cell.turns) == (["pulley_part"], [], [])
    assert cell.sent == [(1, "order_0_kit_0")]


def test_faulty_part_is_not_turned_over() -> None:
    other = Sighting("pulley_part", flat(-0.3, 0.6))
    cell = work(FakeCell(bins=[PULLEY, other]), [upside_down("pulley_part", 0.1, 0.1)], bad=1)
    assert cell.thrown == ["pulley_part"]
    assert cell.turns == [(0.1, 0.1)], "only the good one"
    assert sides(cell) == [("pulley_part", True)]


def test_newest_order_is_built_first_and_then_the_former() -> None:
    disk = Sighting("disk_part", flat(-0.3, 0.9))
    first, second = order(("gear_part", 0.1, 0.1), ("gear_part", -0.1, 0.1)), order(("disk_part", 0.0, 0.0), name="new")
    cell = work(FakeCell(bins=[*gears(2), disk]), [first], later=((8.0, second),))
    assert cell.placed == [("gear_part", 1), ("disk_part", 2), ("gear_part", 1)]
    assert cell.sent == [(2, "new_kit_0"), (1, "order_0_kit_0")]


def test_wait_for_belt_part_is_filled_with_kit_on_other_agv() -> None:
    kits = [kit("awaited", ("disk_part", 0.1, 0.1)), kit("other", ("gear_part", 0.1, 0.1), ("gear_part", -0.1, 0.1))]
    cell = FakeCell(bins=gears(2), coming=[belt_part("disk_part", arrives=50.0)])
    work(cell, [Order("order_0", kits)], ("disk_part",))
    agvs = {name: number for number, name in cell.sent}
    assert sorted(agvs.values()) == [1, 2]
    assert cell.placed == [("gear_part", agvs["other"]), ("gear_part", agvs["other"]), ("disk_part", agvs["awaited"])]
    assert [name for _, name in cell.sent] == ["other", "awaited"]


def test_time_to_build_a_kit_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "cellwright.clients.agents.kitter")
    cell = FakeCell(bins=gears(1), coming=[belt_part("disk_part", arrives=50.0)])
    kits = [kit("awaited", ("disk_part", 0.1, 0.1)), kit("other", ("gear_part", 0.1, 0.1))]
    work(cell, [Order("order_0", kits)], ("disk_part",))
    found = re.findall(r"(\w+) took ([\d.]+) s to build", caplog.text)
    assert [name for name, _ in found] == ["other", "awaited"]
    assert all(10.0 < float(seconds) < 25.0 for _, seconds in found), "from the first part on, without the wait for it"
