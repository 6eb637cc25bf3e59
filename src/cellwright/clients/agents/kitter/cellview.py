"""The cell as the agent knows it: what its sensors and the public topics tell, by place."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from cellwright.clients.agents.kitter.agvs import AgvStates
from cellwright.clients.agents.kitter.areas import BELT, BIN_SURFACE, TRAY_SURFACE, Area, bin_at
from cellwright.clients.agents.kitter.belt_watch import BeltWatch
from cellwright.clients.agents.kitter.camera import IMAGES, Camera, Images, take_fresh
from cellwright.clients.agents.kitter.discovery import find_sensors
from cellwright.clients.agents.kitter.eyes import Sighting, distance
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.placing import STATIONS
from cellwright.clients.client import Client
from cellwright.util.pose import Pose

LEVEL = 0.02
"""How far [m] from a surface the origin of a part may be that lies on it."""

SAME = 0.03
"""Two cameras that see parts of a type this near [m] see one part."""

GLANCE = 3
"""So many images are enough to see whether there is a fault."""


class CellView:
    """What there is to know.

    A camera over the belt is looked through all the time if something comes along there. All others are, like the
    quality sensors, only when somebody asks for a look.

    Args:
        client: whose sensors.
        catalogue: the part types that are looked for.
        belt_types: those that come on the belt.
    """

    def __init__(self, client: Client, catalogue: Catalogue, belt_types: Iterable[str]) -> None:
        belt_types = tuple(belt_types)
        sensors = find_sensors(client)
        self.belt = BeltWatch(client, sensors.beams, belt_types, catalogue)
        self._client = client
        self._catalogue = catalogue
        self.not_upright: set[str] = set()
        """The types of which parts were seen with another side up, or not on the floor of their bin."""
        self._cameras: list[Camera] = []
        self._watching: set[str] = set()
        for name, world_T_camera in sensors.cameras.items():
            camera = Camera(client, name, world_T_camera, catalogue)
            if belt_types and camera.may_see(BELT):
                camera = Camera(client, name, world_T_camera, catalogue, self.belt.take_image)
                camera.listen()
                self._watching.add(name)
            self._cameras.append(camera)
        self._faults = {number: Images(client, f"quality_control_sensor_{number}", catalogue) for number in STATIONS}
        self.agvs = AgvStates(client)

    def look(self, *areas: Area) -> None:
        """Let the cameras that see something of these areas take fresh images; what others saw is forgotten."""
        for camera in self._cameras:
            camera.newest.clear()
        looking = [camera for camera in self._cameras if any(map(camera.may_see, areas))]
        take_fresh(self._client, looking, IMAGES)
        for camera in looking:
            if camera.name not in self._watching:
                camera.rest()

    def faulty_on_tray(self, number: int) -> tuple[Pose, ...]:
        """Where faulty parts lie on the tray of an AGV, in the world frame: takes fresh images."""
        sensor = self._faults[number]
        take_fresh(self._client, [sensor], GLANCE)
        sensor.rest()
        return tuple(part.world_T_part for part in sensor.newest[-1].parts) if sensor.newest else ()

    def parts_in_bins(self) -> list[Sighting]:
        """The parts that lay flat in the bins at the last look, as far as cameras saw them."""
        return self._lying(BIN_SURFACE, lambda x, y: bin_at(x, y) is not None)

    def parts_on_tray(self, world_T_tray: Pose) -> list[Sighting]:
        """The parts that lay on a tray at the last look, as far as cameras saw them."""
        x0, y0, _ = world_T_tray.position
        return self._lying(TRAY_SURFACE, lambda x, y: abs(x - x0) < 0.25 and abs(y - y0) < 0.35)

    def sees(self, pose: Pose) -> bool:
        """Whether a place is well inside the view of a camera."""
        return any(camera.sees_well(pose.position) for camera in self._cameras)

    def _lying(self, surface: float, is_inside: Callable[[float, float], bool]) -> list[Sighting]:
        found: list[Sighting] = []
        for camera in self._cameras:
            for part in camera.parts():
                if part.type not in self._catalogue:  # its order came after the image
                    continue
                x, y, z = part.world_T_part.position
                z -= self._catalogue.figures(part.type).below
                if not is_inside(x, y):
                    continue
                if abs(z - surface) > LEVEL or not part.is_upright:
                    self.not_upright.add(part.type)
                    continue
                if not any(
                    each.type == part.type and distance(each.world_T_part, part.world_T_part) < SAME for each in found
                ):
                    found.append(part)
        return found
