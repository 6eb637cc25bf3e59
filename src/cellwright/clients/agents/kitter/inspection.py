"""What lies on a tray, compared with what should."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum, auto

from cellwright.clients.agents.kitter.cellview import CellView
from cellwright.clients.agents.kitter.eyes import Sighting
from cellwright.clients.agents.kitter.kits import Kit, Task
from cellwright.clients.agents.kitter.placing import pose_on_tray
from cellwright.util.pose import Pose

STRAY = 0.05
"""What lies further [m] from all that was put down does not belong on the tray."""

SAME_PLACE = 0.06
"""A fault that is seen this near [m] to where a part was put down is that part's."""

LOST = 0.1
"""A part that is seen this far [m] from where it was put down was lost."""

MISPLACED = 0.012
MISTURNED = 0.05
"""A part that lies further [m] or is turned more [rad] from where it was ordered is out of place."""


class Verdict(Enum):
    """What became of a part that was put down."""

    UNSEEN = auto()
    """No camera looks there."""
    FAULTY = auto()
    LOST = auto()
    OUT_OF_PLACE = auto()
    GOOD = auto()


@dataclass(frozen=True, slots=True)
class Finding:
    """A verdict, and where the part was seen if it was: how far off [m] and by how much turned [rad]."""

    verdict: Verdict
    world_T_part: Pose | None = None
    offset: float = 0.0
    turn: float = 0.0


def inspect(view: CellView, kit: Kit, task: Task, tray_T_part: Pose) -> Finding:
    """Look at a part that was put down on the tray of its kit. It takes a second."""
    station = kit.station
    expected = pose_on_tray(station, kit.catalogue.figures(task.type), tray_T_part)
    if any(is_near(pose, expected, SAME_PLACE) for pose in view.faulty_on_tray(station.number)):
        return Finding(Verdict.FAULTY)
    if not view.sees(expected):
        return Finding(Verdict.UNSEEN)
    view.look(station.area)
    seen = [part.world_T_part for part in view.parts_on_tray(station.world_T_tray) if part.type == task.type]
    found = min(seen, key=lambda pose: gap(pose, expected), default=None)
    if found is None or gap(found, expected) > LOST:
        return Finding(Verdict.LOST)
    offset = gap(found, expected)
    turn = abs(math.remainder(found.yaw - expected.yaw, 2 * math.pi))
    is_off = offset > MISPLACED or turn > MISTURNED
    return Finding(Verdict.OUT_OF_PLACE if is_off else Verdict.GOOD, found, offset, turn)


def strays(view: CellView, kit: Kit) -> list[Sighting]:
    """The parts on the tray that nobody put where they are, such as one that was lost over it; as of the last look."""
    return [
        part
        for part in view.parts_on_tray(kit.station.world_T_tray)
        if not any(is_near(part.world_T_part, pose, STRAY) for pose in _poses(kit, kit.lying))
    ]


def is_known_faulty(kit: Kit, part: Sighting) -> bool:
    """Whether a part lies where a faulty one could not be taken away."""
    return any(is_near(part.world_T_part, pose, SAME_PLACE) for pose in _poses(kit, kit.faulty))


def _poses(kit: Kit, parts: Iterable[tuple[str, Pose]]) -> Iterator[Pose]:
    """world_T_part of parts on the tray of a kit, given by type and place."""
    for part_type, tray_T_part in parts:
        yield pose_on_tray(kit.station, kit.catalogue.figures(part_type), tray_T_part)


def gap(one: Pose, other: Pose) -> float:
    """Between two origins, height left out [m]."""
    return math.hypot(one.position[0] - other.position[0], one.position[1] - other.position[1])


def is_near(one: Pose, other: Pose, reach: float) -> bool:
    """Whether two origins are within `reach` [m], height left out."""
    return gap(one, other) < reach
