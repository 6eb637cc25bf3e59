"""What cameras say: pictures, their matrices, and points, each made only while somebody listens to it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from cellwright.bus import Bus
from cellwright.contracts import pictures
from cellwright.contracts.gear.devices import GearDevices
from cellwright.contracts.gear.rows import camera_rows
from cellwright.contracts.sampling import Streamed
from cellwright.contracts.table import Row
from cellwright.devices.sensors.picture_camera import Picture, PictureCamera
from cellwright.messages import Message

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
