"""Fakes of client, eyes and hands, with which the strategy of the kitter works at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

from cellwright.clients.agents.kitter.agreement import Agreement
from cellwright.clients.agents.kitter.arm import KitterArm
from cellwright.clients.agents.kitter.cell_view import CellView
from cellwright.clients.agents.kitter.crew import Worker
from cellwright.clients.agents.kitter.kits import horizontal_distance
from cellwright.clients.agents.kitter.part_figures import Catalogue, Disc
from cellwright.clients.agents.kitter.perception import Sighting, TrackedBeltPart
from cellwright.clients.agents.kitter.pick_and_place import Held, Manipulator
from cellwright.clients.agents.kitter.strategy import Strategy
from cellwright.clients.agents.kitter.supply import Supply
from cellwright.clients.agents.kitter.workplace import Area, BeltPlace, TrayPlace
from cellwright.clients.client import Client
from cellwright.middleware.messages.conversions import pose_message
from cellwright.middleware.messages.osrf_gear import Kit, KitObject, Order
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.places import ARM, BELT, BELT_SPEED, STATIONS, WORKPLACE

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
    allowed: tuple[str, ...] = ()
    """Locations of the stations that all kits have to come from; any if there is none."""
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
        if material not in Catalogue():
            return self.cell.allowed
        return ("belt",) if material in self.belt_types else ("bin7",)

    def control_agv(self, station: str, kit_type: str) -> bool:
        (number,) = (each.number for each in STATIONS.values() if each.name == station)
        if self.cell.agv_refusals > 0:
            self.cell.agv_refusals -= 1
            return False
        self.cell.sent.append((number, kit_type))
        return True

    def control_gripper(self, _enable: bool) -> bool:
        return True


class FakeView:
    workplace = WORKPLACE

    def __init__(self, cell: FakeCell, belt_types: tuple[str, ...] = ()) -> None:
        self.cell = cell
        self.belts = [SimpleNamespace(coming=self._coming, belt=BELT, types=belt_types)]
        self.forget = cell.coming.remove
        self.not_upright: set[str] = set()

    def _coming(self, part_type: str, time: float) -> list[TrackedBeltPart]:
        return [part for part in self.cell.coming if part.type == part_type and part.time_at(BELT.last) > time]

    def look(self, *_areas: Area) -> None:
        self.cell.time += 0.8

    def note_change(self, *_areas: Area) -> None:
        pass

    def watch_stations(self, on: bool) -> None:
        pass

    def is_ready(self, number: int) -> bool:
        return self.cell.time >= self.cell.agv_absent_until and all(sent != number for sent, _ in self.cell.sent)

    def parts_in_bins(self) -> list[Sighting]:
        return list(self.cell.bins)

    def parts_on_tray(self, station: TrayPlace) -> list[Sighting]:
        return [part for part in self.cell.tray if horizontal_distance(part.world_T_part, station.world_T_tray) < 0.5]

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

    def given(self, _part_type: str) -> Held | None:
        return None

    def is_in_reach(self, _part_type: str, _world_T_part: Pose, _rail: float) -> bool:
        return True

    def await_belt(self, _belt: BeltPlace) -> None:
        self.cell.time += 2.0

    def meeting_place(self, part: TrackedBeltPart) -> float | None:
        along = max(part.belt.first, part.place(self.cell.time))
        return None if along > part.belt.last else along

    def departure(self, part: TrackedBeltPart, along: float) -> float:
        return part.time_at(along) - 2.0

    def from_belt(self, part: TrackedBeltPart, along: float) -> Held | None:
        self.cell.time = max(self.cell.time, part.time_at(along)) + 5.0
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
    joints = (0.0,) * 7
    postures = ARM

    def __init__(self, client: FakeClient) -> None:
        self.wait_until = client.wait_until

    def make_way(self) -> None:
        pass

    def can_set_out(self, _time: float, _is_in_vain: Callable[[], bool]) -> bool:
        return True

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
    client, view = FakeClient(cell, orders, belt_types, kits_sent, later), FakeView(cell, belt_types)
    hand = FakeHand(cell)
    hand.bad = ["bad"] * bad
    arm, hands = cast("KitterArm", FakeArm(client)), cast("Manipulator", hand)
    share = Agreement().share()
    supply = Supply(cast("Client", client), cast("CellView", view), arm, hands, share, belt_types)
    Strategy(
        cast("Client", client),
        cast("CellView", view),
        Worker(WORKPLACE, arm, hands, supply, share),
        Catalogue({"cone_part": CONE}),
    ).run()
    return cell


def gears(count: int) -> list[Sighting]:
    return [Sighting("gear_part", flat(-0.5 + 0.1 * index, 0.2)) for index in range(count)]


def belt_part(part_type: str, arrives: float) -> TrackedBeltPart:
    """Return a part that passes y = 1.7 m, where the arm can take it first, at a time [s]."""
    return TrackedBeltPart(part_type, BELT, [flat(1.21, 1.7 + BELT_SPEED * arrives, 0.907)])


def upside_down(part_type: str, x: float, y: float) -> Order:
    """Return an order of one part with its other side up."""
    pose = Pose.from_rpy((x, y, 0.0), (math.pi, 0.0, 0.0))
    return Order("order_0", [Kit("order_0_kit_0", [KitObject(part_type, pose_message(pose))])])


def places(cell: FakeCell) -> list[tuple[float, float]]:
    """Return the places of parts on tray 1, in its frame."""
    found = [(TRAY.inverse() @ part.world_T_part).position for part in cell.tray]
    return sorted((round(x, 3) + 0.0, round(y, 3) + 0.0) for x, y, _ in found)


PULLEY = Sighting("pulley_part", flat(-0.3, 0.2, yaw=0.4))
TURNED_PULLEY = Sighting("pulley_part", flat(-0.3, 0.9, yaw=0.4), is_turned=True)
