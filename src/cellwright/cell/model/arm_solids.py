"""Solid shapes of the arm, link by link.

They lie within 2 mm of the outlines of the original's collision meshes, and nothing else of the arm is solid. The base
is a foot with a socket, tubes and collars are cylinders, housings of joints are drums with slanted, rounded ends. With
them the arm rests on a bin's rim when a program drives the tool into a part. It passes the posts beside the bins or
hits them.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal, TypeAlias

from cellwright.engine import colours, shapes
from cellwright.engine.shapes import HERE, Colour, Shape, at, box, cylinder
from cellwright.util.pose import Pose, Vector3

_CORNERS = 32
_SWAPPED = Pose.from_rpy((0.0, 0.0, 0.0), (math.pi / 2, 0.0, math.pi))  # swaps y and z
_FOOT_CORNERS = (
    (0.0, 0.075),
    (12.0, 0.0759),
    (25.0, 0.0808),
    (38.0, 0.0916),
    (45.0, 0.095),
    (52.0, 0.0916),
    (65.0, 0.0808),
    (78.0, 0.0759),
)
"""Corners of the foot's first quarter: angle [deg] and radius [m]; the others are like it."""


@dataclass(frozen=True, slots=True)
class Housing:
    """Convex drum around a joint, with slanted, rounded ends.

    Attributes:
        axis: the drum's axis is parallel to this axis of the link.
        sections: cross-sections from the lowest coordinate along the axis upward. They shift and slant along z where
            the axis is y, along y where it is z.
    """

    axis: Literal["y", "z"]
    sections: tuple[shapes.Circle, ...]

    @property
    def pose(self) -> Pose:
        """The drum's mesh in the frame of the link."""
        return _SWAPPED if self.axis == "y" else HERE

    @property
    def mesh(self) -> shapes.Mesh:
        """The drum; its axis is parallel to z."""
        return shapes.lofted(self.sections, _CORNERS)

    @property
    def plain(self) -> Shape:
        """The cylinder around the drum's axis with its largest radius, for formats without drums."""
        widest = max(self.sections, key=lambda section: section.radius)
        low, high = self.sections[0].height, self.sections[-1].height
        centre = at(y=widest.shift, z=(low + high) / 2)
        return cylinder(widest.radius, high - low, self.pose @ centre, colours.ARM_GREY)


@dataclass(frozen=True, slots=True)
class Block:
    """Convex block over flat outlines with equal numbers of corners.

    Attributes:
        outlines: corners of each outline [m] in the frame of the link, counter-clockwise seen from the last one.
        plain: simple shape in its place, for formats without blocks.
    """

    pose: ClassVar = HERE

    outlines: tuple[tuple[Vector3, ...], ...]
    plain: Shape

    @property
    def mesh(self) -> shapes.Mesh:
        """The block in the frame of the link."""
        return shapes.joined(self.outlines)


Solid: TypeAlias = Shape | Housing | Block
"""A solid shape of a link, in its frame."""


def _housing(axis: Literal["y", "z"], *sections: tuple[float, ...]) -> Housing:
    return Housing(axis, tuple(shapes.Circle(*section) for section in sections))


def along_y(radius: float, low: float, high: float, z: float, colour: Colour = colours.ARM_GREY) -> Shape:
    """Return a cylinder from y = `low` to y = `high` at height z [m]: most joints turn about their link's y axis."""
    pose = Pose.from_rpy((0.0, (low + high) / 2, z), (math.pi / 2, 0.0, 0.0))
    return cylinder(radius, high - low, pose, colour)


def along_z(radius: float, low: float, high: float, y: float = 0.0, colour: Colour = colours.ARM_GREY) -> Shape:
    """Return a cylinder from z = `low` to z = `high` at the given y [m]."""
    return cylinder(radius, high - low, at(y=y, z=(low + high) / 2), colour)


def _foot(height: float, widest: float) -> tuple[Vector3, ...]:
    """Return the foot's outline at a height, within a circle of radius `widest` [m]: a cone cuts its corners."""
    corners = [(math.radians(angle + turn), reach) for turn in (0, 90, 180, 270) for angle, reach in _FOOT_CORNERS]
    return tuple(
        (min(reach, widest) * math.cos(angle), min(reach, widest) * math.sin(angle), height) for angle, reach in corners
    )


def _across_y(y: float, half: float, low: float, high: float) -> tuple[Vector3, ...]:
    """Return a rectangle at `y`, from -`half` to `half` along x and from `low` to `high` along z [m]."""
    return ((-half, y, low), (-half, y, high), (half, y, high), (half, y, low))


FOOT = Block(
    (_foot(0.0, 0.095), _foot(0.012, 0.095), _foot(0.025, 0.085), _foot(0.038, 0.075)), along_z(0.075, 0.0, 0.038)
)
"""Foot of the base: square with round corners, and round at its upper end."""

SOCKET = Block(
    (
        _across_y(-0.092, 0.0105, 0.0083, 0.0297),
        _across_y(-0.076, 0.0205, 0.0, 0.038),
        _across_y(-0.0712, 0.061, 0.0, 0.012),
        _across_y(-0.062, 0.043, 0.0, 0.038),
    ),
    box(0.04, 0.03, 0.03, at(y=-0.077, z=0.019), colours.ARM_GREY),
)
"""Socket of the base; the original's mesh joins it to the corners of the foot."""

SOLID: Mapping[str, tuple[Solid, ...]] = {
    "base_link": (FOOT, SOCKET),
    "shoulder_link": (
        _housing(
            "z",
            (0.0752, -0.089),
            (0.0752, 0.057, 0.0, 0.087),
            (0.072, 0.073, 0.001, 0.087),
            (0.0665, 0.0826, 0.006, 0.087),
        ),
        along_y(0.0752, 0.0, 0.086, 0.0),
    ),
    "upper_arm_link": (
        _housing(
            "y",
            (0.0748, -0.135),
            (0.0745, -0.01),
            (0.0738, 0.006, 0.001, 0.087),
            (0.0727, 0.023, 0.002, 0.087),
            (0.0706, 0.031, 0.0035, 0.087),
            (0.055, 0.0377, 0.014, 0.087),
        ),
        _housing(
            "z", (0.0748, 0.03, -0.045), (0.0746, 0.0885, -0.045), (0.0712, 0.095, -0.045), (0.058, 0.097, -0.045)
        ),
        along_z(0.0542, 0.097, 0.5395, y=-0.045),
        along_z(0.0578, 0.5395, 0.612, y=-0.045),
        _housing(
            "y",
            (0.0593, -0.1047, 0.612),
            (0.0605, -0.02, 0.612, -0.13),
            (0.059, 0.0065, 0.611, -0.13),
            (0.0565, 0.013, 0.609, -0.13),
            (0.05, 0.0182, 0.604, -0.13),
        ),
    ),
    "forearm_link": (
        _housing(
            "y",
            (0.0445, -0.0640, 0.0163, -0.13),
            (0.0445, -0.0622, 0.0005, -0.13),
            (0.0525, -0.0575, 0.0005, -0.13),
            (0.0568, -0.0505, 0.001, -0.13),
            (0.0588, -0.0365, 0.0015, -0.13),
            (0.0573, 0.0),
            (0.0573, 0.0673),
        ),
        _housing("z", (0.0577, 0.02), (0.0577, 0.072), (0.0563, 0.075), (0.0523, 0.077), (0.0455, 0.0785)),
        along_z(0.0433, 0.0785, 0.5723, y=-0.0009),
        _housing(
            "y",
            (0.038, -0.0545, 0.5723, 0.09),
            (0.0435, -0.05, 0.5723, 0.09),
            (0.0462, -0.043, 0.5723, 0.09),
            (0.0458, 0.0609, 0.5723),
        ),
    ),
    "wrist_1_link": (
        along_y(0.045, 0.0609, 0.1149, 0.0),
        _housing(
            "z",
            (0.038, -0.0535, 0.1149, 0.087),
            (0.0428, -0.05, 0.1149, 0.087),
            (0.0457, -0.043, 0.1149, 0.087),
            (0.0452, 0.062, 0.1149),
        ),
    ),
    "wrist_2_link": (
        along_z(0.045, 0.062, 0.1157),
        _housing(
            "y",
            (0.038, -0.0545, 0.1157, 0.087),
            (0.0428, -0.05, 0.1157, 0.087),
            (0.0457, -0.043, 0.1157, 0.087),
            (0.045, 0.0616, 0.1157),
        ),
    ),
    "wrist_3_link": (_housing("y", (0.045, 0.0616), (0.045, 0.078), (0.0412, 0.0855), (0.0328, 0.0921)),),
}
"""Collision shapes of each link, in its own frame; they are drawn as well.

Forearm and upper arm have a collar where the tube begins. Three convex shapes for such a link would fill the corner
between collar and housing, 7 and 12 mm deep.
"""
