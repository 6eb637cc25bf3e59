"""The cell as the agent knows it: what its sensors and the public topics tell, by place."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import Any

from cellwright.agents.kitter.belt_watch import BeltWatch
from cellwright.agents.kitter.discovery import find_sensors
from cellwright.agents.kitter.eyes import IMAGES, Camera, Sighting, distance
from cellwright.client import Client
from cellwright.description.layout import BIN_CENTRES, BIN_WIDTH
from cellwright.messages.build import pose_from_message
from cellwright.pose import Pose

BIN_SURFACE = 0.725
"""Height [m] of the surface that parts lie on in a bin."""

TRAY_SURFACE = 0.755
LEVEL = 0.02
"""How far [m] from a surface the origin of a part may be that lies on it."""

SAME = 0.03
"""Two cameras that see parts of a type this near [m] see one part."""


class CellView:
    """What there is to know.

    Args:
        client: whose sensors.
        belt_types: the types that come on the belt.
    """

    def __init__(self, client: Client, belt_types: Iterable[str]) -> None:
        sensors = find_sensors(client)
        self.belt = BeltWatch(client, sensors.beams, belt_types)
        self._client = client
        self._cameras = [Camera(client, name, self.belt.take_image) for name in sensors.cameras]
        self._poses = sensors.cameras
        self._agv_states: dict[int, str] = {}
        self._faulty: dict[int, tuple[Pose, ...]] = {}
        for number in (1, 2):
            client.subscribe(f"/ariac/agv{number}/state", partial(self._take_agv, number), passive=True)
            quality = f"/ariac/quality_control_sensor_{number}"
            client.subscribe(quality, partial(self._take_quality, number), passive=True)

    def _take_agv(self, number: int, message: Any) -> None:
        self._agv_states[number] = message.data

    def _take_quality(self, number: int, message: Any) -> None:
        world_T_camera = pose_from_message(message.pose)
        self._faulty[number] = tuple(world_T_camera @ pose_from_message(model.pose) for model in message.models)

    def agv_is_ready(self, number: int) -> bool:
        """Whether an AGV stands at its load point."""
        return self._agv_states.get(number) == "ready_to_deliver"

    def faulty_on_tray(self, number: int) -> tuple[Pose, ...]:
        """Where faulty parts lie on the tray of an AGV, in the world frame."""
        return self._faulty.get(number, ())

    def look(self, images: int = IMAGES) -> None:
        """Let the cameras take fresh images."""
        if self._cameras:
            self._cameras[0].look_afresh(images)

    def parts_in_bins(self) -> list[Sighting]:
        """The parts that lie flat in the bins, as far as cameras see them."""
        return self._lying(BIN_SURFACE, lambda x, y: bin_at(x, y) is not None)

    def parts_on_tray(self, world_T_tray: Pose) -> list[Sighting]:
        """The parts that lie on a tray, as far as cameras see them."""
        x0, y0, _ = world_T_tray.position
        return self._lying(TRAY_SURFACE, lambda x, y: abs(x - x0) < 0.25 and abs(y - y0) < 0.35)

    def sees(self, pose: Pose) -> bool:
        """Whether a place is well inside the view of a camera that looks straight down."""
        for camera in self._poses.values():
            x, y, z = camera.inverse().transform(pose.position)
            if 0.2 < x < 0.74 and abs(y) < 0.6 * x and abs(z) < 0.4 * x:
                return True
        return False

    def _lying(self, surface: float, is_inside: Any) -> list[Sighting]:
        found: list[Sighting] = []
        for camera in self._cameras:
            for part in camera.parts():
                x, y, z = part.world_T_part.position
                if abs(z - surface) > LEVEL or not is_inside(x, y) or not part.is_upright:
                    continue
                if not any(
                    each.type == part.type and distance(each.world_T_part, part.world_T_part) < SAME for each in found
                ):
                    found.append(part)
        return found


def bin_at(x: float, y: float) -> str | None:
    """The bin that holds a place of the world; None if none does."""
    for name, (centre_x, centre_y) in BIN_CENTRES.items():
        if max(abs(x - centre_x), abs(y - centre_y)) < BIN_WIDTH / 2:
            return name
    return None
