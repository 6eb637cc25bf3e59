"""Simple shapes, what they may touch, and who sees them.

Every shape of the cell is a box, a cylinder, a capsule, or a mesh made in code; somebody's own may be a sphere or a
mesh from a file as well. A shape is solid (touched, and seen by
rays), seen (drawn only), or both; the engine's geom groups say which, so that a ray sensor or a picture maker chooses
by group. Parts, the robot and everything else form three classes of contact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum, IntEnum
from typing import Any, Literal, TypeAlias

import mujoco

from cellwright.util.pose import Pose, Vector3

HERE = Pose()

ShapeKind: TypeAlias = Literal["box", "cylinder", "capsule", "sphere", "mesh"]
Colour: TypeAlias = tuple[float, float, float, float]

_GEOM_TYPE = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "mesh": mujoco.mjtGeom.mjGEOM_MESH,
}


class Role(IntEnum):
    """What a shape is for; the value is its geom group."""

    BOTH = 1
    """Touched and drawn."""
    SEEN = 2
    """Drawn only."""
    SOLID = 3
    """Touched only, and seen by ray sensors."""
    UNSEEN = 4
    """Neither touched nor seen: devices measure distances to it."""


class Touch(Enum):
    """What a solid shape may touch: (contype, conaffinity) of the engine.

    The robot does not touch itself, nor its own rail: the original's robot has no self-collision. Fixed things do not
    touch each other, and an AGV counts as one of them.
    """

    FIXED = (1, 0)
    PART = (2, 1 | 2 | 4)
    ROBOT = (4, 1)
    NOTHING = (0, 0)


@dataclass(frozen=True, slots=True)
class Shape:
    """A shape in the frame of its body.

    Attributes:
        kind: box, cylinder, capsule (both along z), sphere or mesh.
        size: half extents [m] of a box, and of a mesh that is touched, whose vertices are centred; radius and half
            length [m] of a cylinder or a capsule (the half length of the capsule's straight piece); radius of a sphere.
        pose: of the shape's centre in the frame of the body.
        colour: red, green, blue, opacity in 0..1.
        share: share of the body's mass that this shape carries; 0 for what is only seen.
        mesh: name of the mesh, for a mesh.
    """

    kind: ShapeKind
    size: Vector3
    pose: Pose = HERE
    colour: Colour = (0.5, 0.5, 0.5, 1.0)
    share: float = 0.0
    mesh: str = ""

    def moved(self, frame: Pose) -> Shape:
        """The shape in the frame that `frame` is given in, when its own pose is given in `frame`."""
        return replace(self, pose=frame @ self.pose)

    @property
    def half_extents(self) -> Vector3:
        """Half extents [m] of the shape's bounding box along its own axes."""
        if self.kind in ("box", "mesh"):
            return self.size
        if self.kind == "sphere":
            return (self.size[0],) * 3
        radius, half = self.size[0], self.size[1]
        return (radius, radius, half + radius if self.kind == "capsule" else half)


def box(x: float, y: float, z: float, pose: Pose, colour: Colour, share: float = 0.0) -> Shape:
    """A box with the edge lengths x, y, z [m] centred at `pose`."""
    return Shape("box", (x / 2, y / 2, z / 2), pose, colour, share)


def cylinder(radius: float, length: float, pose: Pose, colour: Colour, share: float = 0.0) -> Shape:
    """A cylinder [m] along the z axis of `pose`, centred there."""
    return Shape("cylinder", (radius, length / 2, 0.0), pose, colour, share)


def capsule(radius: float, length: float, pose: Pose, colour: Colour) -> Shape:
    """A capsule along the z axis of `pose`, centred there; `length` [m] is that of its straight piece."""
    return Shape("capsule", (radius, length / 2, 0.0), pose, colour)


def mesh(name: str, colour: Colour, pose: Pose = HERE) -> Shape:
    """A mesh of the model's assets, drawn only."""
    return Shape("mesh", (0.0, 0.0, 0.0), pose, colour, mesh=name)


def at(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Pose:
    """A pose that only shifts [m]."""
    return Pose((x, y, z))


def bounds(shapes: tuple[Shape, ...]) -> tuple[Vector3, Vector3]:
    """Lower and upper corner [m] of the axis-aligned box around shapes, in the frame that they are given in."""
    lower, upper = [float("inf")] * 3, [float("-inf")] * 3
    for shape in shapes:
        reach = _reach(shape)
        for axis in range(3):
            lower[axis] = min(lower[axis], shape.pose.position[axis] - reach[axis])
            upper[axis] = max(upper[axis], shape.pose.position[axis] + reach[axis])
    return (lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2])


def _reach(shape: Shape) -> Vector3:
    """How far [m] a shape reaches from its centre along each axis of the body's frame."""
    columns = [shape.pose.rotate(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    half = shape.half_extents
    if shape.kind == "sphere":
        return half
    if shape.kind in ("box", "mesh"):
        x, y, z = (sum(abs(columns[k][axis]) * half[k] for k in range(3)) for axis in range(3))
        return (x, y, z)
    radius, length = shape.size[0], shape.size[1]
    along = columns[2]
    if shape.kind == "capsule":
        x, y, z = (abs(along[axis]) * length + radius for axis in range(3))
    else:  # a disc of radius r with normal n reaches r * sqrt(1 - n_axis^2) along an axis
        x, y, z = (abs(along[axis]) * length + radius * max(0.0, 1 - along[axis] ** 2) ** 0.5 for axis in range(3))
    return (x, y, z)


def add_looks(body: Any) -> Any:
    """A body fixed to `body` for shapes that are only seen, `<name> looks`.

    In each step the engine takes the measure of every shape of a body that can be touched, seen-only ones included; not
    of those of other bodies, nor of the world's own. So a moving thing with many of them has them on a body apart, and
    a fixed thing has them on the world.
    """
    return body.add_body(name=f"{body.name} looks")


def add_shape(
    body: Any, shape: Shape, role: Role, touch: Touch = Touch.FIXED, *, name: str = "", mass: float = 0.0
) -> Any:
    """Put a shape on a body of a model specification.

    Args:
        body: an `MjsBody`.
        shape: what to put there.
        role: touched, seen, both or neither.
        touch: what it may touch; nothing when it is only seen, or not even that.
        name: name of the geom; empty for none.
        mass: mass of the whole body [kg], of which the shape carries its share.

    Returns:
        The `MjsGeom`.
    """
    contype, conaffinity = (Touch.NOTHING if role in (Role.SEEN, Role.UNSEEN) else touch).value
    geom = body.add_geom(
        type=_GEOM_TYPE[shape.kind],
        pos=shape.pose.position,
        quat=shape.pose.quaternion,
        rgba=shape.colour,
        group=int(role),
        contype=contype,
        conaffinity=conaffinity,
        mass=mass * shape.share,
    )
    if shape.kind == "mesh":
        geom.meshname = shape.mesh
    else:
        geom.size = shape.size
    if name:
        geom.name = name
    return geom
