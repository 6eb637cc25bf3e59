"""Decisions of the agent, with fakes of client, eyes and hands."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import pytest

from cellwright.clients.agents.kitter.agent import ATTEMPTS, MAX_SENDINGS, Strategy
from cellwright.clients.agents.kitter.arm import KitterArm
from cellwright.clients.agents.kitter.cell_view import CellView
from cellwright.clients.agents.kitter.kits import horizontal_distance
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.perception import Area, Sighting, TrackedBeltPart
from cellwright.clients.agents.kitter.pick_and_place import STATIONS, Held, Manipulator
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
    time: float = 0.0


class FakeClient:
    """Time passes at once; the competition is over when every kit was sent."""

    def __init__(
        self, cell: FakeCell, orders: list[Order], belt_types: tuple[str, ...] = (), kits_sent: int | None = None
    ) -> None:
        self.cell = cell
        self.all_kits = sum(len(order.kits) for order in orders) if kits_sent is None else kits_sent
        self.orders = orders
        self.belt_types = belt_types
        self.statuses: list[str] = []

    def set_status(self, text: str) -> None:
        self.statuses.append(text)

    @property
    def time(self) -> float:
        return self.cell.time

    @property
    def competition_state(self) -> str:
        return "done" if len(self.cell.sent) == self.all_kits else "go"

    def sleep(self, duration: float) -> None:
        self.cell.time += duration

    def wait_until(self, condition: Any, timeout: float | None = None) -> bool:
        if not condition():
            self.cell.time += 1.0 if timeout is None else timeout
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

    def _coming(self, part_type: str, _time: float, _y: float) -> list[TrackedBeltPart]:
        return [part for part in self.cell.coming if part.type == part_type]

    def look(self, *_areas: Area) -> None:
        self.cell.time += 0.8

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

    def from_rest(self, part_type: str, world_T_part: Pose, _rail: float, *, attempt: int = 0) -> Held | None:
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
        return Held(part_type, flat(0.0, 0.0, -0.02))

    def is_in_reach(self, _part_type: str, _world_T_part: Pose, _rail: float) -> bool:
        return True

    def meeting_place(self, _part: TrackedBeltPart, first: float, _last: float) -> float | None:
        return first

    def from_belt(self, part: TrackedBeltPart, _y: float) -> Held | None:
        self.cell.time += 5.0
        return Held(part.type, flat(0.0, 0.0, -0.02))

    def put_down(self, held: Held, world_T_part: Pose, _rail: float) -> bool:
        cell = self.cell
        cell.time += 5.0
        if cell.losses > 0:
            cell.losses -= 1
            cell.tray.append(Sighting(held.type, flat(0.3, 3.15, 0.755)))
            return False
        x, y, _ = world_T_part.position
        pose = flat(x + cell.shift, y, 0.755, world_T_part.yaw)
        cell.shift = 0.0
        cell.tray.append(Sighting(held.type, pose))
        if self.bad:
            self.bad.pop()
            cell.faulty.append(pose)
        return True

    def throw_away(self, held: Held) -> None:
        self.cell.thrown.append(held.type)

    def let_go(self) -> None:
        pass


class FakeArm:
    joints = SimpleNamespace(rail=0.0)

    def reaches(self, _goal: Pose, _rail: float) -> bool:
        return True

    def travel(self, _goal: Pose, _rail: float) -> bool:
        return True


def order(*parts: tuple[str, float, float], kits: int = 1) -> Order:
    objects = [KitObject(kind, pose_message(flat(x, y, 0.0))) for kind, x, y in parts]
    return Order("order_0", [Kit(f"order_0_kit_{number}", list(objects)) for number in range(kits)])


def work(
    cell: FakeCell, orders: list[Order], belt_types: tuple[str, ...] = (), bad: int = 0, kits_sent: int | None = None
) -> FakeCell:
    """Let the strategy work until `kits_sent` kits were sent, by default all."""
    client, view = FakeClient(cell, orders, belt_types, kits_sent), FakeView(cell)
    hand = FakeHand(cell)
    hand.bad = ["bad"] * bad
    Strategy(
        cast("Client", client),
        cast("CellView", view),
        cast("KitterArm", FakeArm()),
        cast("Manipulator", hand),
        Catalogue({"cone_part": CONE}),
    ).run()
    return cell


def gears(count: int) -> list[Sighting]:
    return [Sighting("gear_part", flat(-0.5 + 0.1 * index, 0.2)) for index in range(count)]


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
    assert 60.0 < cell.time < 120.0


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
    assert cell.sent == [(1, "order_0_kit_1")]


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
