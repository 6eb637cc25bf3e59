"""Trays: plates with rims that kits are built on, on an AGV or on a stand of their own."""

import math
from typing import Any

from cellwright.config.layout.layout import PLATE_TOP, Station, Tray
from cellwright.engine import colours
from cellwright.engine.shapes import HERE, Role, Touch, Visuals, add_shape, at, box, capsule
from cellwright.util.pose import Pose

TRAY_MASS = 1.0
"""Mass [kg] of a tray."""

RIM_TOP = 0.0254
"""Height [m] of the rim of an AGV's tray over its link."""

_THICKNESS = 0.08
"""Thickness [m] of a plate below its surface: more than it looks, so that nothing falls through."""

_CAPSULE = 0.0068
"""Diameter [m], about, of the capsules that a rim is a stack of."""

_DIGITS = 9
"""Decimals [m] that lengths of a rim are rounded to: those of the drawings, whatever the arithmetic leaves."""


def plate_name(station: Station) -> str:
    """Return the name of the geom that parts lie on on a tray."""
    return f"{station.tray_name}_plate"


def fill_tray(tray: Any, visuals: Visuals, station: Station, top: float, rim: float) -> None:
    """Add the plate and its four rims to a tray's body.

    A rim is a stack of thin capsules. A flat part that lands on the narrow top of a box gets a contact that points
    sideways about once in a thousand times. That contact flings it off.

    Args:
        tray: the body.
        visuals: shapes that are only seen.
        station: the place with the tray.
        top: height [m] of the surface over the body's origin.
        rim: height [m] of the rim over the body's origin; up to `top` for none.
    """
    width, depth = station.plate
    plate = box(width, depth, _THICKNESS, at(z=top - _THICKNESS / 2), colours.TRAY, 1.0)
    add_shape(tray, plate, Role.SOLID, Touch.FIXED, name=plate_name(station), mass=TRAY_MASS)
    visuals.add(tray.name, box(width, depth, 0.01, at(z=top - 0.005), colours.TRAY))
    layers = round((rim - top) / _CAPSULE) if rim > top else 0
    if layers == 0:
        return
    radius = (rim - top) / layers / 2
    for yaw, across, along in ((0.0, width, depth), (math.pi / 2, depth, width)):
        reach, length = round(across / 2 - 0.0005, _DIGITS), round(along - 0.001, _DIGITS)
        for side in (1.0, -1.0):
            wall = Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, yaw)) @ at(x=(reach + radius) * side)
            visuals.add(tray.name, box(0.002, length + 0.004, rim, wall @ at(z=rim / 2), colours.STEEL))
            for layer in range(layers):
                height = top + radius * (2 * layer + 1)
                lying = wall @ Pose.from_rpy((0.0, 0.0, height), (math.pi / 2, 0.0, 0.0))
                add_shape(tray, capsule(radius, length, lying, colours.STEEL), Role.SOLID)


def add_fixed_tray(spec: Any, visuals: Visuals, tray: Tray) -> None:
    """Add a fixed tray on a column from the floor."""
    frame = tray.tray_frame
    body = spec.worldbody.add_body(name=tray.tray_link, pos=frame.position, quat=frame.quaternion)
    fill_tray(body, visuals, tray, PLATE_TOP, PLATE_TOP + tray.rim)
    column = tray.surface - _THICKNESS
    if column > 0.0:
        middle = HERE @ at(z=PLATE_TOP - _THICKNESS - column / 2)
        width, depth = (edge * 0.4 for edge in tray.size)
        add_shape(body, box(width, depth, column, middle, colours.STEEL_DARK), Role.BOTH)
