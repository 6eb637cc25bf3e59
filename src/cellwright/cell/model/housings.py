"""The bodies of sensors: drawn where they stand, touched and seen by nothing else."""

from __future__ import annotations

from typing import Any

from cellwright.config.trial.trial import Camera, Sensor
from cellwright.engine.geometry import colours
from cellwright.engine.geometry.shapes import Colour, Role, Shape, add_shape, at, box, cylinder
from cellwright.util.pose import Pose

_FORWARD = (0.0, 1.5708, 0.0)  # turns a cylinder's axis from z to x, the way a sensor looks


def _lens(radius: float, x: float, colour: Colour) -> Shape:
    return cylinder(radius, 0.012, Pose.from_rpy((x, 0.0, 0.0), _FORWARD), colour)


_OTHER = (box(0.06, 0.06, 0.06, at(x=-0.03), colours.SENSOR), _lens(0.02, 0.002, colours.SENSOR_LENS))

_HOUSINGS: dict[str, tuple[Shape, ...]] = {
    "break_beam": (
        box(0.05, 0.03, 0.05, at(x=-0.025), colours.SENSOR),
        _lens(0.009, 0.002, colours.SENSOR_BEAM),
    ),
    "proximity_sensor": (
        cylinder(0.015, 0.06, Pose.from_rpy((-0.03, 0.0, 0.0), _FORWARD), colours.STEEL_LIGHT),
        _lens(0.0145, 0.002, colours.SENSOR_LENS),
    ),
    "logical_camera": (
        box(0.11, 0.07, 0.07, at(x=-0.055), colours.SENSOR),
        _lens(0.026, 0.005, colours.SENSOR_LENS),
    ),
    "laser_profiler": (
        box(0.07, 0.12, 0.1, at(x=-0.03, z=0.06), colours.SENSOR),
        box(0.004, 0.09, 0.012, at(x=0.006, z=0.06), colours.SENSOR_BEAM),
    ),
}


_CAMERA = (
    box(0.024, 0.09, 0.026, at(x=-0.014), colours.SENSOR),
    _lens(0.009, -0.007, colours.SENSOR_LENS),
)  # all of it behind the eye, which is where the pose is


def add_housing(spec: Any, sensor: Sensor) -> None:
    """The housing of a sensor at its pose; that of a camera moves with what it is fixed to."""
    frame = sensor.frame if isinstance(sensor, Camera) else "world"
    body = spec.body(frame).add_body(
        name=f"{sensor.name} housing", pos=sensor.pose.position, quat=sensor.pose.quaternion
    )
    for shape in _CAMERA if isinstance(sensor, Camera) else _HOUSINGS.get(sensor.type, _OTHER):
        add_shape(body, shape, Role.SEEN)
