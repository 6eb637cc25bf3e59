"""Choices of the kitter: the AGV of a kit, the next part, and a part to keep."""

from __future__ import annotations

import math

import pytest

from cellwright.clients.agents.kitter.choice import KEEPING_HORIZON
from cellwright.clients.agents.kitter.perception import Sighting
from cellwright.middleware.messages.conversions import pose_message
from cellwright.middleware.messages.osrf_gear import Kit, KitObject, Order
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.fakes import PULLEY, FakeCell, belt_part, flat, gears, order, work
from tests.clients.agents.kitter.places import STATIONS


def test_kit_with_part_from_belt_alone_goes_to_agv_2() -> None:
    """There are drop regions beside AGV 1: what falls there does not come again."""
    cell = FakeCell(coming=[belt_part("disk_part", arrives=5.0)])
    work(cell, [order(("disk_part", 0.1, 0.1))], ("disk_part",))
    assert cell.sent == [(2, "order_0_kit_0")]


def test_kit_goes_to_agv_near_its_parts() -> None:
    cell = work(FakeCell(bins=[Sighting("gear_part", flat(-0.3, -0.4))]), [order(("gear_part", 0.1, 0.1))])
    assert cell.sent == [(2, "order_0_kit_0")]


def test_unordered_belt_part_is_kept_on_other_tray_and_used() -> None:
    cell = FakeCell(bins=gears(1), coming=[belt_part("disk_part", arrives=15.0), belt_part("disk_part", arrives=20.0)])
    later = order(("disk_part", 0.1, 0.1), name="new")
    work(cell, [order(("gear_part", 0.1, 0.1))], ("disk_part",), later=((60.0, later),))
    assert cell.placed == [("gear_part", 1), ("disk_part", 2), ("disk_part", 2)]
    assert cell.sent == [(1, "order_0_kit_0"), (2, "new_kit_0")]
    (disk,) = [part for part in cell.tray if part.type == "disk_part"]
    there = STATIONS[2].world_T_tray.inverse() @ disk.world_T_part
    assert there.position[:2] == pytest.approx((0.1, 0.1))
    assert len(cell.coming) == 1, "one of each type is kept"
    assert cell.thrown == []


def test_belt_part_that_comes_late_is_not_kept() -> None:
    cell = FakeCell(bins=gears(1), coming=[belt_part("disk_part", arrives=40.0)])
    work(cell, [order(("gear_part", 0.1, 0.1))], ("disk_part",))
    assert cell.placed == [("gear_part", 1)]
    assert cell.time < 30.0


def test_type_that_bins_have_is_not_kept() -> None:
    cell = FakeCell(bins=gears(1), coming=[belt_part("disk_part", arrives=15.0)])
    work(cell, [order(("gear_part", 0.1, 0.1))])
    assert cell.placed == [("gear_part", 1)]


@pytest.mark.parametrize(("count", "first"), [(1, "disk_part"), (2, "gear_part")])
def test_part_without_another_to_spare_is_fetched_first(count: int, first: str) -> None:
    """If it is dropped on the tray, it lies flat while the tray is empty."""
    near = [Sighting("gear_part", flat(-0.3, 0.9 + 0.1 * index)) for index in range(2)]
    far = [Sighting("disk_part", flat(-0.3, 0.2 + 0.2 * index)) for index in range(count)]
    cell = work(FakeCell(bins=[*near, *far]), [order(("gear_part", 0.1, 0.1), ("disk_part", -0.1, 0.1))])
    assert cell.sent == [(1, "order_0_kit_0")]
    assert cell.placed[0] == (first, 1)


def test_part_to_be_turned_over_is_fetched_first() -> None:
    parts = [KitObject("gear_part", pose_message(flat(0.15, -0.2, 0.0)))]
    parts.append(KitObject("pulley_part", pose_message(Pose.from_rpy((0.0, 0.1, 0.0), (math.pi, 0.0, 0.0)))))
    cell = FakeCell(bins=[PULLEY, Sighting("gear_part", flat(-0.3, 0.9))])
    work(cell, [Order("order_0", [Kit("order_0_kit_0", parts)])])
    assert [part_type for part_type, _ in cell.placed] == ["pulley_part", "gear_part"]


def test_part_kept_on_a_tray_outweighs_the_way_of_the_rail() -> None:
    kept = Sighting("gear_part", STATIONS[1].world_T_tray @ flat(0.1, 0.1, 0.0))
    near_2 = Sighting("disk_part", flat(-0.3, -0.4))
    ordered = order(("gear_part", 0.1, 0.1), ("disk_part", -0.1, 0.1))
    cell = work(FakeCell(bins=[near_2], tray=[kept]), [ordered])
    assert cell.sent == [(1, "order_0_kit_0")]


@pytest.mark.parametrize(("arrives", "is_kept"), [(12.0, True), (12.0 + KEEPING_HORIZON + 20.0, False)])
def test_part_is_kept_only_within_its_horizon(arrives: float, is_kept: bool) -> None:
    cell = FakeCell(bins=gears(1), coming=[belt_part("disk_part", arrives)])
    work(cell, [order(("gear_part", 0.1, 0.1))], ("disk_part",))
    assert ("disk_part", 2) in cell.placed if is_kept else cell.placed == [("gear_part", 1)]
