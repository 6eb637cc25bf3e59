"""Perception of the kitter: camera views, averaged sightings of parts, and tracking of parts on belts."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.workplace import Area, BeltPlace
from cellwright.clients.client import Client
from cellwright.middleware.messages.conversions import pose_from_message
from cellwright.util.pose import Pose, Vector3, normalized

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
SAME_BELT_PART = 0.04
"""Distance [m] from its expected place within which a part is the same."""
BEAM_DELAY = 0.025
"""Mean delay [s] of a beam's readings: half a period, at twenty readings a second."""
MAX_BELT_SIGHTINGS = 40
"""Largest number of images of a part that are averaged."""


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
        together = []
        for image in images:
            pose = _nearest_pose(part, image.parts)
            if pose is None:
                break
            together.append(pose)
        else:
            found.append(Sighting(part.type, mean_pose(together), part.is_turned))
    return found


def _nearest_pose(part: Sighting, others: Iterable[Sighting]) -> Pose | None:
    """Return the pose of a part in another image; of several as near, that of the first."""
    kind, position = part.type, part.world_T_part.position
    best, least = None, math.inf
    for other in others:
        if other.type == kind and (apart := math.dist(position, other.world_T_part.position)) < least:
            best, least = other.world_T_part, apart
    return best if least <= RESTING_SPREAD else None


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
    """The newest images of one sensor, while it is subscribed to; `arm_T_world` brings them into the arm's frame."""

    def __init__(self, client: Client, name: str, catalogue: Catalogue, arm_T_world: Pose) -> None:
        self.name = name
        self.on_image: Callable[[Image], None] = lambda _image: None
        """Called with each image."""
        self.newest: deque[Image] = deque(maxlen=IMAGES)
        self._client = client
        self._catalogue = catalogue
        self._arm_T_world = arm_T_world
        self._since = 0.0
        self._unsubscribe: Callable[[], None] | None = None
        self._resting: tuple[tuple[Image, ...], list[Sighting]] = (), []

    @property
    def resting(self) -> list[Sighting]:
        """The parts at rest in the newest images, see `resting_parts`."""
        # asked for several times between two images
        images = tuple(self.newest)
        if images != self._resting[0]:
            self._resting = images, resting_parts(images)
        return self._resting[1]

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
        world_T_camera = self._arm_T_world @ pose_from_message(message.pose)
        parts = tuple(
            Sighting(model.type, *self._catalogue.side_up(model.type, world_T_camera @ pose_from_message(model.pose)))
            for model in message.models
            if model.type in self._catalogue
        )
        image = Image(time, parts)
        self.newest.append(image)
        self.on_image(image)


class CameraView(Images):
    """A logical camera at a pose in the arm's frame, and the box that it can see."""

    def __init__(
        self, client: Client, name: str, world_T_camera: Pose, catalogue: Catalogue, arm_T_world: Pose
    ) -> None:
        super().__init__(client, name, catalogue, arm_T_world)
        self.world_T_camera = world_T_camera
        self.view = view_of(world_T_camera, catalogue.max_extent)


def wait_for_images(client: Client, sensors: Sequence[Images], count: int = IMAGES) -> None:
    """Wait until each sensor has taken `count` images since it listens: a tenth of a second each."""
    if sensors:
        client.wait_until(lambda: all(len(each.newest) >= count for each in sensors), timeout=count * 0.1 + 0.5)


@dataclass
class TrackedBeltPart:
    """A part on a belt, seen several times by a camera, or once by a beam."""

    type: str
    belt: BeltPlace
    at_zero: list[Pose] = field(default_factory=list)
    """Its pose at time 0 for each sighting."""
    has_yaw: bool = True
    """True if its yaw is known."""
    is_turned: bool = False
    """True if its other side is up."""
    _mean: Pose | None = field(default=None, init=False, repr=False)

    def pose(self, time: float) -> Pose:
        """Return world_T_part at a time [s]."""
        return self.belt.moved(self._mean_at_zero(), time)

    def place(self, time: float) -> float:
        """Return its place along the belt at a time [s]."""
        return self.belt.belt.along(self.pose(time).position)

    def time_at(self, along: float) -> float:
        """Return the time at which its origin passes a place along the belt [s]."""
        return (along - self.belt.belt.along(self._mean_at_zero().position)) / self.belt.belt.speed

    def is_near(self, pose: Pose, time: float) -> bool:
        """Return whether it can be the part seen at a pose."""
        x, y, _ = self.pose(time).position
        return math.hypot(pose.position[0] - x, pose.position[1] - y) < SAME_BELT_PART

    def add(self, pose: Pose, time: float) -> None:
        """Add a sighting at a pose and time [s]."""
        # Shifted to where the belt had it at time 0, sightings of all times can be averaged.
        self.at_zero.append(self.belt.moved(pose, -time))
        del self.at_zero[:-MAX_BELT_SIGHTINGS]
        self._mean = None

    def _mean_at_zero(self) -> Pose:
        # read far more often than something is added
        if self._mean is None:
            self._mean = mean_pose(self.at_zero)
        return self._mean


class BeltWatch:
    """Tracks the parts on one belt, with cameras and with break beams (poses by name) across the belt.

    A beam can identify a part only if just one of the `types` arrives on the belt, according to the cell.
    """

    def __init__(
        self, client: Client, belt: BeltPlace, beams: dict[str, Pose], types: Iterable[str], catalogue: Catalogue
    ) -> None:
        self.belt = belt
        self.types = tuple(types)
        self.parts: list[TrackedBeltPart] = []
        self._client = client
        self._catalogue = catalogue
        self._unsubscribe_beams = [
            self._watch_beam(name, belt.belt.along(pose.position))
            for name, pose in beams.items()
            if belt.is_crossed_by(pose) and len(self.types) == 1
        ]

    def take_image(self, image: Image) -> None:
        """Add the parts of a camera's image that are on the belt."""
        for seen in image.parts:
            x, y, z = seen.world_T_part.position
            z -= self._catalogue.figures(seen.type).below
            if self.belt.belt.covers(x, y) and abs(z - self.belt.belt.surface) < 0.02:
                # Once a camera sees the belt, beams are not needed.
                while self._unsubscribe_beams:
                    self._unsubscribe_beams.pop()()
                self._note(seen, image.time)

    def coming(self, part_type: str, time: float) -> list[TrackedBeltPart]:
        """Return the parts of a type that are in reach later than `time` [s], the first of them first."""
        last = self.belt.last
        found = [part for part in self.parts if part.type == part_type and part.time_at(last) > time]
        return sorted(found, key=lambda part: part.time_at(last))

    def forget(self, part: TrackedBeltPart) -> None:
        """Forget a part that has left the belt, or that was tried in vain."""
        self.parts = [each for each in self.parts if each is not part]

    def _note(self, seen: Sighting, time: float) -> None:
        pose = seen.world_T_part
        known = next((p for p in self.parts if p.type == seen.type and p.has_yaw and p.is_near(pose, time)), None)
        if known is None:
            known = self._new(TrackedBeltPart(seen.type, self.belt, is_turned=seen.is_turned), time)
        known.add(pose, time)

    def _watch_beam(self, name: str, along: float) -> Callable[[], None]:
        """Time the parts that pass a beam at a place along the belt [m]; the returned function ends that."""
        began: float | None = None

        def take(message: Any) -> None:
            nonlocal began
            now = self._client.time - BEAM_DELAY
            if message.object_detected:
                began = now
            elif began is not None:
                # Beam and part meet at the part's two edges: its middle passed halfway between them.
                self._take_crossing((began + now) / 2, self.belt.belt.speed * (now - began), along)
                began = None

        return self._client.subscribe(f"/ariac/{name}_change", take)

    def _take_crossing(self, middle: float, length: float, along: float) -> None:
        """Take a part of `length` [m] whose middle passed a beam at time `middle` [s]."""
        kind = self._catalogue.figures(self.types[0])
        if length >= kind.extent / 2:
            part = self._new(TrackedBeltPart(self.types[0], self.belt, has_yaw=False), middle)
            part.add(Pose((*self.belt.point(along), self.belt.belt.surface + kind.below)), middle)

    def _new(self, part: TrackedBeltPart, time: float) -> TrackedBeltPart:
        """Add a part that came in view; forget those that have left the belt."""
        self.parts = [*(each for each in self.parts if each.time_at(self.belt.end) > time), part]
        return part
