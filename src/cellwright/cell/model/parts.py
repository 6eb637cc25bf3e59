"""Catalogue of part types: mass, collision shapes and visual shapes.

Figures: the part models of the 2017 competition. A part's origin is at the middle of its underside unless stated
otherwise. Where the original wrote a height into the wrong field (part1: yaw, part4: roll), so does this catalogue: the
shapes lie as in the original.
"""

from dataclasses import dataclass
from typing import Any

from cellwright.engine import colours, shapes
from cellwright.engine.shapes import Role, Shape, Touch, Visuals, add_shape, at, bounds, box, cylinder, mesh
from cellwright.util.errors import UnknownNameError
from cellwright.util.pose import Pose, Vector3

KNOWN_TYPES = (
    "part1",
    "part2",
    "part3",
    "part4",
    "arm_part",
    "cross_joint_part",
    "disk_part",
    "gasket_part",
    "gear_part",
    "piston_rod_part",
    "pulley_part",
    "t_brace_part",
    "u_joint_part",
)
"""Part types that a logical camera knows by name, including those without a model."""

STAYING_TYPES = frozenset({"disk_part", "gasket_part", "gear_part"})
"""Part types whose contact surfaces correct no penetration in the original; those of the others correct it slowly."""


@dataclass(frozen=True, slots=True)
class PartType:
    """Type of part.

    Attributes:
        name: as in the files, `gear_part`.
        mass: [kg].
        solid: collision shapes; they share the mass.
        seen: visual shapes; when empty, the solid shapes are drawn.
    """

    name: str
    mass: float
    solid: tuple[Shape, ...]
    seen: tuple[Shape, ...] = ()

    @property
    def box(self) -> tuple[Vector3, Vector3]:
        """Lower and upper corner [m] of the bounding box in the part's frame."""
        return bounds(self.solid)

    @property
    def bottom(self) -> float:
        """Lowest point [m] below (negative) or above the origin, upright."""
        return self.box[0][2]

    @property
    def top(self) -> float:
        """Highest point [m] above the origin, upright."""
        return self.box[1][2]


def _gear() -> PartType:
    bottom, top = -0.0001, 0.0119
    mark = cylinder(0.0039, 0.012, at(0.0, 0.021, 0.009), colours.MARK)
    hub = cylinder(0.012, 0.0124, at(z=0.0062), colours.STEEL_DARK)
    return PartType(
        "gear_part",
        0.5,
        (cylinder(0.0392, top - bottom, at(z=(bottom + top) / 2), colours.GEAR, 1.0), mark),
        (mesh(shapes.GEAR, colours.GEAR), hub, mark),
    )


def _disk() -> PartType:
    mark = cylinder(0.0039, 0.016, at(0.03, 0.03, 0.018), colours.MARK_LIGHT)
    return PartType(
        "disk_part",
        0.5,
        (cylinder(0.0627, 0.02316, at(z=0.01158), colours.DISK, 1.0), mark),
        (
            cylinder(0.0627, 0.02316, at(z=0.01158), colours.DISK),
            cylinder(0.052, 0.0004, at(z=0.02326), colours.STEEL_LIGHT),
            cylinder(0.047, 0.0005, at(z=0.02331), colours.DISK),
            cylinder(0.014, 0.0008, at(z=0.02346), colours.STEEL_DARK),
            mark,
        ),
    )


def _gasket() -> PartType:
    height, half = 0.02, 0.01
    mark = box(0.008, 0.008, 0.015, at(0.05, 0.0, 0.0175), colours.MARK_LIGHT)
    side = 0.028
    return PartType(
        "gasket_part",
        0.5,
        (
            cylinder(0.027, height, at(0.067, 0.0, half), colours.GASKET, 0.25),
            cylinder(0.027, height, at(-0.067, 0.0, half), colours.GASKET, 0.25),
            box(0.1, 0.0175, height, Pose.from_rpy((0.0, side, half), (0.0, 0.0, 0.125)), colours.GASKET, 0.25),
            box(0.1, 0.0175, height, Pose.from_rpy((0.0, -side, half), (0.0, 0.0, 0.125)), colours.GASKET, 0.25),
            mark,
        ),
        (
            mesh(shapes.GASKET, colours.GASKET),
            cylinder(0.009, 0.0204, at(0.072, 0.0, 0.0102), colours.BLACK),
            cylinder(0.009, 0.0204, at(-0.072, 0.0, 0.0102), colours.BLACK),
            mark,
        ),
    )


def _piston_rod() -> PartType:
    height, half = 0.0075, 0.00375
    pin = Pose.from_rpy((0.0, 0.0, half), (0.0, 1.5708, 0.0))
    # shares such that the centre of mass lies at y = 0.054
    return PartType(
        "piston_rod_part",
        0.5,
        (
            box(0.059, 0.052, height, at(z=half), colours.PISTON_HEAD, 0.325),
            box(0.031, 0.11, height, at(0.0, 0.08, half), colours.PISTON, 0.675),
        ),
        (
            box(0.059, 0.052, 0.0073, at(z=half), colours.PISTON_HEAD),
            cylinder(0.00365, 0.0594, pin, colours.STEEL_DARK),
            box(0.0595, 0.003, 0.0068, at(0.0, -0.018, half), colours.STEEL_DARK),
            box(0.0595, 0.003, 0.0068, at(0.0, -0.011, half), colours.STEEL_DARK),
            box(0.018, 0.1, 0.0071, at(0.0, 0.07, half), colours.PISTON),
            cylinder(0.0155, height, at(0.0, 0.1195, half), colours.PISTON),
            cylinder(0.0085, 0.0077, at(0.0, 0.1195, half), colours.BLACK),
            box(0.026, 0.02, height, at(0.0, 0.036, half), colours.PISTON),
        ),
    )


def _pulley() -> PartType:
    height = 0.0724
    return PartType(
        "pulley_part",
        0.5,
        (cylinder(0.1125, height, at(z=height / 2), colours.PULLEY, 1.0),),
        (
            mesh(shapes.PULLEY, colours.PULLEY),
            cylinder(0.0995, 0.0005, at(z=height), colours.PULLEY_FLANGE),
            cylinder(0.075, 0.0009, at(z=height), colours.PULLEY),
            cylinder(0.035, 0.0013, at(z=height), colours.STEEL_LIGHT),
            cylinder(0.016, 0.0017, at(z=height), colours.BLACK),
            cylinder(0.016, 0.001, at(z=0.0), colours.BLACK),
        ),
    )


_CATALOGUE: dict[str, PartType] = {
    kind.name: kind
    for kind in (
        _gear(),
        _disk(),
        _gasket(),
        _piston_rod(),
        _pulley(),
        PartType("part1", 1.0, (box(0.3, 0.1, 0.015, Pose.from_rpy((0, 0, 0), (0, 0, 0.0075)), colours.PART1, 1.0),)),
        PartType("part2", 1.0, (box(0.06, 0.015, 0.01, at(z=0.005), colours.PART2, 1.0),)),
        PartType(
            "part3", 1.0, (box(0.13, 0.07, 0.02, Pose.from_rpy((0.03, 0.03, 0.01), (0, 0, 0.9)), colours.PART3, 1.0),)
        ),
        PartType("part4", 1.0, (box(0.09, 0.06, 0.01, Pose.from_rpy((0, 0, 0), (0.005, 0, 0)), colours.PART4, 1.0),)),
    )
}

PART_TYPES = tuple(_CATALOGUE)
"""Part types that can be built."""


def separation_speed(name: str) -> float:
    """Return the maximum speed [m/s] at which a part's contact surface separates it from an overlapping body.

    Of two bodies the lower value counts. Figures: `max_vel` of the original's models (0 or 0.1).
    """
    return 0.0 if name in STAYING_TYPES else 0.1


def part_type(name: str) -> PartType:
    """Return the part type of this name.

    Raises:
        UnknownNameError: there is no model of that type.
    """
    try:
        return _CATALOGUE[name]
    except KeyError:
        raise UnknownNameError("part type", name, _CATALOGUE) from None


def add_part_meshes(visuals: Visuals) -> None:
    """Add the meshes that parts are drawn with."""
    visuals.meshes[shapes.GEAR] = shapes.ring(shapes.gear_outline, 0.006, 0.0, 0.0119, 144)
    visuals.meshes[shapes.GASKET] = shapes.ring(shapes.gasket_outline, 0.03, 0.0, 0.02, 72)
    groove = [(0.1125, 0.0), (0.1125, 0.004), (0.1, 0.009), (0.1, 0.0634), (0.1125, 0.0684), (0.1125, 0.0724)]
    visuals.meshes[shapes.PULLEY] = shapes.lofted([shapes.Circle(*each) for each in groove], 48)


def add_part(spec: Any, visuals: Visuals, name: str, kind: PartType, pose: Pose) -> Any:
    """Add a free part to a model specification.

    Args:
        spec: model specification.
        visuals: receives what is only seen of it; its mesh is one of `add_part_meshes` or the type's own.
        name: name of the body and of its free joint.
        kind: type of the part.
        pose: world_T_part.

    Returns:
        The body of the part.
    """
    body = spec.worldbody.add_body(name=name, pos=pose.position, quat=pose.quaternion)
    body.add_freejoint(name=name)
    for shape in kind.solid:
        role = Role.SOLID if kind.seen else Role.BOTH
        add_shape(body, shape, role, Touch.PART, mass=kind.mass)
    visuals.add(name, *kind.seen)
    return body
