"""Which sensors the cell has: found by the frames and topics that it makes known, as any client could."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field
from typing import Any

from cellwright.clients.client import Client
from cellwright.middleware.messages.build import pose_from_transform
from cellwright.middleware.messages.osrf_gear import LogicalCameraImage, Proximity
from cellwright.util.errors import CellwrightError
from cellwright.util.pose import Pose

log = logging.getLogger(__name__)

SUFFIX = "_frame"
QUALITY = "quality_control_sensor_"
LISTEN = 0.25
"""How long to listen [s]: cameras make their frames known ten times a second."""


@dataclass
class Sensors:
    """The sensors of the cell that the agent has a use for, and where they are in the world frame."""

    cameras: dict[str, Pose] = field(default_factory=dict)
    beams: dict[str, Pose] = field(default_factory=dict)


def find_sensors(client: Client) -> Sensors:
    """Listen for a moment, and tell the sensors by their frames and by the type of their first message."""
    frames: dict[str, Pose] = {}

    def take(message: Any) -> None:
        for transform in message.transforms:
            if transform.header.frame_id == "world" and transform.child_frame_id.endswith(SUFFIX):
                frames[transform.child_frame_id.removesuffix(SUFFIX)] = pose_from_transform(transform.transform)

    leave = [client.subscribe(topic, take) for topic in ("/tf_static", "/tf")]
    client.sleep(LISTEN)
    for each in leave:
        each()
    first: dict[str, Any] = {}
    listening = []
    for name in frames:
        if name.startswith(QUALITY):
            continue
        try:
            listening.append(client.on_sensor(name, lambda message, name=name: first.setdefault(name, message)))  # type: ignore[misc]
        except CellwrightError:
            continue  # a bin, a load point: a frame, but no sensor
    client.sleep(LISTEN)
    for each in listening:
        each()
    sensors = Sensors()
    for name, message in sorted(first.items()):
        if isinstance(message, LogicalCameraImage):
            sensors.cameras[name] = frames[name]
        elif isinstance(message, Proximity):
            sensors.beams[name] = frames[name]
    log.info("%.1f s: cameras %s; beams %s", client.time, list(sensors.cameras), list(sensors.beams))
    return sensors
