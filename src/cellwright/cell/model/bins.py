"""Bins for parts: a solid floor, walls on all sides or only at corners, a foot on wheels.

The figures are those of the bin of 2017, which is 0.725 m high. One of another size has walls of the same thickness
around its area for parts; one of another height has a foot and panels in proportion.
"""

import math
from collections.abc import Iterator
from typing import Any

from cellwright.config.layout.layout import Bin, Side
from cellwright.engine import colours
from cellwright.engine.shapes import Role, Visuals, add_shape, at, box, capsule, cylinder
from cellwright.util.pose import Pose

_HEIGHT = 0.725
"""Height [m] of the surface to which the other heights belong."""
_BASE, _SILL, _FOOT = 0.2005, 0.50569, 0.08
"""Heights [m] of the lower edge of walls, of the upper edge of panels on open sides, of the lower edge of the foot."""
_FLOOR = 0.225
"""Thickness [m] of the floor: nothing tunnels through it."""
_THICK, _CORNER, _WHEEL = 0.008, 0.134, 0.05
"""Thickness of walls, length of walls at the corners of open sides, radius of wheels [m]."""
_NARROW = 0.635
"""Inner edge [m] below which walls at corners get shorter, in proportion."""
_TURNS: tuple[Side, ...] = ("+x", "+y", "-x", "-y")


def add_bin(spec: Any, visuals: Visuals, each: Bin) -> None:
    """Add a bin. Foot and panels are only drawn: nothing gets there, and every solid shape costs time in each step."""
    body = spec.worldbody.add_body(name=each.name, pos=each.link.position, quat=each.link.quaternion)
    turns = round((each.link.yaw - each.pose.yaw) / (math.pi / 2)) % 4
    width, depth = (edge / 2 + each.gap for edge in (each.size[1::-1] if turns % 2 else each.size))
    is_open = {_TURNS[(_TURNS.index(side) - turns) % 4] for side in each.open}
    scale = each.surface / _HEIGHT
    base, sill = _BASE * scale, min(_SILL * scale, each.surface)
    top = each.surface + each.walls

    add_shape(body, box(2 * width, 2 * depth, _FLOOR, at(z=each.surface - _FLOOR / 2), colours.BIN_FLOOR), Role.BOTH)
    foot = base - _FOOT * scale
    visuals.add(body.name, box(2 * width + 0.033, 2 * depth + 0.033, foot, at(z=base - foot / 2), colours.STEEL_DARK))
    for side in (1.0, -1.0):
        for end in (1.0, -1.0):
            radius = _WHEEL * scale
            wheel = Pose.from_rpy((_inset(width) * side, _inset(depth) * end, radius), (math.pi / 2, 0.0, 0.0))
            visuals.add(body.name, cylinder(radius, 0.03, wheel, colours.RUBBER))
        for axis, length, middle in (
            ("x", 2 * depth, Pose.from_rpy(((width + _THICK / 2) * side, 0.0, 0.0), (0.0, 0.0, math.pi / 2))),
            ("y", 2 * (width + _THICK), at(0.0, (depth + _THICK / 2) * side)),
        ):
            opened = ("+" if side > 0 else "-") + axis in is_open
            walls = list(_walls(length, middle, is_open=opened)) if each.walls > 0 else []
            for foot_of_wall, wall in walls:
                _add_wall(body, foot_of_wall, wall, base, top)
            panel = length - sum(wall for _, wall in walls) - (0.011 if walls else 0.0)
            if panel > 0:
                upper = sill if walls else each.surface
                shape = box(panel, _THICK, upper - base, middle @ at(z=(upper + base) / 2), colours.BIN)
                visuals.add(body.name, shape)


def _inset(half: float) -> float:
    """Return the distance of a wheel from the middle, for half an edge of the area [m]."""
    return max(half - 0.0575, half / 2)


def _walls(length: float, middle: Pose, *, is_open: bool) -> Iterator[tuple[Pose, float]]:
    """Yield middle and length of the walls of a side: one, or two at the corners, with a room between them."""
    if not is_open:
        yield middle, length
        return
    corner = _CORNER * min(1.0, length / _NARROW)
    for end in (1.0, -1.0):
        yield middle @ at((length / 2 - corner / 2) * end), corner


def _add_wall(body: Any, foot: Pose, length: float, bottom: float, top: float) -> None:
    """Add a wall along x of `foot` with a rounded upper edge.

    Between a flat part and the narrow flat top of a box the engine sometimes finds a contact that points sideways.
    """
    radius = _THICK / 2
    shoulder = top - radius
    plate = box(length, _THICK, shoulder - bottom, foot @ at(z=(shoulder + bottom) / 2), colours.BIN)
    edge = foot @ Pose.from_rpy((0.0, 0.0, shoulder), (0.0, math.pi / 2, 0.0))
    add_shape(body, plate, Role.BOTH)
    add_shape(body, capsule(radius, length - _THICK, edge, colours.BIN), Role.BOTH)
