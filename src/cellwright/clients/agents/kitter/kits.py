"""Kits: the orders, the places of their parts on the tray, and the inspection of what lies there."""

import logging
import math
from collections.abc import Callable, Iterable, Iterator, Sequence, Set
from dataclasses import dataclass, field
from enum import Enum, auto
from itertools import chain
from typing import TypeAlias

from cellwright.clients.agents.kitter.agreement import Share
from cellwright.clients.agents.kitter.cell_view import CellView
from cellwright.clients.agents.kitter.part_figures import Catalogue, Disc, PartFigures, discs_at
from cellwright.clients.agents.kitter.perception import Sighting
from cellwright.clients.agents.kitter.pick_and_place import pose_on_tray
from cellwright.clients.agents.kitter.workplace import TrayPlace
from cellwright.clients.client import Client
from cellwright.middleware.messages.conversions import pose_from_message
from cellwright.middleware.messages.osrf_gear import KitObject
from cellwright.util.pose import Pose

RIM_GAP = 0.012
"""Distance [m] to a rim of a part that could not go where it was ordered."""

PART_GAP = 0.008
"""Distance [m] of such a part to others."""

NARROW = 0.4
"""Share of these gaps that is enough where the part still counts as in its place."""

IN_PLACE = 0.025
"""Distance [m] from its ordered place at which a part counts as there: 30 mm are allowed."""

Half: TypeAlias = tuple[float, float]
"""Half edge lengths [m] of a tray's plate, along x and y of the tray."""

_GRID_STEP = 0.01
_TURNS = 16

_HAND = ((0.03, 0.05), (0.10, 0.065), (0.145, 0.065))
"""Hand at the side of a part, drawn back: distances [m] of discs behind the side, and their radii [m]."""
_HAND_GAP = 0.01
"""Distance [m] of the hand to rims and other parts."""

STRAY_DISTANCE = 0.05
"""Distance [m] to all placed parts from which something does not belong on the tray."""
SAME_PLACE = 0.06
"""Distance [m] within which a fault belongs to a placed part."""
LOST_DISTANCE = 0.1
"""Distance [m] from its place at which a part was lost."""
MISPLACED = 0.012
MISTURNED = 0.05
"""Distance [m] or angle [rad] from its ordered pose from which a part is out of place."""


@dataclass(frozen=True, slots=True)
class TraySpot:
    """A place on the tray; `is_ordered` if that is the ordered place.

    If the part is to be turned over there, the cup points in a horizontal `direction` [rad] of the tray for that, and
    `tray_T_part` is by the side that is up before.
    """

    tray_T_part: Pose
    is_ordered: bool
    direction: float | None = None


def find_place(
    kind: PartFigures,
    tray_T_goal: Pose,
    half: Half,
    others: Sequence[Disc],
    is_reachable: Callable[[Pose], bool] = lambda _: True,
) -> TraySpot | None:
    """Return a place for a part beside others (in the tray frame); None when there is no room.

    The ordered pose is taken if it keeps the part inside the rims and off the others, however narrowly. Else places on
    a grid of 1 cm are tried from the ordered one outwards, with the ordered yaw first. Where the part still counts as
    in its place, narrower gaps are enough.
    """
    goal = _on_plate(tray_T_goal)
    if fits(kind.covers(goal), half, others, 0.0, 0.0) and is_reachable(goal):
        return TraySpot(goal, is_ordered=True)
    near = list(_candidates(goal, half, turns=1, within=IN_PLACE))
    for share, candidates in ((1.0, near), (NARROW, near), (1.0, _candidates(goal, half))):
        for candidate in candidates:
            gaps = share * RIM_GAP, share * PART_GAP
            if fits(kind.covers(candidate), half, others, *gaps) and is_reachable(candidate):
                return TraySpot(candidate, is_ordered=False)
    return None


def find_turning_spot(
    kind: PartFigures,
    tray_T_goal: Pose,
    half: Half,
    others: Sequence[Disc],
    lying: Sequence[Disc],
    is_reachable: Callable[[Pose, float], bool] = lambda _pose, _direction: True,
) -> TraySpot | None:
    """Return a place to turn a part over, beside `others`, with room for the hand beside those `lying`.

    None if there is none. The ordered place is preferred. Rolled about an axis of direction d, a part of yaw y comes to
    the yaw 2 d - y. So the
    yaw before is chosen such that it comes to the ordered one.
    """
    goal = _on_plate(tray_T_goal)
    hand = [Disc(-(kind.side + along), 0.0, radius) for along, radius in _HAND]
    for place in chain((goal,), _candidates(goal, half, turns=1)):
        is_ordered = place is goal
        rim_gap, part_gap = (0.0, 0.0) if is_ordered else (RIM_GAP, PART_GAP)
        if not fits(kind.covers(place), half, others, rim_gap, part_gap):
            continue
        for step in range(_TURNS):
            direction = 2 * math.pi * step / _TURNS
            x, y, _ = place.position
            if not fits(discs_at(hand, x, y, direction), half, lying, _HAND_GAP, _HAND_GAP):
                continue
            tray_T_part = Pose.from_rpy((x, y, 0.0), (0.0, 0.0, 2 * direction - goal.yaw))
            if is_reachable(tray_T_part, direction):
                return TraySpot(tray_T_part, is_ordered, direction)
    return None


def fits(part: Sequence[Disc], half: Half, others: Sequence[Disc], rim_gap: float, part_gap: float) -> bool:
    """Return whether a part lies inside the rims and beside the others, with gaps [m]; all discs in the tray frame."""
    inside = all(
        abs(disc.x) + disc.radius + rim_gap <= half[0] and abs(disc.y) + disc.radius + rim_gap <= half[1]
        for disc in part
    )
    return inside and all(
        math.hypot(disc.x - other.x, disc.y - other.y) >= disc.radius + other.radius + part_gap
        for disc in part
        for other in others
    )


def _on_plate(tray_T_goal: Pose) -> Pose:
    """Return an ordered pose with the part flat on the plate."""
    return Pose.from_rpy((*tray_T_goal.position[:2], 0.0), (0.0, 0.0, tray_T_goal.yaw))


def _candidates(goal: Pose, half: Half, turns: int = _TURNS, within: float = math.inf) -> Iterator[Pose]:
    """Yield poses all over the tray, nearest to the goal first; all places with the ordered yaw before other yaws.

    Only those nearer to the goal than `within` [m].
    """
    x0, y0, _ = goal.position
    columns, rows = round(half[0] / _GRID_STEP), round(half[1] / _GRID_STEP)
    places = sorted(
        ((_GRID_STEP * i, _GRID_STEP * j) for i in range(-columns, columns + 1) for j in range(-rows, rows + 1)),
        key=lambda place: (round(math.hypot(place[0] - x0, place[1] - y0), 6), place),
    )
    for turn in range(turns):
        # to alternating sides: 0, 1, -1, 2, -2, ...
        steps = (turn + 1) // 2 * (1 if turn % 2 else -1)
        yaw = goal.yaw + steps * 2 * math.pi / _TURNS
        for x, y in places:
            if math.dist((x, y, 0.0), (x0, y0, 0.0)) >= within:
                continue
            yield Pose.from_rpy((x, y, 0.0), (0.0, 0.0, yaw))


@dataclass
class Task:
    """One part of a kit, and its ordered pose by the side that is to be up."""

    type: str
    tray_T_goal: Pose
    is_turned: bool = False
    """True if its other side is to be up."""
    tray_T_part: Pose | None = None
    """Pose on the tray; None until the part lies there."""
    given_up: str = ""
    """Reason why the part is given up; empty while it is not."""
    corrected: bool = False
    """True once its place was corrected."""
    losses: int = 0
    """Losses of its part on the way to the tray, or off it."""

    @property
    def is_open(self) -> bool:
        """True while there is something left to do."""
        return self.tray_T_part is None and not self.given_up


@dataclass
class KitTask:
    """A kit to build on the tray of a station; `order` is the number of its order.

    Only stations whose locations are `allowed` suit it.
    """

    kit_type: str
    tasks: list[Task]
    catalogue: Catalogue
    station: TrayPlace
    allowed: Set[str] = frozenset()
    order: int = 0
    is_begun: bool = False
    """True once the station is that of the kit."""
    begun_at: float = math.inf
    """Time at which its first part was fetched [s]."""
    is_sent: bool = False
    """True once nothing more can be done for it."""
    faulty: list[tuple[str, Pose]] = field(default_factory=list)
    """Type and place on the tray of faulty parts that could not be removed."""
    cleanings: int = 0
    """Removals of parts that did not belong on its tray."""
    sendings: int = 0
    """Requests to the AGV to go."""

    @property
    def open_tasks(self) -> list[Task]:
        """Tasks that are still to be done."""
        return [task for task in self.tasks if task.is_open]

    @property
    def lying(self) -> list[tuple[str, Pose]]:
        """Type and place on the tray of the parts that lie there."""
        return [(task.type, task.tray_T_part) for task in self.tasks if task.tray_T_part is not None]

    def obstacles(self, but: Task) -> list[Disc]:
        """Return the discs of all parts that lie on the tray, except that of `but`."""
        figures = self.catalogue.figures
        others = [(task.type, task.tray_T_part) for task in self.tasks if task is not but and task.tray_T_part]
        return [disc for part_type, place in (*self.faulty, *others) for disc in figures(part_type).covers(place)]

    def taken(self, but: Task) -> list[Disc]:
        """Return the discs of all tasks except `but`: where parts lie, and where open ones were ordered."""
        figures, discs = self.catalogue.figures, self.obstacles(but)
        for task in self.tasks:
            if task is not but and task.type in self.catalogue and task.is_open:
                covered = figures(task.type).covers(_on_plate(task.tray_T_goal))
                if fits(covered, self.station.half, (), 0.0, 0.0):
                    discs += covered
        return discs


log = logging.getLogger(__name__)


class OrderBook:
    """The kits that were ordered since it was made; until it is begun, a kit has the first of the stations."""

    def __init__(self, client: Client, catalogue: Catalogue, stations: Sequence[TrayPlace], share: Share) -> None:
        self._client = client
        self._share = share
        self._stations = stations
        self._catalogue = catalogue
        self._known = 0
        self.kits: list[KitTask] = []
        """All kits ordered so far, sent ones included."""

    def open_kits(self) -> list[KitTask]:
        """Read new orders, and return the kits not yet sent that no other arm builds: the newest order's first."""
        for order in self._client.orders[self._known :]:
            self._known += 1
            for kit in order.kits:
                tasks = [self._task(each) for each in kit.objects]
                known = {each.location for each in self._stations}
                allowed = known.intersection(self._client.material_locations(kit.kit_type)) or known
                self.kits.append(KitTask(kit.kit_type, tasks, self._catalogue, self._stations[0], allowed, self._known))
                types = ", ".join(task.type for task in tasks)
                log.info("%.1f s: ordered: %s of %s", self._client.time, kit.kit_type, types)
                for task in tasks:
                    if task.type not in self._catalogue:
                        task.given_up = self._catalogue.why_not(task.type)
                        log.info("%.1f s: cannot handle a %s: %s", self._client.time, task.type, task.given_up)
        mine = (kit for kit in self.kits if not kit.is_sent and self._share.has_kit(kit.kit_type))
        return sorted(mine, key=lambda kit: -kit.order)

    def _task(self, ordered: KitObject) -> Task:
        tray_T_goal = pose_from_message(ordered.pose)
        self._catalogue.note_order(ordered.type, tray_T_goal)
        return Task(ordered.type, *self._catalogue.side_up(ordered.type, tray_T_goal))


class InspectionResult(Enum):
    """Result of the inspection of a placed part."""

    UNSEEN = auto()
    """No camera looks there."""
    FAULTY = auto()
    LOST = auto()
    OUT_OF_PLACE = auto()
    GOOD = auto()


@dataclass(frozen=True, slots=True)
class Inspection:
    """A verdict, and where the part was seen, if it was: distance [m] and angle [rad] from the ordered pose."""

    verdict: InspectionResult
    world_T_part: Pose | None = None
    offset: float = 0.0
    turn: float = 0.0


def inspect_part(view: CellView, kit: KitTask, task: Task, tray_T_part: Pose, *, is_turned: bool) -> Inspection:
    """Inspect a part that lies on the tray of its kit, by the side that is up. It takes a second."""
    station = kit.station
    expected = pose_on_tray(station, kit.catalogue.figures(task.type), tray_T_part)
    if any(is_near(pose, expected, SAME_PLACE) for pose in view.faulty_on_tray(station.number)):
        return Inspection(InspectionResult.FAULTY)
    if not view.sees(expected):
        return Inspection(InspectionResult.UNSEEN)
    view.look(station.area)
    seen = [
        part.world_T_part
        for part in view.parts_on_tray(station)
        if (part.type, part.is_turned) == (task.type, is_turned)
    ]
    found = min(seen, key=lambda pose: horizontal_distance(pose, expected), default=None)
    if found is None or horizontal_distance(found, expected) > LOST_DISTANCE:
        return Inspection(InspectionResult.LOST)
    offset = horizontal_distance(found, expected)
    turn = abs(math.remainder(found.yaw - expected.yaw, 2 * math.pi))
    is_off = offset > MISPLACED or turn > MISTURNED
    return Inspection(InspectionResult.OUT_OF_PLACE if is_off else InspectionResult.GOOD, found, offset, turn)


def strays(view: CellView, kit: KitTask) -> list[Sighting]:
    """Return the parts on the tray that were not placed there, such as lost ones, from the last look."""
    return [
        part
        for part in view.parts_on_tray(kit.station)
        if not any(is_near(part.world_T_part, pose, STRAY_DISTANCE) for pose in _world_poses(kit, kit.lying))
    ]


def is_known_faulty(kit: KitTask, part: Sighting) -> bool:
    """Return whether a part lies where a faulty one could not be removed."""
    return any(is_near(part.world_T_part, pose, SAME_PLACE) for pose in _world_poses(kit, kit.faulty))


def _world_poses(kit: KitTask, parts: Iterable[tuple[str, Pose]]) -> Iterator[Pose]:
    """Yield world_T_part of parts on the tray of a kit, given by type and place."""
    for part_type, tray_T_part in parts:
        yield pose_on_tray(kit.station, kit.catalogue.figures(part_type), tray_T_part)


def horizontal_distance(one: Pose, other: Pose) -> float:
    """Return the horizontal distance between two origins [m]."""
    return math.hypot(one.position[0] - other.position[0], one.position[1] - other.position[1])


def is_near(one: Pose, other: Pose, distance: float) -> bool:
    """Return whether two origins are within `distance` [m] of each other horizontally."""
    return horizontal_distance(one, other) < distance
