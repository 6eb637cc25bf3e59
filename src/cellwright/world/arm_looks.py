"""What the arm touches with and looks like, link by link, and its suction cup.

The shapes fit a UR10: housings of the joints as cylinders, tubes as capsules. They are what the arm rests with on a bin's
rim when a program drives the tool into a part.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cellwright.pose import Pose
from cellwright.world import colours, meshes
from cellwright.world.shapes import Role, Shape, Touch, add_shape, at, box, capsule, cylinder, mesh

_LENGTHWISE = (1.5708, 0.0, 0.0)  # turns a cylinder's axis from z to y


def _across(radius: float, length: float, y: float, z: float, colour: colours.Colour) -> Shape:
    """A cylinder along the link's y axis, the axis of its joints."""
    return cylinder(radius, length, Pose.from_rpy((0.0, y, z), _LENGTHWISE), colour)


_SOLID: Mapping[str, tuple[Shape, ...]] = {
    "base_link": (
        box(0.26, 0.34, 0.05, at(z=-0.025), colours.RAIL),
        cylinder(0.095, 0.05, at(z=0.025), colours.ARM_GREY),
    ),
    "shoulder_link": (
        cylinder(0.085, 0.18, at(z=-0.01), colours.ARM_GREY),
        _across(0.083, 0.13, 0.075, 0.0, colours.ARM_GREY),
    ),
    "upper_arm_link": (
        _across(0.088, 0.155, -0.005, 0.0, colours.ARM_GREY),
        capsule(0.065, 0.612, at(z=0.306), colours.ARM_GREY),
        _across(0.07, 0.15, -0.025, 0.612, colours.ARM_GREY),
    ),
    "forearm_link": (
        _across(0.068, 0.13, 0.02, 0.0, colours.ARM_GREY),
        capsule(0.05, 0.5723, at(z=0.28615), colours.ARM_GREY),
        _across(0.05, 0.11, 0.01, 0.5723, colours.ARM_GREY),
    ),
    "wrist_1_link": (_across(0.048, 0.11, 0.1, 0.0, colours.ARM_GREY),),
    "wrist_2_link": (
        cylinder(0.048, 0.11, at(z=0.0), colours.ARM_GREY),
        cylinder(0.046, 0.1, at(z=0.1), colours.ARM_GREY),
    ),
    "wrist_3_link": (_across(0.046, 0.05, 0.065, 0.0, colours.ARM_GREY),),
}

_SEEN: Mapping[str, tuple[Shape, ...]] = {
    "base_link": (
        box(0.27, 0.28, 0.012, at(z=-0.006), colours.STEEL_DARK),
        cylinder(0.097, 0.012, at(z=0.056), colours.BLACK),
    ),
    "shoulder_link": (
        cylinder(0.087, 0.03, at(z=0.095), colours.ARM_JOINT),
        _across(0.0845, 0.012, 0.135, 0.0, colours.BLACK),
    ),
    "upper_arm_link": (
        _across(0.084, 0.035, 0.087, 0.0, colours.ARM_JOINT),
        _across(0.066, 0.035, 0.063, 0.612, colours.ARM_JOINT),
        cylinder(0.067, 0.012, at(z=0.14), colours.STEEL_DARK),
        cylinder(0.067, 0.012, at(z=0.5), colours.STEEL_DARK),
    ),
    "forearm_link": (
        _across(0.064, 0.03, -0.055, 0.0, colours.ARM_JOINT),
        cylinder(0.052, 0.01, at(z=0.12), colours.STEEL_DARK),
        cylinder(0.052, 0.01, at(z=0.48), colours.STEEL_DARK),
        _across(0.046, 0.025, -0.055, 0.5723, colours.ARM_JOINT),
    ),
    "wrist_1_link": (_across(0.046, 0.025, 0.165, 0.0, colours.ARM_JOINT),),
    "wrist_2_link": (cylinder(0.045, 0.02, at(z=-0.06), colours.ARM_JOINT),),
    "wrist_3_link": (_across(0.04, 0.012, 0.092, 0.0, colours.STEEL_DARK),),
}


def dress_rail(rail: Any) -> None:
    """The beam. It belongs to the robot, so the arm passes through it as it did in the original."""
    beam = box(0.2, 4.6, 0.1, Pose(), colours.RAIL)
    add_shape(rail, beam, Role.BOTH, Touch.ROBOT)
    for side in (1.0, -1.0):
        add_shape(rail, box(0.025, 4.6, 0.014, at(0.075 * side, 0.0, 0.055), colours.ALUMINIUM), Role.SEEN)
        add_shape(rail, box(0.24, 0.03, 0.16, at(0.0, 2.315 * side, 0.02), colours.LINE_YELLOW), Role.SEEN)
    for y in (-2.1, 0.0, 2.1):
        add_shape(rail, box(0.12, 0.12, 0.84, at(0.0, y, -0.47), colours.STEEL_DARK), Role.SEEN)
        add_shape(rail, box(0.3, 0.3, 0.012, at(0.0, y, -0.894), colours.STEEL_DARK), Role.SEEN)


def dress_link(body: Any, link: str) -> None:
    """Give a link of the arm its shapes."""
    for shape in _SOLID.get(link, ()):
        add_shape(body, shape, Role.BOTH, Touch.ROBOT)
    for shape in _SEEN.get(link, ()):
        add_shape(body, shape, Role.SEEN)


def dress_cup(spec: Any, gripper: Any, name: str, contact_time: float) -> None:
    """The suction cup, the lower face of which grips.

    A plain disc that sticks by its rim turns the wrist over instead of laying itself flat on a part. This one has a flat
    face of radius 38 mm, a bevel 12 mm wide and 8 mm high, and next to no friction; contacts are detected from 1 mm on,
    so that one on a part's small mark does not flicker.
    """
    meshes.add_mesh(spec, meshes.CUP, meshes.turned([(0.038, -0.005), (0.05, 0.003), (0.05, 0.005)], 24))
    cup = add_shape(gripper, mesh(meshes.CUP, colours.CUP), Role.BOTH, Touch.ROBOT, name=name)
    cup.friction[0] = 0.1
    cup.priority = 1
    cup.gap = 0.001
    cup.solref = (contact_time, 1.0)
    for shape in (
        cylinder(0.026, 0.02, at(z=0.013), colours.ALUMINIUM),
        cylinder(0.034, 0.004, at(z=0.006), colours.LINE_YELLOW),
    ):
        add_shape(gripper, shape, Role.SEEN)
