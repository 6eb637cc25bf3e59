"""Attainable score of a trial before anything has moved, with the reason for each unattainable point.

A point is unattainable only if that is certain, so the result is an upper bound:

- A part earns points for its pose when it touches the tray's plate with its origin at most `MAX_DISTANCE` from its
  place. If the place lies further off the plate than that distance plus the part's radius, no part can. Of several
  trays that the kit may be built on, the one whose plate is nearest to the place counts.
- Presence and bonus are attainable only if the cell has good parts of the type. Each kit is examined alone: two kits
  may count on the same part.
- A cell without AGVs has no tray, and an order that starts after the time limit is never announced.
"""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

from cellwright.cell.kitting.inventory import trimmed_name
from cellwright.cell.kitting.kit_score import BONUS_POINTS, MAX_DISTANCE, POSE_POINTS, PRESENCE_POINTS
from cellwright.cell.kitting.referee import Announcements
from cellwright.config.footprints import PART_RADII
from cellwright.config.trial.trial import Kit, Order, Trial
from cellwright.util.pose import Pose

Plate: TypeAlias = tuple[float, float]
"""Edge lengths of a tray's plate [m]."""


@dataclass(frozen=True, slots=True)
class AttainablePart:
    """Attainable points of one ordered part.

    Attributes:
        off_plate: distance of its place from the tray's plate [m]; 0 on it.
        nearest: smallest distance from its place to the origin of a part that touches the plate [m].
        is_supplied: True if the cell has a good part for it.
        plate: the plate that its place is nearest to.
    """

    type: str
    tray_T_goal: Pose
    off_plate: float
    nearest: float
    is_supplied: bool
    plate: Plate

    @property
    def plate_size(self) -> str:
        """Size of the plate, for readers."""
        return f"{self.plate[0]:g} x {self.plate[1]:g} m"

    @property
    def is_off_tray(self) -> bool:
        """True if no part can touch the plate and lie near enough to the place."""
        return self.nearest > MAX_DISTANCE

    @property
    def presence(self) -> float:
        """Largest possible points for presence."""
        return PRESENCE_POINTS if self.is_supplied else 0.0

    @property
    def pose(self) -> float:
        """Largest possible points for pose."""
        return POSE_POINTS if self.is_supplied and not self.is_off_tray else 0.0

    def reason(self) -> str:
        """Reason why points of the part are unattainable, in one sentence; empty if all are attainable."""
        if not self.is_supplied:
            return f"the cell has too few good parts of type {self.type}"
        if not self.is_off_tray:
            return ""
        x, y = self.tray_T_goal.position[:2]
        return (
            f"its place ({x:g}, {y:g}) lies {self.off_plate:.2f} m off the tray "
            f"({self.plate_size}), at least {self.nearest * 1e3:.0f} mm from any part on it "
            f"(at most {MAX_DISTANCE * 1e3:g} mm are allowed)"
        )


@dataclass(frozen=True, slots=True)
class AttainableKit:
    """Attainable points of a kit; an obstacle is the reason why all its points are unattainable."""

    kit_type: str
    parts: tuple[AttainablePart, ...]
    obstacle: str = ""

    @property
    def part_presence(self) -> float:
        """Largest possible points for parts that are present."""
        return 0.0 if self.obstacle else sum(part.presence for part in self.parts)

    @property
    def part_pose(self) -> float:
        """Largest possible points for parts that lie in their places."""
        return 0.0 if self.obstacle else sum(part.pose for part in self.parts)

    @property
    def all_parts_bonus(self) -> float:
        """Largest possible points for a tray that holds exactly the ordered parts."""
        is_possible = not self.obstacle and all(part.is_supplied for part in self.parts)
        return BONUS_POINTS * len(self.parts) if is_possible else 0.0

    @property
    def total(self) -> float:
        """Attainable points of this kit."""
        return self.part_presence + self.all_parts_bonus + self.part_pose

    @property
    def maximum(self) -> float:
        """Points of a kit with as many parts if everything were attainable."""
        return (PRESENCE_POINTS + BONUS_POINTS + POSE_POINTS) * len(self.parts)

    def summary(self) -> str:
        """Unattainable points of the kit and the reasons, in one sentence; empty if all are attainable."""
        if self.obstacle:
            return self.obstacle
        off = [part for part in self.parts if part.is_off_tray]
        short = Counter(part.type for part in self.parts if not part.is_supplied)
        reasons = [f"the cell has {count} good {kind} too few" for kind, count in short.items()]
        if off:
            nearest_off, farthest_off = min(part.off_plate for part in off), max(part.off_plate for part in off)
            far = " to ".join(dict.fromkeys((f"{nearest_off:.2f}", f"{farthest_off:.2f}")))
            reasons.append(
                f"{len(off)} of {len(self.parts)} places {'lie' if len(off) > 1 else 'lies'} {far} m off the tray, "
                f"at least {min(part.nearest for part in off) * 1e3:.0f} mm from any part on it"
            )
        return "; ".join(reasons)

    def reasons(self) -> Iterator[str]:
        """Yield a sentence about unattainable points for each ordered part, or for the whole kit."""
        if self.obstacle:
            yield self.obstacle
            return
        for number, part in enumerate(self.parts, start=1):
            if reason := part.reason():
                yield f"part {number}, {part.type}: {reason}"


@dataclass(frozen=True, slots=True)
class AttainableOrder:
    """Attainable points of an order."""

    order_id: str
    kits: tuple[AttainableKit, ...]

    @property
    def total(self) -> float:
        """Attainable points of this order."""
        return sum(kit.total for kit in self.kits)


@dataclass(frozen=True, slots=True)
class AttainableScore:
    """Attainable points of a trial; the orders are in the order of the file."""

    orders: tuple[AttainableOrder, ...]

    @property
    def total(self) -> float:
        """Attainable points of this trial, for any agent."""
        return sum(order.total for order in self.orders)

    @property
    def maximum(self) -> float:
        """Points of the same orders if everything were attainable."""
        return sum(kit.maximum for order in self.orders for kit in order.kits)

    def kit(self, kit_type: str) -> AttainableKit:
        """Return the attainable points of a kit of the trial.

        Raises:
            KeyError: the trial has no such kit.
        """
        return {kit.kit_type: kit for order in self.orders for kit in order.kits}[kit_type]

    def sentence(self) -> str:
        """Attainable points and the reasons for the missing ones; empty if all are attainable."""
        if self.total == self.maximum:
            return ""
        kits = [kit for order in self.orders for kit in order.kits]
        why = "; ".join(dict.fromkeys(f"{kit.kit_type}: {kit.summary()}" for kit in kits if kit.total < kit.maximum))
        return f"at most {self.total:g} of {self.maximum:g} points are attainable: {why}"


def attainable_score(trial: Trial) -> AttainableScore:
    """Compute the attainable points of a trial."""
    supply = good_parts(trial)
    obstacles = _obstacles(trial)
    return AttainableScore(
        tuple(
            AttainableOrder(
                order.order_id,
                tuple(
                    _attainable_kit(kit, _plates(trial, kit), supply, obstacles.get(order.order_id, ""))
                    for kit in order.kits
                ),
            )
            for order in trial.orders
        )
    )


def good_parts(trial: Trial) -> Counter[str]:
    """Count the parts of each type that are not faulty, including those that arrive on the belt or with a full tray."""
    faulty = frozenset(trial.faulty_parts)
    supply = Counter(
        part.type for part in (*trial.bin_parts, *trial.extra_parts) if trimmed_name(part.name) not in faulty
    )
    for name, kind in (*trial.belt_clones(), *((name, each.type) for name, each in trial.demo_clones())):
        supply[kind] += name not in faulty
    return supply


def off_plate(tray_T_goal: Pose, plate: Plate) -> float:
    """Return the distance of a place from the tray's plate [m]; 0 on it."""
    beside = (max(abs(at) - edge / 2, 0.0) for at, edge in zip(tray_T_goal.position, plate, strict=False))
    return math.hypot(*beside)


def nearest(part_type: str, tray_T_goal: Pose, plate: Plate) -> float:
    """Return the smallest distance from a place to the origin of a part that touches the plate [m].

    The distance is 0 for types of unknown size.
    """
    return max(off_plate(tray_T_goal, plate) - PART_RADII.get(part_type, math.inf), 0.0)


def _plates(trial: Trial, kit: Kit) -> tuple[Plate, ...]:
    """Return the plates that a kit may be built on; without a tray in the cell those of the trays it could have."""
    stations = trial.stations or trial.layout.stations
    own = tuple(each.plate for each in stations if kit.tray in (None, each.name))
    return own or ((math.inf, math.inf),)


def _attainable_kit(kit: Kit, plates: Sequence[Plate], supply: Mapping[str, int], obstacle: str) -> AttainableKit:
    ordered: Counter[str] = Counter()
    parts = []
    for each in kit.objects:
        ordered[each.type] += 1
        is_supplied = ordered[each.type] <= supply.get(each.type, 0)
        plate = min(plates, key=partial(off_plate, each.pose))
        off, least = off_plate(each.pose, plate), nearest(each.type, each.pose, plate)
        parts.append(AttainablePart(each.type, each.pose, off, least, is_supplied, plate))
    return AttainableKit(kit.kit_type, tuple(parts), obstacle)


def _obstacles(trial: Trial) -> dict[str, str]:
    """Return, by order id, the reasons why whole orders are unattainable."""
    if not trial.stations:
        return {order.order_id: "the cell has no AGV and no tray" for order in trial.orders}
    obstacles: dict[str, str] = {}
    obstacle = ""
    # an order waits for those before it
    for order in Announcements(trial.orders).orders:
        obstacle = obstacle or _never_announced(order, trial.time_limit)
        if obstacle:
            obstacles[order.order_id] = obstacle
    return obstacles


def _never_announced(order: Order, time_limit: float | None) -> str:
    if order.start_time is not None:
        if time_limit is None or order.start_time <= time_limit:
            return ""
        return f"{order.order_id} is due at {order.start_time:g} s, after the time limit of {time_limit:g} s"
    conditions = ((order.wanted_parts or 0) > 0, (order.unwanted_parts or 0) > 0)
    return "" if any(conditions) else f"no condition announces {order.order_id}"
