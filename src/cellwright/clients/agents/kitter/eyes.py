"""What images of logical cameras show, with their noise averaged away."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from cellwright.util.pose import Pose, Quaternion, Vector3, normalized

RESTING_SPREAD = 0.012
"""A part that was seen within this distance [m] of one place all the time is at rest: noise is 1 mm."""


@dataclass(frozen=True, slots=True)
class Seen:
    """A part in one image, in the world frame."""

    type: str
    world_T_part: Pose


@dataclass(frozen=True, slots=True)
class Image:
    """An image: when it came [s], and the parts in it."""

    time: float
    parts: tuple[Seen, ...]


@dataclass(frozen=True, slots=True)
class Sighting:
    """A part at rest, as several images agree.

    Attributes:
        type: its type.
        world_T_part: the mean of what was seen.
        count: how many images it was in.
    """

    type: str
    world_T_part: Pose
    count: int

    @property
    def is_upright(self) -> bool:
        """Whether its own z axis points up, within 30 degrees."""
        return self.world_T_part.rotate((0.0, 0.0, 1.0))[2] > math.cos(math.radians(30.0))


def resting(images: Sequence[Image], spread: float = RESTING_SPREAD) -> list[Sighting]:
    """The parts that are in every image at one place, averaged; in the order of the newest image."""
    if not images:
        return []
    found = []
    for part in images[-1].parts:
        near = [_nearest(part, image.parts, spread) for image in images]
        together = [each for each in near if each is not None]
        if len(together) == len(images):
            found.append(Sighting(part.type, mean_pose(each.world_T_part for each in together), len(together)))
    return found


def _nearest(part: Seen, others: Iterable[Seen], spread: float) -> Seen | None:
    alike = [other for other in others if other.type == part.type]
    best = min(alike, key=lambda other: distance(part.world_T_part, other.world_T_part), default=None)
    return best if best is not None and distance(part.world_T_part, best.world_T_part) <= spread else None


def distance(one: Pose, other: Pose) -> float:
    """Between two origins [m]."""
    return math.dist(one.position, other.position)


def mean_pose(poses: Iterable[Pose]) -> Pose:
    """The mean of poses that are close to each other: of the positions, and of the quaternions on one half sphere."""
    known = list(poses)
    first = known[0].quaternion
    total = [0.0, 0.0, 0.0, 0.0]
    for pose in known:
        sign = math.copysign(1.0, sum(a * b for a, b in zip(first, pose.quaternion, strict=True)))
        total = [sum_ + sign * value for sum_, value in zip(total, pose.quaternion, strict=True)]
    quaternion: Quaternion = (total[0], total[1], total[2], total[3])
    mean = [sum(pose.position[axis] for pose in known) / len(known) for axis in range(3)]
    position: Vector3 = (mean[0], mean[1], mean[2])
    return Pose(position, normalized(quaternion))
