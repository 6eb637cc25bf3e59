"""Cell view of the kitter: discovered sensors, AGV states, and the parts in bins and on trays."""

import logging
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from typing import Any

from cellwright.clients.agents.kitter import perception
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.pick_and_place import STATIONS
from cellwright.clients.client import Client
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


def find_sensors(client: Client) -> tuple[dict[str, Pose], dict[str, Pose]]:
    """Return the world poses of logical cameras and break beams by name, from their frames and first messages."""
    frames: dict[str, Pose] = {}

    def take(message: Any) -> None:
        for transform in message.transforms:
            if transform.header.frame_id == "world" and transform.child_frame_id.endswith(FRAME_SUFFIX):
                frames[transform.child_frame_id.removesuffix(FRAME_SUFFIX)] = pose_from_transform(transform.transform)

    leave = [client.subscribe(topic, take) for topic in ("/tf_static", "/tf")]
    client.sleep(DISCOVERY_TIME)
    for each in leave:
        each()
    first: dict[str, Any] = {}
    listening = []
    for name in frames:
        if not name.startswith(QUALITY_SENSOR_PREFIX):
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

    Cameras over the belt are listened to continuously if parts of `belt_types` arrive there. All others, like the
    quality sensors, are read only on request.
    """

    def __init__(self, client: Client, catalogue: Catalogue, belt_types: Iterable[str]) -> None:
        belt_types = tuple(belt_types)
        cameras, beams = find_sensors(client)
        self.belt = perception.BeltWatch(client, beams, belt_types, catalogue)
        self._client = client
        self._catalogue = catalogue
        self.not_upright: set[str] = set()
        """Types seen with another side up, or not on the floor of their bin."""
        self._cameras: list[perception.CameraView] = []
        self._watching: set[str] = set()
        self._begun: set[str] = set()
        self._seen: set[str] = set()
        for name, world_T_camera in cameras.items():
            camera = perception.CameraView(client, name, world_T_camera, catalogue)
            if belt_types and perception.BELT.meets(camera.view):
                camera.on_image = self.belt.take_image
                camera.listen()
                self._watching.add(name)
            self._cameras.append(camera)
        self._faults = {
            number: perception.Images(client, f"quality_control_sensor_{number}", catalogue) for number in STATIONS
        }
        self._agvs = {number: client.latest(f"/ariac/agv{number}/state") for number in STATIONS}

    def watch_agvs(self, on: bool) -> None:  # noqa: FBT001
        """Subscribe to the AGVs or unsubscribe: each publishes its state in every step."""
        for state in self._agvs.values():
            (state.listen if on else state.cancel)()

    def is_agv_ready(self, number: int) -> bool:
        """Return whether an AGV was at its load point in its last message."""
        message = self._agvs[number].message
        return message is not None and message.data == "ready_to_deliver"

    def note_change(self, *areas: perception.Area) -> None:
        """Drop all images, as something was moved, and begin at once to take fresh ones of some areas."""
        self._seen.clear()
        self._begun.clear()
        for sensor in (*self._cameras, *self._faults.values()):
            sensor.newest.clear()
        self._begin(areas)

    def look(self, *areas: perception.Area) -> None:
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
        """Return the world poses of faulty parts on the tray of an AGV, from images since the last change."""
        self._begin([STATIONS[number].area])
        sensor = self._faults[number]
        perception.wait_for_images(self._client, [sensor], FAULT_IMAGES)
        sensor.rest()
        self._begun.discard(sensor.name)
        self._seen.add(sensor.name)
        return tuple(part.world_T_part for part in sensor.newest[-1].parts) if sensor.newest else ()

    def _begin(self, areas: Sequence[perception.Area]) -> None:
        """Begin to take images of some areas, and of faults there, but for those taken since the last change."""
        wanted: list[perception.Images] = [
            camera for camera in self._cameras if any(area.meets(camera.view) for area in areas)
        ]
        wanted += [self._faults[number] for number, station in STATIONS.items() if station.area in areas]
        for sensor in wanted:
            if sensor.name not in self._begun | self._seen:
                sensor.listen()
                self._begun.add(sensor.name)

    def parts_in_bins(self) -> list[perception.Sighting]:
        """Return the parts that lay flat in the bins at the last look, as far as cameras saw them."""
        return self._lying(perception.BIN_SURFACE, perception.is_in_bin)

    def parts_on_tray(self, world_T_tray: Pose) -> list[perception.Sighting]:
        """Return the parts that lay on a tray at the last look, as far as cameras saw them."""
        x0, y0, _ = world_T_tray.position
        return self._lying(
            perception.TRAY_SURFACE,
            lambda x, y: abs(x - x0) < perception.TRAY_HALF_X and abs(y - y0) < perception.TRAY_HALF_Y,
        )

    def sees(self, pose: Pose) -> bool:
        """Return whether a place is well inside the view of a camera."""
        return any(perception.is_well_in_view(camera.world_T_camera, pose.position) for camera in self._cameras)

    def _lying(self, surface: float, is_inside: Callable[[float, float], bool]) -> list[perception.Sighting]:
        found: list[perception.Sighting] = []
        for camera in self._cameras:
            for part in perception.resting_parts(tuple(camera.newest)):
                if part.type not in self._catalogue:  # its order came after the image
                    continue
                x, y, z = part.world_T_part.position
                z -= self._catalogue.figures(part.type).below
                if not is_inside(x, y):
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
