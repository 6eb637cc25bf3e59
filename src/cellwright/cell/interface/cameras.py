"""What cameras say: pictures, their matrices, and points, each made only while somebody listens to it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from cellwright.cell.interface.devices import GearDevices
from cellwright.cell.interface.rows import camera_rows
from cellwright.middleware.bus import Bus
from cellwright.middleware.interface.sampling import Streamed
from cellwright.middleware.interface.table import Row
from cellwright.middleware.messages import Message
from cellwright.rendering.cameras import interface as pictures
from cellwright.rendering.cameras.picture_camera import Picture, PictureCamera

_Make = Callable[[Picture, PictureCamera], Message | None]


def bind_cameras(bus: Bus, devices: GearDevices) -> None:
    """Put the topics of all cameras on the bus."""
    for camera in devices.sensors.values():
        if isinstance(camera, PictureCamera):
            for row in camera_rows(camera.description):
                _stream(bus, row, camera)


def _stream(bus: Bus, row: Row, camera: PictureCamera) -> None:
    topic = row.template.removeprefix("/ariac/{sensor}")
    is_both = camera.description.has_colour and camera.description.has_depth
    make, colour, depth = {
        "/image_raw": (pictures.colour_message, True, False),
        "/camera_info": (pictures.info_message, False, False),
        "/depth/image_raw": (pictures.depth_message, False, True),
        "/depth/camera_info": (pictures.info_message, False, False),
        "/depth/points": (pictures.points_message, is_both, True),
        "": (pictures.cloud_message, False, True),
    }[topic]

    Streamed(bus, row, partial(camera.look, colour=colour, depth=depth), lambda picture: make(picture, camera))
