"""Looks of the arm: its solid shapes in the engine's model, what is only seen of it, and its suction cup."""

from collections.abc import Mapping
from typing import Any

from cellwright.cell.model.arm_solids import SOLID, along_y, along_z
from cellwright.engine import colours, shapes
from cellwright.engine.shapes import HERE, Role, Shape, Touch, Visuals, add_shape, at, box, cylinder, mesh

SEEN: Mapping[str, tuple[Shape, ...]] = {
    "base_link": (
        box(0.26, 0.34, 0.05, at(z=-0.025), colours.RAIL),
        box(0.2, 0.2, 0.008, at(z=0.004), colours.STEEL_DARK),
        box(0.27, 0.05, 0.03, at(y=0.15, z=-0.02), colours.LINE_YELLOW),
        box(0.27, 0.05, 0.03, at(y=-0.15, z=-0.02), colours.LINE_YELLOW),
    ),
    "shoulder_link": (
        along_z(0.062, 0.088, 0.094, colour=colours.ARM_JOINT),
        along_y(0.077, 0.078, 0.086, 0.0, colours.STEEL_DARK),
    ),
    "upper_arm_link": (
        along_y(0.062, 0.042, 0.05, 0.0, colours.ARM_JOINT),
        along_y(0.051, 0.024, 0.032, 0.612, colours.ARM_JOINT),
        along_z(0.0555, 0.09, 0.102, y=-0.045, colour=colours.STEEL_DARK),
        along_z(0.0555, 0.535, 0.547, y=-0.045, colour=colours.STEEL_DARK),
        along_y(0.063, -0.105, -0.097, 0.612, colours.STEEL_DARK),
    ),
    "forearm_link": (
        along_y(0.05, -0.077, -0.069, 0.0, colours.ARM_JOINT),
        along_y(0.038, -0.065, -0.058, 0.5723, colours.ARM_JOINT),
        along_z(0.0445, 0.08, 0.09, colour=colours.STEEL_DARK),
        along_z(0.0445, 0.505, 0.515, colour=colours.STEEL_DARK),
        along_y(0.0475, 0.054, 0.061, 0.5723, colours.STEEL_DARK),
    ),
    "wrist_1_link": (
        along_y(0.037, 0.1605, 0.167, 0.0, colours.ARM_JOINT),
        along_z(0.0465, 0.056, 0.062, y=0.1149, colour=colours.STEEL_DARK),
    ),
    "wrist_2_link": (
        along_z(0.037, 0.1615, 0.168, colour=colours.ARM_JOINT),
        along_y(0.0465, 0.056, 0.0616, 0.1157, colours.STEEL_DARK),
    ),
    "wrist_3_link": (along_y(0.031, 0.0921, 0.0945, 0.0, colours.STEEL_DARK),),
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
        if not isinstance(shape, Shape):
            name = f"{link} {number}"
            if spec.mesh(name) is None:  # arms of one cell share their meshes
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
    if spec.mesh(shapes.CUP) is None:
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
