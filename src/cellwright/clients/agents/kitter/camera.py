"""Cameras, looked through only when there is something to be seen: each image costs the cell work."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

from cellwright.clients.agents.kitter.areas import Area, is_well_in_view, view_of
from cellwright.clients.agents.kitter.eyes import Image, Seen, Sighting, resting
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.client import Client
from cellwright.middleware.messages.build import pose_from_message
from cellwright.util.pose import Pose, Vector3

IMAGES = 8
"""How many images are averaged."""

STALE = 0.005
"""What comes so soon [s] after one began to listen may have been said before: the newest image is latched."""


class Images:
    """The newest images of one sensor, while it is listened to.

    Args:
        client: whose sensor.
        name: the sensor's name.
        catalogue: the part types that are looked for.
        on_image: called with each image besides.
    """

    def __init__(
        self, client: Client, name: str, catalogue: Catalogue, on_image: Callable[[Image], None] | None = None
    ) -> None:
        self.name = name
        self.newest: deque[Image] = deque(maxlen=IMAGES)
        self._client = client
        self._catalogue = catalogue
        self._on_image = on_image
        self._since = 0.0
        self._leave: Callable[[], None] | None = None

    def listen(self) -> None:
        """Take images from now on; those that were taken before are forgotten."""
        self.newest.clear()
        if self._leave is None:
            self._since = self._client.time
            self._leave = self._client.on_sensor(self.name, self._take)

    def rest(self) -> None:
        """Take no more images; those that were taken are kept."""
        if self._leave is not None:
            self._leave()
            self._leave = None

    def _take(self, message: Any) -> None:
        time = self._client.time
        if time < self._since + STALE:
            return
        world_T_camera = pose_from_message(message.pose)
        parts = tuple(
            Seen(model.type, self._catalogue.turned(model.type, world_T_camera @ pose_from_message(model.pose)))
            for model in message.models
            if model.type in self._catalogue
        )
        image = Image(time, parts)
        self.newest.append(image)
        if self._on_image is not None:
            self._on_image(image)


class Camera(Images):
    """A logical camera.

    Args:
        client: whose camera.
        name: the sensor's name.
        world_T_camera: where it is.
        catalogue: the part types that are looked for.
        on_image: called with each image besides.
    """

    def __init__(
        self,
        client: Client,
        name: str,
        world_T_camera: Pose,
        catalogue: Catalogue,
        on_image: Callable[[Image], None] | None = None,
    ) -> None:
        super().__init__(client, name, catalogue, on_image)
        self._world_T_camera = world_T_camera
        self._view = view_of(world_T_camera, catalogue.reach)

    def parts(self) -> list[Sighting]:
        """The parts that lie still in view, as the newest images agree."""
        return resting(tuple(self.newest))

    def may_see(self, area: Area) -> bool:
        """Whether a part in an area can be in view, even if only with an edge."""
        return area.meets(self._view)

    def sees_well(self, point: Vector3) -> bool:
        """Whether a place of the world [m] is well inside the view."""
        return is_well_in_view(self._world_T_camera, point)


def take_fresh(client: Client, sensors: Sequence[Images], count: int = IMAGES) -> None:
    """Wait until each of the sensors has taken `count` images from now on: a tenth of a second each."""
    for sensor in sensors:
        sensor.listen()
    if sensors:
        client.wait_until(lambda: all(len(each.newest) >= count for each in sensors), timeout=count * 0.1 + 0.5)
