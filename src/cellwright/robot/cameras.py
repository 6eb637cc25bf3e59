"""The cameras of a robot's configuration, and the topics that their pictures go out on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from cellwright.config.robot.camera_views import taking
from cellwright.config.robot.config import RobotConfig
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus
from cellwright.middleware.interface.sampling import Streamed
from cellwright.middleware.interface.table import Row
from cellwright.middleware.messages import Message
from cellwright.rendering.cameras import interface as pictures
from cellwright.rendering.cameras.picture_camera import Picture, PictureCamera
from cellwright.rendering.cameras.studio import Studio, hire_painter
from cellwright.robot.model.robot import body_of
from cellwright.util.errors import UsageError


def add_cameras(
    config: RobotConfig, simulation: Simulation, report: Callable[[str], None] = lambda _line: None
) -> dict[str, PictureCamera]:
    """The cameras of a robot, in their places, by name; one that cannot be made is reported and left out."""
    studio = Studio(simulation, partial(hire_painter, about=config.base_pose.position), report=report)
    found: dict[str, PictureCamera] = {}
    for described in config.cameras:
        try:
            if described.name in found:
                raise UsageError("there are two of this name")
            description = taking(config, described)
            camera = PictureCamera(replace(description, frame=body_of(description.frame)), studio, report=report)
            simulation.add(camera)
            found[described.name] = camera
        except UsageError as error:
            report(f"camera {described.name!r} takes no pictures: {error}")
    return found


class CameraTopics:
    """Puts pictures on the bus, made only while somebody listens.

    Args:
        cameras: by name.
        told: the time that messages carry [ns].
    """

    def __init__(self, cameras: dict[str, PictureCamera], told: Callable[[], int]) -> None:
        self._cameras, self._told = cameras, told

    def advertise(self, bus: Bus, table: tuple[Row, ...]) -> None:
        """Take a place on the bus."""
        for row in table:
            camera = self._cameras.get(row.subject or "")
            if camera is not None:
                self._stream(bus, row, camera)

    def _stream(self, bus: Bus, row: Row, camera: PictureCamera) -> None:
        kind = row.template.rpartition("/")[2]
        make = {
            "color": pictures.colour_message,
            "depth": pictures.depth_message,
            "camera_info": pictures.info_message,
        }[kind]

        def build(picture: Picture) -> Message | None:
            age = camera.simulation.now - picture.time_ns
            return make(replace(picture, time_ns=self._told() - age), camera)

        Streamed(bus, row, partial(camera.look, colour=kind == "color", depth=kind == "depth"), build)
