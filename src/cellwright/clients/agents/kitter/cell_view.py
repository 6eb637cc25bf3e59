"""Cell view of the kitter: discovered sensors, AGV states, and the parts in bins and on trays."""

import logging
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any

from cellwright.clients.agents.kitter import perception
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.workplace import Area, TrayPlace, Workplace
from cellwright.clients.client import Client
from cellwright.clients.client.pictures import picture_topics
from cellwright.middleware.messages.conversions import pose_from_transform
from cellwright.middleware.messages.osrf_gear import LogicalCameraImage, Proximity
from cellwright.util.errors import CellwrightError
from cellwright.util.pose import Pose

log = logging.getLogger(__name__)

FRAME_SUFFIX = "_frame"
QUALITY_SENSOR_PREFIX = "quality_control_sensor_"
DISCOVERY_TIME = 0.25
"""Listening time [s]: cameras publish their frames ten times a second."""

SURFACE_TOLERANCE = 0.02
"""Largest distance [m] of a part's origin from the surface that it lies on."""
STACK_HEIGHT = 0.08
"""Largest height [m] of a part above a surface on which it lies on others."""
SAME_PART_DISTANCE = 0.03
"""Distance [m] within which two cameras see the same part of a type."""
FAULT_IMAGES = 3
"""Images needed to detect a fault."""


def find_sensors(client: Client, arm_T_world: Pose) -> tuple[dict[str, Pose], dict[str, Pose]]:
    """Return the poses of logical cameras and break beams by name, from their frames and first messages.

    They are in the arm's frame, in which the world is at `arm_T_world`.
    """
    frames: dict[str, Pose] = {}

    def take(message: Any) -> None:
        for transform in message.transforms:
            if transform.header.frame_id == "world" and transform.child_frame_id.endswith(FRAME_SUFFIX):
                name = transform.child_frame_id.removesuffix(FRAME_SUFFIX)
                frames[name] = arm_T_world @ pose_from_transform(transform.transform)

    leave = [client.subscribe(topic, take) for topic in ("/tf_static", "/tf")]
    client.sleep(DISCOVERY_TIME)
    for each in leave:
        each()
    first: dict[str, Any] = {}
    listening = []
    topics = client.transport.topics()
    for name in frames:
        # without a look at pictures, of which the first starts a process that draws
        if not name.startswith(QUALITY_SENSOR_PREFIX) and not picture_topics(f"/ariac/{name}", topics):
            # A bin, a load point: a frame, but no sensor.
            with suppress(CellwrightError):
                listening.append(client.on_sensor(name, lambda message, name=name: first.setdefault(name, message)))  # type: ignore[misc]
    client.sleep(DISCOVERY_TIME)
    for each in listening:
        each()
    cameras, beams = (
        {name: frames[name] for name, message in sorted(first.items()) if isinstance(message, kind)}
        for kind in (LogicalCameraImage, Proximity)
    )
    log.info("%.1f s: cameras %s; beams %s", client.time, list(cameras), list(beams))
    return cameras, beams


class CellView:
    """The agent's knowledge of the cell.

    Cameras over a belt are listened to continuously if parts of some types arrive there: `belt_types`, by the belt's
    name. All others, like the quality sensors, are read only on request.
    """

    def __init__(
        self, client: Client, catalogue: Catalogue, workplace: Workplace, belt_types: Mapping[str, Sequence[str]]
    ) -> None:
        cameras, beams = find_sensors(client, workplace.arm_T_world)
        self.workplace = workplace
        self.belts = [
            perception.BeltWatch(client, belt, beams, types, catalogue)
            for belt in workplace.belts
            if (types := belt_types.get(belt.belt.name, ()))
        ]
        self._client = client
        self._catalogue = catalogue
        self.not_upright: set[str] = set()
        """Types seen with another side up, or not on the floor of their bin."""
        self._cameras: list[perception.CameraView] = []
        self._watching: set[str] = set()
        self._begun: set[str] = set()
        self._seen: set[str] = set()
        for name, world_T_camera in cameras.items():
            camera = perception.CameraView(client, name, world_T_camera, catalogue, workplace.arm_T_world)
            over = [each for each in self.belts if each.belt.area.meets(camera.view)]
            if over:
                camera.on_image = partial(_take_image, over)
                camera.listen()
                self._watching.add(name)
            self._cameras.append(camera)
        stations = workplace.stations.values()
        self._faults = {
            each.number: perception.Images(
                client, f"{QUALITY_SENSOR_PREFIX}{each.number}", catalogue, workplace.arm_T_world
            )
            for each in stations
            if each.has_quality_sensor
        }
        self._states = {each.number: client.latest(f"/ariac/{each.name}/state") for each in stations}

    def watch_stations(self, on: bool) -> None:  # noqa: FBT001
        """Subscribe to the AGVs and trays or unsubscribe: each publishes its state in every step."""
        for state in self._states.values():
            (state.listen if on else state.cancel)()

    def is_ready(self, number: int) -> bool:
        """Return whether an AGV was at its load point in its last message, or a fixed tray ready to be loaded."""
        message = self._states[number].message
        return message is not None and message.data == "ready_to_deliver"

    def note_change(self, *areas: Area) -> None:
        """Drop all images, as something was moved, and begin at once to take fresh ones of some areas."""
        self._seen.clear()
        self._begun.clear()
        for sensor in (*self._cameras, *self._faults.values()):
            sensor.newest.clear()
        self._begin(areas)

    def look(self, *areas: Area) -> None:
        """Take images of some areas with the cameras that see them, but for those taken since the last change."""
        self._begin(areas)
        looking = [each for each in self._cameras if each.name in self._begun]
        perception.wait_for_images(self._client, looking)
        for camera in looking:
            if camera.name not in self._watching:
                camera.rest()
        self._begun.difference_update(each.name for each in looking)
        self._seen.update(each.name for each in looking)

    def faulty_on_tray(self, number: int) -> tuple[Pose, ...]:
        """Return the poses of faulty parts on a tray, from images since the last change; none without a sensor."""
        if number not in self._faults:
            return ()
        self._begin([self.workplace.stations[number].area])
        sensor = self._faults[number]
        perception.wait_for_images(self._client, [sensor], FAULT_IMAGES)
        sensor.rest()
        self._begun.discard(sensor.name)
        self._seen.add(sensor.name)
        return tuple(part.world_T_part for part in sensor.newest[-1].parts) if sensor.newest else ()

    def _begin(self, areas: Sequence[Area]) -> None:
        """Begin to take images of some areas, and of faults there, but for those taken since the last change."""
        wanted: list[perception.Images] = [
            camera for camera in self._cameras if any(area.meets(camera.view) for area in areas)
        ]
        wanted += [each for number, each in self._faults.items() if self.workplace.stations[number].area in areas]
        for sensor in wanted:
            if sensor.name not in self._begun | self._seen:
                sensor.listen()
                self._begun.add(sensor.name)

    def parts_in_bins(self) -> list[perception.Sighting]:
        """Return the parts that lay flat in the bins at the last look, as far as cameras saw them."""

        def surface(x: float, y: float) -> float | None:
            over = self.workplace.bin_at(x, y)
            return None if over is None else over.surface

        return self._lying(surface)

    def parts_on_tray(self, station: TrayPlace) -> list[perception.Sighting]:
        """Return the parts that lay on a tray at the last look, as far as cameras saw them."""
        return self._lying(lambda x, y: station.surface if station.covers(x, y) else None)

    def forget(self, part: perception.TrackedBeltPart) -> None:
        """Forget a part that has left its belt, or that was tried in vain."""
        for belt in self.belts:
            belt.forget(part)

    def sees(self, pose: Pose) -> bool:
        """Return whether a place is well inside the view of a camera."""
        return any(perception.is_well_in_view(camera.world_T_camera, pose.position) for camera in self._cameras)

    def _lying(self, surface_at: Callable[[float, float], float | None]) -> list[perception.Sighting]:
        """Return the parts that lay on a surface, given by its height over each point; None where it is not."""
        found: list[perception.Sighting] = []
        for camera in self._cameras:
            for part in camera.resting:
                if part.type not in self._catalogue:  # its order came after the image
                    continue
                x, y, z = part.world_T_part.position
                z -= self._catalogue.figures(part.type).below
                if (surface := surface_at(x, y)) is None:
                    continue
                if not -SURFACE_TOLERANCE < z - surface < STACK_HEIGHT or not part.is_upright:
                    self.not_upright.add(part.type)
                    continue
                if not any(
                    each.type == part.type
                    and perception.distance(each.world_T_part, part.world_T_part) < SAME_PART_DISTANCE
                    for each in found
                ):
                    found.append(part)
        return found


def _take_image(belts: Sequence[perception.BeltWatch], image: perception.Image) -> None:
    for belt in belts:
        belt.take_image(image)
