"""Decisions of the agent, with fakes of client, eyes and hands."""

from __future__ import annotations

import logging
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import pytest

from cellwright.clients.agents.kitter.agent import BELT_TIMEOUT, LOST_TIMEOUT, MAX_LOSSES, MAX_SENDINGS, Strategy
from cellwright.clients.agents.kitter.arm import KitterArm
from cellwright.clients.agents.kitter.cell_view import CellView
from cellwright.clients.agents.kitter.kits import horizontal_distance
from cellwright.clients.agents.kitter.part_figures import Catalogue, Disc
from cellwright.clients.agents.kitter.perception import BELT_SPEED, Area, Sighting, TrackedBeltPart
from cellwright.clients.agents.kitter.pick_and_place import STATIONS, Held, Manipulator
from cellwright.clients.agents.kitter.supply import ATTEMPTS
from cellwright.clients.client import Client
from cellwright.middleware.messages.conversions import pose_message
from cellwright.middleware.messages.osrf_gear import Kit, KitObject, Order
from cellwright.util.pose import Pose

TRAY = STATIONS[1].world_T_tray


def flat(x: float, y: float, z: float = 0.725, yaw: float = 0.0) -> Pose:
    return Pose.from_rpy((x, y, z), (0.0, 0.0, yaw))


@dataclass
class FakeCell:
    """A cell of a few numbers: parts lie in places, and hands move them at once."""

    bins: list[Sighting] = field(default_factory=list)
    tray: list[Sighting] = field(default_factory=list)
    coming: list[TrackedBeltPart] = field(default_factory=list)
    faulty: list[Pose] = field(default_factory=list)
    failed_grasps: int = 0
    """Number of grasps that fail, from the next on."""
    losses: int = 0
    """Number of parts that are lost on the way, from the next on: they fall on the tray's middle."""
    shift: float = 0.0
    """Distance of the next part from its place [m]."""
    thrown: list[str] = field(default_factory=list)
    sent: list[tuple[int, str]] = field(default_factory=list)
    attempts: list[int] = field(default_factory=list)
    failed_removals: int = 0
    """Number of failed attempts to take something off a tray, from the next on."""
    agv_refusals: int = 0
    """Number of requests that an AGV ignores, from the next on."""
    agv_absent_until: float = 0.0
    """Time [s] until which no AGV is there."""
    failed_turns: int = 0
    """Number of parts that the cup does not hold by their side, from the next on."""
    turns: list[tuple[float, float]] = field(default_factory=list)
    """Places on tray 1 where parts were turned over."""
    has_room_to_turn: Callable[[float, float], bool] = lambda _x, _y: True
    """Tells of a place on tray 1 whether the arm reaches it to turn a part over."""
    placed: list[tuple[str, int]] = field(default_factory=list)
    """Type and AGV of each part that was put down."""
    time: float = 0.0


class FakeClient:
    """Time passes at once; the competition is over when every kit was sent."""

    def __init__(
        self,
        cell: FakeCell,
        orders: list[Order],
        belt_types: tuple[str, ...] = (),
        kits_sent: int | None = None,
        later: tuple[tuple[float, Order], ...] = (),
    ) -> None:
        self.cell = cell
        announced = [*orders, *(order for _, order in later)]
        self.all_kits = sum(len(order.kits) for order in announced) if kits_sent is None else kits_sent
        self.first_orders = orders
        self.later = later
        self.belt_types = belt_types
        self.statuses: list[str] = []

    def set_status(self, text: str) -> None:
        self.statuses.append(text)

    @property
    def time(self) -> float:
        return self.cell.time

    @property
    def orders(self) -> list[Order]:
        return [*self.first_orders, *(order for time, order in self.later if self.time >= time)]

    @property
    def competition_state(self) -> str:
        return "done" if len(self.cell.sent) == self.all_kits else "go"

    def sleep(self, duration: float) -> None:
        self.cell.time += duration

    def wait_until(self, condition: Any, timeout: float | None = None) -> bool:
        end = self.cell.time + (1000.0 if timeout is None else timeout)
        while not condition() and self.cell.time < end:
            self.cell.time = min(end, self.cell.time + 1.0)
        return bool(condition())

    def material_locations(self, material: str) -> tuple[str, ...]:
        return ("belt",) if material in self.belt_types else ("bin7",)

    def control_agv(self, number: int, kit_type: str) -> bool:
        if self.cell.agv_refusals > 0:
            self.cell.agv_refusals -= 1
            return False
        self.cell.sent.append((number, kit_type))
        return True

    def control_gripper(self, _enable: bool) -> bool:
        return True


class FakeView:
    def __init__(self, cell: FakeCell) -> None:
        self.cell = cell
        self.belt = SimpleNamespace(coming=self._coming, forget=cell.coming.remove)
        self.not_upright: set[str] = set()

    def _coming(self, part_type: str, time: float, y: float) -> list[TrackedBeltPart]:
        return [part for part in self.cell.coming if part.type == part_type and part.time_at(y) > time]

    def look(self, *_areas: Area) -> None:
        self.cell.time += 0.8

    def note_change(self, *_areas: Area) -> None:
        pass

    def watch_agvs(self, on: bool) -> None:
        pass

    def is_agv_ready(self, number: int) -> bool:
        return self.cell.time >= self.cell.agv_absent_until and all(sent != number for sent, _ in self.cell.sent)

    def parts_in_bins(self) -> list[Sighting]:
        return list(self.cell.bins)

    def parts_on_tray(self, world_T_tray: Pose) -> list[Sighting]:
        return [part for part in self.cell.tray if horizontal_distance(part.world_T_part, world_T_tray) < 0.5]

    def faulty_on_tray(self, _number: int) -> tuple[Pose, ...]:
        return tuple(self.cell.faulty)

    def sees(self, _pose: Pose) -> bool:
        return True


CONE = {
    "mass": 0.2,
    "tops": [
        {
            "turn": [1.0, 0.0, 0.0, 0.0],
            "centre_of_mass": [0.0, 0.0, 0.01],
            "lower": [-0.03, -0.03, 0.0],
            "upper": [0.03, 0.03, 0.04],
            "radius": 0.03,
            "spots": [],
        }
    ],
}


class FakeHand:
    def __init__(self, cell: FakeCell) -> None:
        self.cell = cell
        self.bad: list[str] = []

    def from_rest(
        self,
        part_type: str,
        world_T_part: Pose,
        _rail: float,
        *,
        is_turned: bool = False,
        attempt: int = 0,
        neighbours: Sequence[Disc] = (),
    ) -> Held | None:
        cell = self.cell
        cell.time += 5.0
        cell.attempts.append(attempt)
        if cell.failed_grasps > 0:
            cell.failed_grasps -= 1
            return None
        if cell.failed_removals > 0 and abs(world_T_part.position[1]) > 2.0:
            cell.failed_removals -= 1
            return None
        for lying in (cell.bins, cell.tray):
            lying[:] = [part for part in lying if horizontal_distance(part.world_T_part, world_T_part) > 0.01]
        cell.faulty = [pose for pose in cell.faulty if horizontal_distance(pose, world_T_part) > 0.01]
        return Held(part_type, flat(0.0, 0.0, -0.02), is_turned)

    def is_in_reach(self, _part_type: str, _world_T_part: Pose, _rail: float) -> bool:
        return True

    def meeting_place(self, part: TrackedBeltPart, first: float, last: float) -> float | None:
        y = min(first, part.pose(self.cell.time).position[1])
        return None if y < last else y

    def from_belt(self, part: TrackedBeltPart, y: float) -> Held | None:
        self.cell.time = max(self.cell.time, part.time_at(y)) + 5.0
        return Held(part.type, flat(0.0, 0.0, -0.02), part.is_turned)

    def can_put_down(self, _held: Held, _world_T_part: Pose, _rail: float) -> bool:
        return True

    def put_down(
        self, held: Held, world_T_part: Pose, _rail: float, on_release: Callable[[], None] = lambda: None
    ) -> bool:
        cell = self.cell
        cell.time += 5.0
        if cell.losses > 0:
            cell.losses -= 1
            cell.tray.append(Sighting(held.type, flat(0.3, 3.15, 0.755)))
            return False
        x, y, _ = world_T_part.position
        pose = flat(x + cell.shift, y, 0.755, world_T_part.yaw)
        cell.shift = 0.0
        cell.tray.append(Sighting(held.type, pose, held.is_turned))
        cell.placed.append((held.type, 1 if y > 0.0 else 2))
        on_release()
        if self.bad:
            self.bad.pop()
            cell.faulty.append(pose)
        return True

    def can_turn_over(self, _part_type: str, world_T_part: Pose, _direction: float, _rail: float) -> bool:
        x, y, _ = TRAY.inverse().transform(world_T_part.position)
        return self.cell.has_room_to_turn(x, y)

    def turn_over(
        self,
        _part_type: str,
        world_T_part: Pose,
        direction: float,
        _rail: float,
        on_release: Callable[[], None] = lambda: None,
    ) -> bool:
        cell = self.cell
        cell.time += 10.0
        on_release()
        if cell.failed_turns > 0:
            cell.failed_turns -= 1
            return False
        (part,) = [each for each in cell.tray if horizontal_distance(each.world_T_part, world_T_part) < 0.01]
        x, y, z = part.world_T_part.position
        after = flat(x, y, z, 2 * direction - part.world_T_part.yaw)
        cell.tray[cell.tray.index(part)] = Sighting(part.type, after, not part.is_turned)
        on_tray = (TRAY.inverse() @ after).position
        cell.turns.append((round(on_tray[0], 3) + 0.0, round(on_tray[1], 3) + 0.0))
        return True

    def throw_away(self, held: Held) -> None:
        self.cell.thrown.append(held.type)

    def let_go(self) -> None:
        pass


class FakeArm:
    joints = SimpleNamespace(rail=0.0)

    def travel(self, _goal: Pose, _rail: float) -> bool:
        return True


def kit(name: str, *parts: tuple[str, float, float]) -> Kit:
    return Kit(name, [KitObject(kind, pose_message(flat(x, y, 0.0))) for kind, x, y in parts])


def order(*parts: tuple[str, float, float], kits: int = 1, name: str = "order_0") -> Order:
    return Order(name, [kit(f"{name}_kit_{number}", *parts) for number in range(kits)])


def work(
    cell: FakeCell,
    orders: list[Order],
    belt_types: tuple[str, ...] = (),
    bad: int = 0,
    kits_sent: int | None = None,
    later: tuple[tuple[float, Order], ...] = (),
) -> FakeCell:
    """Let the strategy work until `kits_sent` kits were sent, by default all; orders come `later` at a time [s]."""
    client, view = FakeClient(cell, orders, belt_types, kits_sent, later), FakeView(cell)
    hand = FakeHand(cell)
    hand.bad = ["bad"] * bad
    Strategy(
        cast("Client", client),
        cast("CellView", view),
        cast("KitterArm", FakeArm()),
        cast("Manipulator", hand),
        Catalogue({"cone_part": CONE}),
        belt_types,
    ).run()
    return cell


def gears(count: int) -> list[Sighting]:
    return [Sighting("gear_part", flat(-0.5 + 0.1 * index, 0.2)) for index in range(count)]


def belt_part(part_type: str, arrives: float) -> TrackedBeltPart:
    """Return a part that passes y = 1.7 m, where the arm can take it first, at a time [s]."""
    return TrackedBeltPart(part_type, [flat(1.21, 1.7 + BELT_SPEED * arrives, 0.907)])


def upside_down(part_type: str, x: float, y: float) -> Order:
    """Return an order of one part with its other side up."""
    pose = Pose.from_rpy((x, y, 0.0), (math.pi, 0.0, 0.0))
    return Order("order_0", [Kit("order_0_kit_0", [KitObject(part_type, pose_message(pose))])])


def places(cell: FakeCell) -> list[tuple[float, float]]:
    """Return the places of parts on tray 1, in its frame."""
    found = [(TRAY.inverse() @ part.world_T_part).position for part in cell.tray]
    return sorted((round(x, 3) + 0.0, round(y, 3) + 0.0) for x, y, _ in found)


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
    disk = TrackedBeltPart("disk_part", [flat(1.21, 2.0, 0.907)])
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


PULLEY = Sighting("pulley_part", flat(-0.3, 0.2, yaw=0.4))
TURNED_PULLEY = Sighting("pulley_part", flat(-0.3, 0.9, yaw=0.4), is_turned=True)


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


def test_time_to_build_a_kit_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "cellwright.clients.agents.kitter")
    cell = FakeCell(bins=gears(1), coming=[belt_part("disk_part", arrives=50.0)])
    kits = [kit("awaited", ("disk_part", 0.1, 0.1)), kit("other", ("gear_part", 0.1, 0.1))]
    work(cell, [Order("order_0", kits)], ("disk_part",))
    found = re.findall(r"(\w+) took ([\d.]+) s to build", caplog.text)
    assert [name for name, _ in found] == ["other", "awaited"]
    assert all(10.0 < float(seconds) < 25.0 for _, seconds in found), "from the first part on, without the wait for it"
