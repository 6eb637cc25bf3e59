"""What the agent knows of the parts: where to take hold of each type, and the floor that it covers.

Figures: the part models of the 2017 competition, which every team had in its hands.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from cellwright.errors import UnknownNameError
from cellwright.pose import Pose


@dataclass(frozen=True, slots=True)
class Disc:
    """A disc of the plane that a part lies in: x, y [m] in the part's frame, radius [m]."""

    x: float
    y: float
    radius: float


@dataclass(frozen=True, slots=True)
class PartFigures:
    """A part type as the agent handles it.

    Attributes:
        grip: where the middle of the cup goes: x, y [m] in the part's frame. It is chosen such that the cup's face
            (radius 38 mm) meets something solid and stays clear of a mark where it can.
        top: height [m] above the part's origin that the cup meets there first.
        outline: discs that cover the part's floor plan together.
    """

    grip: tuple[float, float]
    top: float
    outline: tuple[Disc, ...]

    @property
    def reach(self) -> float:
        """Radius [m] of the circle about the origin that holds the part."""
        return max(math.hypot(disc.x, disc.y) + disc.radius for disc in self.outline)

    def covers(self, frame_T_part: Pose) -> tuple[Disc, ...]:
        """The discs of a part that lies at a pose, in the frame of that pose."""
        yaw, (x, y, _) = frame_T_part.yaw, frame_T_part.position
        cos, sin = math.cos(yaw), math.sin(yaw)
        return tuple(
            Disc(x + cos * disc.x - sin * disc.y, y + sin * disc.x + cos * disc.y, disc.radius) for disc in self.outline
        )


def box_outline(length: float, width: float, x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> tuple[Disc, ...]:
    """Discs that cover a rectangle: `length` [m] along its own x axis, its middle at x, y [m], turned by yaw [rad]."""
    if length < width:
        return box_outline(width, length, x, y, yaw + math.pi / 2)
    count = math.ceil(length / width)
    step = length / count
    radius = math.hypot(step / 2, width / 2)
    places = [step * (index - (count - 1) / 2) for index in range(count)]
    return tuple(Disc(x + math.cos(yaw) * place, y + math.sin(yaw) * place, radius) for place in places)


_PARTS = {
    # the cup meets the mark, 3 mm above the wheel
    "gear_part": PartFigures((0.0, 0.0), 0.015, (Disc(0.0, 0.0, 0.0392),)),
    # the mark is just outside the face
    "disk_part": PartFigures((-0.008, -0.008), 0.02316, (Disc(0.0, 0.0, 0.0627),)),
    # hollow in the middle: the face rests on both sides, the mark is outside
    "gasket_part": PartFigures(
        (-0.012, 0.0), 0.02, (Disc(0.067, 0.0, 0.028), Disc(-0.067, 0.0, 0.028), Disc(0.0, 0.0, 0.065))
    ),
    # the origin is in the head, the middle of mass on the rod
    "piston_rod_part": PartFigures(
        (0.0, 0.04), 0.0075, (*box_outline(0.059, 0.052), *box_outline(0.031, 0.11, 0.0, 0.08))
    ),
    "pulley_part": PartFigures((0.0, 0.0), 0.0724, (Disc(0.0, 0.0, 0.1125),)),
    "part1": PartFigures((0.0, 0.0), 0.0075, box_outline(0.3, 0.1)),
    "part2": PartFigures((0.0, 0.0), 0.01, box_outline(0.06, 0.015)),
    "part3": PartFigures((0.03, 0.03), 0.02, box_outline(0.13, 0.07, 0.03, 0.03, 0.9)),
    "part4": PartFigures((0.0, 0.0), 0.005, box_outline(0.09, 0.06)),
}

PART_TYPES = frozenset(_PARTS)
"""The types that the agent can handle."""


def figures(part_type: str) -> PartFigures:
    """What the agent knows of a type.

    Raises:
        UnknownNameError: it knows nothing of this type.
    """
    try:
        return _PARTS[part_type]
    except KeyError:
        raise UnknownNameError("part type", part_type, _PARTS) from None
