"""Collision and visual shapes of the arm, link by link, and its suction cup.

The solid shapes lie within 2 mm of the original's collision meshes. Tubes and collars are cylinders, housings of joints
are drums with slanted, rounded ends. With them the arm rests on a bin's rim when a program drives the tool into a part.
It passes the posts beside the bins or hits them.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from cellwright.engine import colours, shapes
from cellwright.engine.shapes import HERE, Colour, Role, Shape, Touch, Visuals, add_shape, at, box, cylinder, mesh
from cellwright.util.pose import Pose

_CORNERS = 32
_SWAPPED = Pose.from_rpy((0.0, 0.0, 0.0), (math.pi / 2, 0.0, math.pi))  # swaps y and z


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
    def cylinder(self) -> Shape:
        """The cylinder around the drum's axis with its largest radius, for formats without drums."""
        widest = max(self.sections, key=lambda section: section.radius)
        low, high = self.sections[0].height, self.sections[-1].height
        centre = at(y=widest.shift, z=(low + high) / 2)
        return cylinder(widest.radius, high - low, self.pose @ centre, colours.ARM_GREY)


def _housing(axis: Literal["y", "z"], *sections: tuple[float, ...]) -> Housing:
    return Housing(axis, tuple(shapes.Circle(*section) for section in sections))


def _along_y(radius: float, low: float, high: float, z: float, colour: Colour = colours.ARM_GREY) -> Shape:
    """Return a cylinder from y = `low` to y = `high` at height z [m]: most joints turn about their link's y axis."""
    pose = Pose.from_rpy((0.0, (low + high) / 2, z), (math.pi / 2, 0.0, 0.0))
    return cylinder(radius, high - low, pose, colour)


def _along_z(radius: float, low: float, high: float, y: float = 0.0, colour: Colour = colours.ARM_GREY) -> Shape:
    """Return a cylinder from z = `low` to z = `high` at the given y [m]."""
    return cylinder(radius, high - low, at(y=y, z=(low + high) / 2), colour)


SOLID: Mapping[str, tuple[Shape | Housing, ...]] = {
    "base_link": (box(0.26, 0.34, 0.05, at(z=-0.025), colours.RAIL), _along_z(0.075, 0.0, 0.038)),
    "shoulder_link": (
        _housing(
            "z",
            (0.0752, -0.089),
            (0.0752, 0.057, 0.0, 0.087),
            (0.072, 0.073, 0.001, 0.087),
            (0.0665, 0.0826, 0.006, 0.087),
        ),
        _along_y(0.0752, 0.0, 0.086, 0.0),
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
        _along_z(0.0746, 0.03, 0.0965, y=-0.045),
        _along_z(0.0548, 0.0965, 0.53, y=-0.045),
        _along_z(0.058, 0.53, 0.612, y=-0.045),
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
            (0.045, -0.0642, 0.0165, -0.13),
            (0.045, -0.0622, 0.0, -0.13),
            (0.053, -0.0575, 0.0, -0.13),
            (0.0568, -0.0505, 0.001, -0.13),
            (0.0588, -0.0365, 0.0015, -0.13),
            (0.0573, 0.0),
            (0.0573, 0.0673),
        ),
        _along_z(0.0577, 0.02, 0.0805),
        _along_z(0.044, 0.0805, 0.5723, y=-0.0008),
        _housing(
            "y",
            (0.04, -0.0545, 0.5723, 0.09),
            (0.044, -0.05, 0.5723, 0.09),
            (0.0462, -0.043, 0.5723, 0.09),
            (0.0458, 0.0609, 0.5723),
        ),
    ),
    "wrist_1_link": (
        _along_y(0.045, 0.0609, 0.1149, 0.0),
        _housing(
            "z",
            (0.038, -0.0535, 0.1149, 0.087),
            (0.044, -0.05, 0.1149, 0.087),
            (0.0457, -0.043, 0.1149, 0.087),
            (0.0452, 0.062, 0.1149),
        ),
    ),
    "wrist_2_link": (
        _along_z(0.045, 0.062, 0.1157),
        _housing(
            "y",
            (0.038, -0.0545, 0.1157, 0.087),
            (0.044, -0.05, 0.1157, 0.087),
            (0.0457, -0.043, 0.1157, 0.087),
            (0.045, 0.0616, 0.1157),
        ),
    ),
    "wrist_3_link": (_housing("y", (0.045, 0.0616), (0.045, 0.078), (0.042, 0.0855), (0.033, 0.0921)),),
}
"""Collision shapes of each link, in its own frame; they are drawn as well.

Forearm and upper arm have a collar where the tube begins. Three convex shapes for such a link would fill the corner
between collar and housing, 7 and 12 mm deep.
"""

SEEN: Mapping[str, tuple[Shape, ...]] = {
    "base_link": (
        box(0.2, 0.2, 0.008, at(z=0.004), colours.STEEL_DARK),
        box(0.27, 0.05, 0.03, at(y=0.15, z=-0.02), colours.LINE_YELLOW),
        box(0.27, 0.05, 0.03, at(y=-0.15, z=-0.02), colours.LINE_YELLOW),
    ),
    "shoulder_link": (
        _along_z(0.062, 0.088, 0.094, colour=colours.ARM_JOINT),
        _along_y(0.077, 0.078, 0.086, 0.0, colours.STEEL_DARK),
    ),
    "upper_arm_link": (
        _along_y(0.062, 0.042, 0.05, 0.0, colours.ARM_JOINT),
        _along_y(0.051, 0.024, 0.032, 0.612, colours.ARM_JOINT),
        _along_z(0.0555, 0.09, 0.102, y=-0.045, colour=colours.STEEL_DARK),
        _along_z(0.0555, 0.535, 0.547, y=-0.045, colour=colours.STEEL_DARK),
        _along_y(0.063, -0.105, -0.097, 0.612, colours.STEEL_DARK),
    ),
    "forearm_link": (
        _along_y(0.05, -0.077, -0.069, 0.0, colours.ARM_JOINT),
        _along_y(0.038, -0.065, -0.058, 0.5723, colours.ARM_JOINT),
        _along_z(0.0445, 0.08, 0.09, colour=colours.STEEL_DARK),
        _along_z(0.0445, 0.505, 0.515, colour=colours.STEEL_DARK),
        _along_y(0.0475, 0.054, 0.061, 0.5723, colours.STEEL_DARK),
    ),
    "wrist_1_link": (
        _along_y(0.037, 0.1605, 0.167, 0.0, colours.ARM_JOINT),
        _along_z(0.0465, 0.056, 0.062, y=0.1149, colour=colours.STEEL_DARK),
    ),
    "wrist_2_link": (
        _along_z(0.037, 0.1615, 0.168, colour=colours.ARM_JOINT),
        _along_y(0.0465, 0.056, 0.0616, 0.1157, colours.STEEL_DARK),
    ),
    "wrist_3_link": (_along_y(0.031, 0.0921, 0.0945, 0.0, colours.STEEL_DARK),),
}
"""Visual-only shapes of each link, in its own frame."""

BEAM = box(0.2, 4.6, 0.1, HERE, colours.RAIL)
"""Beam of the rail, in the rail's frame."""

CUP = cylinder(0.05, 0.01, HERE, colours.CUP)
"""Plain disc that the suction cup stands for, in its link's frame."""

CUP_FACE_RADIUS = 0.038
"""Radius [m] of the flat face that grips."""

_CUP_SECTIONS = (shapes.Circle(CUP_FACE_RADIUS, -0.005), shapes.Circle(0.05, 0.003), shapes.Circle(0.05, 0.005))


def dress_rail(rail: Any, visuals: Visuals) -> None:
    """Add the beam. It belongs to the robot, so the arm passes through it as it did in the original."""
    add_shape(rail, BEAM, Role.BOTH, Touch.ROBOT)
    for side in (1.0, -1.0):
        visuals.add(
            rail.name,
            box(0.025, 4.6, 0.014, at(0.075 * side, 0.0, 0.055), colours.ALUMINIUM),
            box(0.24, 0.03, 0.16, at(0.0, 2.315 * side, 0.02), colours.LINE_YELLOW),
        )
    for y in (-2.1, 0.0, 2.1):
        visuals.add(
            rail.name,
            box(0.12, 0.12, 0.84, at(0.0, y, -0.47), colours.STEEL_DARK),
            box(0.3, 0.3, 0.012, at(0.0, y, -0.894), colours.STEEL_DARK),
        )


def dress_link(spec: Any, visuals: Visuals, body: Any, link: str) -> None:
    """Add the shapes of a link of the arm."""
    for number, solid in enumerate(SOLID[link], 1):
        shape = solid
        if isinstance(shape, Housing):
            name = f"{link} {number}"
            shapes.add_mesh(spec, name, shape.mesh)
            shape = mesh(name, colours.ARM_GREY, shape.pose)
        add_shape(body, shape, Role.BOTH, Touch.ROBOT)
    visuals.add(body.name, *SEEN[link])


def dress_cup(spec: Any, visuals: Visuals, gripper: Any, name: str, face: str, contact_time: float) -> None:
    """Add the suction cup, which grips with its lower face.

    A plain disc that sticks by its rim turns the wrist over instead of lying flat on a part. This cup has a flat face
    of radius 38 mm, a bevel 12 mm wide and 8 mm high, and next to no friction. Contacts are detected from 1 mm on, so
    that one on a part's small mark does not flicker.

    The geom `face` is the plain disc. It collides with nothing and is invisible: distances to it show what such a disc
    would touch.
    """
    shapes.add_mesh(spec, shapes.CUP, shapes.lofted(_CUP_SECTIONS, 24))
    cup = add_shape(gripper, mesh(shapes.CUP, colours.CUP), Role.BOTH, Touch.ROBOT, name=name)
    cup.friction[0] = 0.1
    cup.priority = 1
    cup.gap = 0.001
    cup.solref = (contact_time, 1.0)
    add_shape(gripper, CUP, Role.UNSEEN, name=face)
    visuals.add(
        gripper.name,
        cylinder(0.026, 0.004, at(z=0.0065), colours.ALUMINIUM),
        cylinder(0.0375, 0.0006, at(z=-0.0049), colours.LINE_YELLOW),
    )
