"""Perception of the kitter: camera views, averaged sightings of parts, and tracking of parts on the belt."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.client import Client
from cellwright.config.layout.gear2017 import gear2017
from cellwright.middleware.messages.conversions import pose_from_message
from cellwright.util.pose import Pose, Vector3, normalized

BIN_SURFACE = 0.725
"""Height [m] of the surface that parts lie on in a bin."""

TRAY_SURFACE = 0.755
"""Height [m] of the surface of a tray's plate."""

TRAY_HALF_X, TRAY_HALF_Y = 0.25, 0.35
"""Distances [m] of the tray's rims from its middle."""

BELT_SURFACE = 0.90691
"""Height [m] of the surface that parts ride on."""

BELT_MIDDLE, BELT_HALF_WIDTH = 1.21, 0.327
"""World x [m] of the middle of the belt, and its reach to either side."""

MIN_CAMERA_RANGE, MAX_CAMERA_RANGE = 0.2, 0.75
"""Nearest and furthest distance [m] that a logical camera sees."""

VIEW_HALF_WIDTH, VIEW_HALF_HEIGHT = 0.613, 0.409
"""Half width and half height of the view [m] at a distance of 1 m."""

VIEW_INSIDE_SHARE = 0.975
"""Share of the view's width and height that counts as well inside: noise moves nothing from there over the edge."""

RESTING_SPREAD = 0.012
"""Spread [m] of the sightings of a part at rest: noise is 1 mm."""
IMAGES = 8
"""Number of images that are averaged."""
STALE_IMAGE_AGE = 0.005
"""Images this soon [s] after the subscription may be old: the newest image is latched."""
BELT_SPEED = 0.2
"""Speed of the belt at full power [m/s], along world -y; in a competition it always runs so."""
SAME_BELT_PART = 0.04
"""Distance [m] from its expected place within which a part is the same."""
BEAM_DELAY = 0.025
"""Mean delay [s] of a beam's readings: half a period, at twenty readings a second."""
MAX_BELT_SIGHTINGS = 40
"""Largest number of images of a part that are averaged."""


@dataclass(frozen=True, slots=True)
class Area:
    """A box in the world, from its corner of smallest coordinates to that of largest [m]."""

    low: Vector3
    high: Vector3

    @classmethod
    def around(cls, points: Iterable[Vector3], margin: float = 0.0) -> Area:
        """Return the smallest box that holds all points and a margin [m] around them."""
        xs, ys, zs = zip(*points, strict=True)
        low = (min(xs) - margin, min(ys) - margin, min(zs) - margin)
        return cls(low, (max(xs) + margin, max(ys) + margin, max(zs) + margin))

    def meets(self, other: Area) -> bool:
        """Return whether two boxes have a point in common."""
        return all(self.low[axis] <= other.high[axis] and other.low[axis] <= self.high[axis] for axis in range(3))


BINS = Area.around(((*each.centre, BIN_SURFACE) for each in gear2017().bins), 0.3)
BELT = Area(
    (BELT_MIDDLE - BELT_HALF_WIDTH, -4.3, BELT_SURFACE - 0.02),
    (BELT_MIDDLE + BELT_HALF_WIDTH, 10.3, BELT_SURFACE + 0.02),
)


def view_of(world_T_camera: Pose, part_extent: float) -> Area:
    """Return the box around all that a logical camera can see, even only the edge of a part.

    `part_extent` [m] is the largest distance of a point of a part from its origin.
    """
    corners = [
        world_T_camera.transform((distance, distance * VIEW_HALF_WIDTH * side, distance * VIEW_HALF_HEIGHT * up))
        for distance in (MIN_CAMERA_RANGE, MAX_CAMERA_RANGE)
        for side in (-1.0, 1.0)
        for up in (-1.0, 1.0)
    ]
    return Area.around(corners, part_extent)


def is_well_in_view(world_T_camera: Pose, point: Vector3) -> bool:
    """Return whether a point of the world [m] is in the view of a logical camera, and not at its edge."""
    x, y, z = world_T_camera.inverse().transform(point)
    is_between = MIN_CAMERA_RANGE < x < MAX_CAMERA_RANGE - 0.01
    return (
        is_between
        and abs(y) < VIEW_INSIDE_SHARE * VIEW_HALF_WIDTH * x
        and abs(z) < VIEW_INSIDE_SHARE * VIEW_HALF_HEIGHT * x
    )


def is_in_bin(x: float, y: float) -> bool:
    """Return whether a point of the world is over a bin."""
    return any(each.covers(x, y) for each in gear2017().bins)


@dataclass(frozen=True, slots=True)
class Sighting:
    """A part in one image, or at rest as several images agree."""

    type: str
    world_T_part: Pose
    """By the side that is up, see `Catalogue.side_up`."""
    is_turned: bool = False
    """True if that is the part's other side."""

    @property
    def is_upright(self) -> bool:
        """True if its own z axis points up, within 30 degrees."""
        return self.world_T_part.rotate((0.0, 0.0, 1.0))[2] > math.cos(math.radians(30.0))


@dataclass(frozen=True, slots=True)
class Image:
    """An image: its time of arrival [s], and the parts in it."""

    time: float
    parts: tuple[Sighting, ...]


def resting_parts(images: Sequence[Image]) -> list[Sighting]:
    """Return the parts that every image has at one place, averaged; in the order of the newest image."""
    found = []
    for part in images[-1].parts if images else ():
        poses = [_nearest_pose(part, image.parts) for image in images]
        together = [pose for pose in poses if pose is not None]
        if len(together) == len(images):
            found.append(Sighting(part.type, mean_pose(together), part.is_turned))
    return found


def _nearest_pose(part: Sighting, others: Iterable[Sighting]) -> Pose | None:
    """Return the pose of a part in another image."""
    poses = [other.world_T_part for other in others if other.type == part.type]
    best = min(poses, key=lambda pose: distance(part.world_T_part, pose), default=None)
    return best if best is not None and distance(part.world_T_part, best) <= RESTING_SPREAD else None


def distance(one: Pose, other: Pose) -> float:
    """Return the distance between two origins [m]."""
    return math.dist(one.position, other.position)


def mean_pose(poses: Iterable[Pose]) -> Pose:
    """Return the mean of poses close to each other: of positions, and of quaternions on one half sphere."""
    known = list(poses)
    first_w, first_x, first_y, first_z = known[0].quaternion
    x = y = z = qw = qx = qy = qz = 0.0
    for pose in known:
        px, py, pz = pose.position
        w, i, j, k = pose.quaternion
        # q and -q are one rotation: all count on the half sphere of the first, so that they do not cancel out.
        sign = math.copysign(1.0, first_w * w + first_x * i + first_y * j + first_z * k)
        x, y, z = x + px, y + py, z + pz
        qw, qx, qy, qz = qw + sign * w, qx + sign * i, qy + sign * j, qz + sign * k
    count = len(known)
    return Pose((x / count, y / count, z / count), normalized((qw, qx, qy, qz)))


class Images:
    """The newest images of one sensor, while it is subscribed to."""

    def __init__(self, client: Client, name: str, catalogue: Catalogue) -> None:
        self.name = name
        self.on_image: Callable[[Image], None] = lambda _image: None
        """Called with each image."""
        self.newest: deque[Image] = deque(maxlen=IMAGES)
        self._client = client
        self._catalogue = catalogue
        self._since = 0.0
        self._unsubscribe: Callable[[], None] | None = None

    def listen(self) -> None:
        """Take images from now on; drop earlier ones."""
        self.newest.clear()
        if self._unsubscribe is None:
            self._since = self._client.time
            self._unsubscribe = self._client.on_sensor(self.name, self._take)

    def rest(self) -> None:
        """Take no more images; keep those that were taken."""
        if self._unsubscribe is not None:
            self._unsubscribe()
            self._unsubscribe = None

    def _take(self, message: Any) -> None:
        time = self._client.time
        if time < self._since + STALE_IMAGE_AGE:
            return
        world_T_camera = pose_from_message(message.pose)
        parts = tuple(
            Sighting(model.type, *self._catalogue.side_up(model.type, world_T_camera @ pose_from_message(model.pose)))
            for model in message.models
            if model.type in self._catalogue
        )
        image = Image(time, parts)
        self.newest.append(image)
        self.on_image(image)


class CameraView(Images):
    """A logical camera, and the box in the world that it can see."""

    def __init__(self, client: Client, name: str, world_T_camera: Pose, catalogue: Catalogue) -> None:
        super().__init__(client, name, catalogue)
        self.world_T_camera = world_T_camera
        self.view = view_of(world_T_camera, catalogue.max_extent)


def wait_for_images(client: Client, sensors: Sequence[Images], count: int = IMAGES) -> None:
    """Wait until each sensor has taken `count` images since it listens: a tenth of a second each."""
    if sensors:
        client.wait_until(lambda: all(len(each.newest) >= count for each in sensors), timeout=count * 0.1 + 0.5)


@dataclass
class TrackedBeltPart:
    """A part on the belt, seen several times by a camera, or once by a beam."""

    type: str
    at_zero: list[Pose] = field(default_factory=list)
    """Its pose at time 0 for each sighting: the belt moves along y only."""
    has_yaw: bool = True
    """True if its yaw is known."""
    is_turned: bool = False
    """True if its other side is up."""
    _mean: Pose | None = field(default=None, init=False, repr=False)

    def pose(self, time: float) -> Pose:
        """Return world_T_part at a time [s]."""
        mean = self._mean_at_zero()
        x, y, z = mean.position
        return Pose((x, y - BELT_SPEED * time, z), mean.quaternion)

    def time_at(self, y: float) -> float:
        """Return the time at which its origin passes world y [s]."""
        return (self._mean_at_zero().position[1] - y) / BELT_SPEED

    def is_near(self, pose: Pose, time: float) -> bool:
        """Return whether it can be the part seen at a pose."""
        x, y, _ = self.pose(time).position
        return math.hypot(pose.position[0] - x, pose.position[1] - y) < SAME_BELT_PART

    def add(self, pose: Pose, time: float) -> None:
        """Add a sighting at a pose and time [s]."""
        x, y, z = pose.position
        # Shifted to where the belt had it at time 0, sightings of all times can be averaged.
        self.at_zero.append(Pose((x, y + BELT_SPEED * time, z), pose.quaternion))
        del self.at_zero[:-MAX_BELT_SIGHTINGS]
        self._mean = None

    def _mean_at_zero(self) -> Pose:
        # read far more often than something is added
        if self._mean is None:
            self._mean = mean_pose(self.at_zero)
        return self._mean


class BeltWatch:
    """Tracks the parts on the belt, with cameras and with break beams (world poses by name) across the belt.

    A beam can identify a part only if just one of the `types` arrives on the belt, according to the cell.
    """

    def __init__(self, client: Client, beams: dict[str, Pose], types: Iterable[str], catalogue: Catalogue) -> None:
        self.parts: list[TrackedBeltPart] = []
        self._client = client
        self._types = tuple(types)
        self._catalogue = catalogue
        self._unsubscribe_beams = [
            self._watch_beam(name, pose.position[1])
            for name, pose in beams.items()
            if crosses_belt(pose) and len(self._types) == 1
        ]

    def take_image(self, image: Image) -> None:
        """Add the parts of a camera's image that are on the belt."""
        for seen in image.parts:
            x, _, z = seen.world_T_part.position
            z -= self._catalogue.figures(seen.type).below
            if abs(x - BELT_MIDDLE) < BELT_HALF_WIDTH and abs(z - BELT_SURFACE) < 0.02:
                # Once a camera sees the belt, beams are not needed.
                while self._unsubscribe_beams:
                    self._unsubscribe_beams.pop()()
                self._note(seen, image.time)

    def coming(self, part_type: str, time: float, y: float) -> list[TrackedBeltPart]:
        """Return the parts of a type that pass world y later than `time` [s], the first of them first."""
        found = [part for part in self.parts if part.type == part_type and part.time_at(y) > time]
        return sorted(found, key=lambda part: part.time_at(y))

    def forget(self, part: TrackedBeltPart) -> None:
        """Forget a part that has left the belt, or that was tried in vain."""
        self.parts = [each for each in self.parts if each is not part]

    def _note(self, seen: Sighting, time: float) -> None:
        pose = seen.world_T_part
        known = next((p for p in self.parts if p.type == seen.type and p.has_yaw and p.is_near(pose, time)), None)
        if known is None:
            known = self._new(TrackedBeltPart(seen.type, is_turned=seen.is_turned), time)
        known.add(pose, time)

    def _watch_beam(self, name: str, y: float) -> Callable[[], None]:
        """Time the parts that pass a beam at world y [m]; the returned function ends that."""
        began: float | None = None

        def take(message: Any) -> None:
            nonlocal began
            now = self._client.time - BEAM_DELAY
            if message.object_detected:
                began = now
            elif began is not None:
                # Beam and part meet at the part's two edges: its middle passed halfway between them.
                self._take_crossing((began + now) / 2, BELT_SPEED * (now - began), y)
                began = None

        return self._client.subscribe(f"/ariac/{name}_change", take)

    def _take_crossing(self, middle: float, length: float, y: float) -> None:
        """Take a part of `length` [m] whose middle passed a beam at time `middle` [s]."""
        kind = self._catalogue.figures(self._types[0])
        if length >= kind.extent / 2:
            part = self._new(TrackedBeltPart(self._types[0], has_yaw=False), middle)
            part.add(Pose((BELT_MIDDLE, y, BELT_SURFACE + kind.below)), middle)

    def _new(self, part: TrackedBeltPart, time: float) -> TrackedBeltPart:
        """Add a part that came in view; forget those that have left the belt."""
        self.parts = [*(each for each in self.parts if each.time_at(-5.0) > time), part]
        return part


def crosses_belt(world_T_beam: Pose) -> bool:
    """Return whether a beam runs across the belt, low enough to meet flat parts."""
    direction = world_T_beam.rotate((1.0, 0.0, 0.0))
    x, _, z = world_T_beam.position
    ends = sorted((x, x + direction[0]))
    return abs(direction[0]) > 0.99 and ends[0] < BELT_MIDDLE < ends[1] and BELT_SURFACE < z < BELT_SURFACE + 0.0075
