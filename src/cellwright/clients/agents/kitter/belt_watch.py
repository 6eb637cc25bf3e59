"""What comes along on the belt, and where each of it will be at a given time."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from cellwright.clients.agents.kitter.areas import BELT_HALF_WIDTH, BELT_MIDDLE, BELT_SURFACE
from cellwright.clients.agents.kitter.eyes import Image, mean_pose
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.client import Client
from cellwright.util.pose import Pose

SPEED = 0.2
"""Speed of the belt at full power [m/s], along world -y; in a competition it always runs so."""

NEAR = 0.04
"""A part within this distance [m] of where one is expected is that one."""

BEAM_DELAY = 0.025
"""A beam is read twenty times a second: what it tells happened half a period [s] ago, on average."""

TAKES = 40
"""How many images of a part are averaged at most."""


@dataclass
class BeltPart:
    """A part on the belt, seen several times by a camera, or once by a beam.

    Attributes:
        type: its type.
        at_zero: where it would be at time 0, for each time that it was seen: the belt moves along y only.
        has_yaw: whether it is known how it is turned.
    """

    type: str
    at_zero: list[Pose] = field(default_factory=list)
    has_yaw: bool = True
    _mean: Pose | None = field(default=None, init=False, repr=False)

    def pose(self, time: float) -> Pose:
        """world_T_part at a time [s]."""
        mean = self._mean_at_zero()
        x, y, z = mean.position
        return Pose((x, y - SPEED * time, z), mean.quaternion)

    def time_at(self, y: float) -> float:
        """When its origin passes world y [s]."""
        return (self._mean_at_zero().position[1] - y) / SPEED

    def is_near(self, pose: Pose, time: float) -> bool:
        """Whether it can be what was seen at a pose."""
        x, y, _ = self.pose(time).position
        return math.hypot(pose.position[0] - x, pose.position[1] - y) < NEAR

    def add(self, pose: Pose, time: float) -> None:
        """It was seen at a pose at a time [s]."""
        x, y, z = pose.position
        self.at_zero.append(Pose((x, y + SPEED * time, z), pose.quaternion))
        del self.at_zero[:-TAKES]
        self._mean = None

    def _mean_at_zero(self) -> Pose:
        # asked for far more often than something is added
        if self._mean is None:
            self._mean = mean_pose(self.at_zero)
        return self._mean


class BeltWatch:
    """Follows the parts on the belt.

    Args:
        client: whose sensors.
        beams: break beams by name, with their poses in the world frame; those that do not cross the belt are left out.
        types: the types that come on the belt, as the cell tells; a beam can tell a part only if there is just one.
        catalogue: the part types that can be handled.
    """

    def __init__(self, client: Client, beams: dict[str, Pose], types: Iterable[str], catalogue: Catalogue) -> None:
        self.parts: list[BeltPart] = []
        self._client = client
        self._types = tuple(types)
        self._catalogue = catalogue
        self._beams = [
            _Beam(client, name, pose.position[1], self._take_crossing)
            for name, pose in beams.items()
            if crosses_belt(pose) and len(self._types) == 1
        ]

    def take_image(self, image: Image) -> None:
        """Note what a camera sees on the belt."""
        for seen in image.parts:
            x, _, z = seen.world_T_part.position
            z -= self._catalogue.figures(seen.type).below
            if abs(x - BELT_MIDDLE) < BELT_HALF_WIDTH and abs(z - BELT_SURFACE) < 0.02:
                self._leave_beams()
                self._note(seen.type, seen.world_T_part, image.time)

    def coming(self, part_type: str, time: float, y: float) -> list[BeltPart]:
        """The parts of a type that pass world y later than `time` [s], the first of them first."""
        found = [part for part in self.parts if part.type == part_type and part.time_at(y) > time]
        return sorted(found, key=lambda part: part.time_at(y))

    def forget(self, part: BeltPart) -> None:
        """It is on the belt no longer, or was tried in vain."""
        self.parts = [each for each in self.parts if each is not part]

    def _note(self, part_type: str, pose: Pose, time: float) -> None:
        known = next((p for p in self.parts if p.type == part_type and p.has_yaw and p.is_near(pose, time)), None)
        if known is None:
            known = BeltPart(part_type)
            self.parts = [each for each in self.parts if each.time_at(-5.0) > time]
            self.parts.append(known)
        known.add(pose, time)

    def _leave_beams(self) -> None:
        """What a camera sees the beams need not tell."""
        for beam in self._beams:
            beam.leave()
        self._beams.clear()

    def _take_crossing(self, middle: float, length: float, y: float) -> None:
        """Something passed a beam: its middle at time `middle` [s], `length` [m] of it."""
        part = BeltPart(self._types[0], has_yaw=False)
        kind = self._catalogue.figures(part.type)
        if length < kind.reach / 2:
            return
        part.add(Pose((BELT_MIDDLE, y, BELT_SURFACE + kind.below)), middle)
        self.parts = [each for each in self.parts if each.time_at(-5.0) > middle]
        self.parts.append(part)


class _Beam:
    """Times what passes one beam."""

    def __init__(self, client: Client, name: str, y: float, on_crossing: Any) -> None:
        self._client = client
        self._y = y
        self._began: float | None = None
        self._on_crossing = on_crossing
        self.leave = client.subscribe(f"/ariac/{name}_change", self._take)

    def _take(self, message: Any) -> None:
        now = self._client.time - BEAM_DELAY
        if message.object_detected:
            self._began = now
        elif self._began is not None:
            self._on_crossing((self._began + now) / 2, SPEED * (now - self._began), self._y)
            self._began = None


def crosses_belt(world_T_beam: Pose) -> bool:
    """Whether a beam runs across the belt, low enough to meet flat parts."""
    direction = world_T_beam.rotate((1.0, 0.0, 0.0))
    x, _, z = world_T_beam.position
    ends = sorted((x, x + direction[0]))
    return abs(direction[0]) > 0.99 and ends[0] < BELT_MIDDLE < ends[1] and BELT_SURFACE < z < BELT_SURFACE + 0.0075
