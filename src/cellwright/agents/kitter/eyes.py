"""What the logical cameras have seen lately, with their noise averaged away."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from cellwright.agents.kitter.part_figures import PART_TYPES
from cellwright.client import Client
from cellwright.messages.build import pose_from_message
from cellwright.pose import Pose, Quaternion, Vector3, normalized

IMAGES = 8
"""How many images are averaged."""

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


class Camera:
    """One logical camera.

    Args:
        client: whose camera.
        name: the sensor's name.
        on_image: called with each image besides.
    """

    def __init__(self, client: Client, name: str, on_image: Callable[[Image], None] | None = None) -> None:
        self.name = name
        self.images: deque[Image] = deque(maxlen=IMAGES)
        self.count = 0
        self._client = client
        self._on_image = on_image
        client.on_sensor(name, self._take)

    def _take(self, message: Any) -> None:
        world_T_camera = pose_from_message(message.pose)
        parts = tuple(
            Seen(model.type, world_T_camera @ pose_from_message(model.pose))
            for model in message.models
            if model.type in PART_TYPES
        )
        image = Image(self._client.time, parts)
        self.images.append(image)
        self.count += 1
        if self._on_image is not None:
            self._on_image(image)

    def look_afresh(self, images: int = IMAGES) -> None:
        """Wait until it has seen this many images from now on (a tenth of a second each)."""
        start = self.count
        self._client.wait_until(lambda: self.count >= start + images, timeout=images * 0.1 + 0.5)

    def parts(self, images: int = IMAGES) -> list[Sighting]:
        """The parts that lie still in view, as the last images agree."""
        return resting(list(self.images)[-images:])


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
