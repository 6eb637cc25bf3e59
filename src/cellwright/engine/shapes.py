"""Shapes of the engine's model, and meshes made in code: rings, lofted bodies and cups.

The engine's model has what is touched or measured; geom groups say for each shape whether it is also drawn, so that ray
sensors and scenes select by group. What is only seen is in `Visuals`, beside the model. Parts, the robot and everything
else form three classes of contact.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum, IntEnum
from typing import Any, Literal, TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.util.pose import Pose, Vector3

HERE = Pose()

ShapeKind: TypeAlias = Literal["box", "cylinder", "capsule", "sphere", "mesh"]
Colour: TypeAlias = tuple[float, float, float, float]

GEOM_TYPES = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "mesh": mujoco.mjtGeom.mjGEOM_MESH,
}
GEAR = "gear"
GASKET = "gasket"
PULLEY = "pulley"
CUP = "cup"
Mesh: TypeAlias = tuple[NDArray[np.float64], NDArray[np.int64]]
"""Vertices, shape (n, 3) [m], and triangles, shape (m, 3), counter-clockwise seen from outside."""


def rgb(code: int) -> Colour:
    """Return the opaque colour 0xRRGGBB."""
    return ((code >> 16) / 255, (code >> 8 & 255) / 255, (code & 255) / 255, 1.0)


class Role(IntEnum):
    """Purpose of a shape in the engine's model; the value is its geom group."""

    BOTH = 1
    """Touched and drawn."""
    SOLID = 3
    """Touched only, and seen by ray sensors."""
    UNSEEN = 4
    """Neither touched nor drawn; devices measure distances to it."""


class Touch(Enum):
    """Contact class of a solid shape: (contype, conaffinity) of the engine.

    The robot does not touch itself or its own rail: the original's robot has no self-collision. Fixed things do not
    touch each other; an AGV counts as one of them.
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
        size: dimensions [m]. Box, and mesh with contacts, whose vertices are centred: half extents. Cylinder and
            capsule: radius and half length (of the capsule's straight piece). Sphere: radius.
        pose: of the shape's centre in the frame of the body.
        colour: red, green, blue, opacity in 0..1.
        share: the shape's share of the body's mass; 0 for a shape that is only seen.
        mesh: name of the mesh, for a mesh.
    """

    kind: ShapeKind
    size: Vector3
    pose: Pose = HERE
    colour: Colour = (0.5, 0.5, 0.5, 1.0)
    share: float = 0.0
    mesh: str = ""

    def moved(self, frame: Pose) -> Shape:
        """Return the shape in the parent frame of `frame`, for a pose given in `frame`."""
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
    """Return a box with the edge lengths x, y, z [m] centred at `pose`."""
    return Shape("box", (x / 2, y / 2, z / 2), pose, colour, share)


def cylinder(radius: float, length: float, pose: Pose, colour: Colour, share: float = 0.0) -> Shape:
    """Return a cylinder [m] along the z axis of `pose`, centred there."""
    return Shape("cylinder", (radius, length / 2, 0.0), pose, colour, share)


def capsule(radius: float, length: float, pose: Pose, colour: Colour) -> Shape:
    """Return a capsule along the z axis of `pose`, centred there; `length` [m] is that of its straight piece."""
    return Shape("capsule", (radius, length / 2, 0.0), pose, colour)


def mesh(name: str, colour: Colour, pose: Pose = HERE) -> Shape:
    """Return a mesh of the model or of the visuals, by its name."""
    return Shape("mesh", (0.0, 0.0, 0.0), pose, colour, mesh=name)


def at(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Pose:
    """Return a pose with a shift [m] and no rotation."""
    return Pose((x, y, z))


def bounds(shapes: tuple[Shape, ...]) -> tuple[Vector3, Vector3]:
    """Return the lower and upper corner [m] of the axis-aligned box around shapes, in their common frame."""
    lower, upper = [float("inf")] * 3, [float("-inf")] * 3
    for shape in shapes:
        reach = _reach(shape)
        for axis in range(3):
            lower[axis] = min(lower[axis], shape.pose.position[axis] - reach[axis])
            upper[axis] = max(upper[axis], shape.pose.position[axis] + reach[axis])
    return (lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2])


def _reach(shape: Shape) -> Vector3:
    """Return the half extents [m] of a shape along the axes of the body's frame."""
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


def add_shape(
    body: Any, shape: Shape, role: Role, touch: Touch = Touch.FIXED, *, name: str = "", mass: float = 0.0
) -> Any:
    """Add a shape to a body of a model specification. An unseen one touches nothing.

    Args:
        body: the body (`MjsBody`).
        shape: the shape, in the frame of the body.
        role: purpose of the shape.
        touch: contact class of a solid shape.
        name: name of the geom; empty for none.
        mass: mass of the whole body [kg], of which the shape carries its share.

    Returns:
        The geom (`MjsGeom`).
    """
    contype, conaffinity = (Touch.NOTHING if role is Role.UNSEEN else touch).value
    geom = body.add_geom(
        type=GEOM_TYPES[shape.kind],
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


@dataclass(frozen=True, slots=True)
class Visuals:
    """Shapes that are only seen. They move with bodies of the engine's model, which lacks them: no step pays for them.

    Attributes:
        shapes: the shapes, each with the name of its body, in whose frame it is; "world" has static ones.
        meshes: the meshes that they name.

    Example:
        >>> visuals = Visuals()
        >>> visuals.add("bin7|gear_part_1", cylinder(0.012, 0.0124, at(z=0.0062), (0.3, 0.3, 0.3, 1.0)))
        >>> [(body, shape.kind) for body, shape in visuals.shapes]
        [('bin7|gear_part_1', 'cylinder')]
    """

    shapes: list[tuple[str, Shape]] = field(default_factory=list)
    meshes: dict[str, Mesh] = field(default_factory=dict)

    def add(self, body: str, *shapes: Shape) -> None:
        """Add shapes to a body, given in its frame."""
        self.shapes.extend((body, shape) for shape in shapes)


def ring(outer: Callable[[float], float], inner: float, bottom: float, top: float, corners: int) -> Mesh:
    """Make a flat ring between two heights with a round hole [m].

    Args:
        outer: outer radius [m] as a function of the angle [rad], above `inner` everywhere.
        inner: radius of the hole [m].
        bottom: lower height [m].
        top: upper height [m].
        corners: number of corners of either outline.
    """
    angles = [2 * math.pi * k / corners for k in range(corners)]
    vertices = [
        (radius * math.cos(angle), radius * math.sin(angle), height)
        for height in (bottom, top)
        for outline in (outer, lambda _angle: inner)
        for angle, radius in ((a, outline(a)) for a in angles)
    ]
    low_out, low_in, high_out, high_in = (range(k * corners, (k + 1) * corners) for k in range(4))
    strips = ((low_out, high_out), (high_out, high_in), (high_in, low_in), (low_in, low_out))
    return np.array(vertices), np.array([triangle for strip in strips for triangle in _strip(*strip)])


def _strip(lower: range, upper: range) -> Iterator[tuple[int, int, int]]:
    """Yield the triangles between two closed outlines with equal numbers of vertices."""
    for k in range(len(lower)):
        following = (k + 1) % len(lower)
        yield lower[k], lower[following], upper[following]
        yield lower[k], upper[following], upper[k]


@dataclass(frozen=True, slots=True)
class Circle:
    """Cross-section of a lofted body [m]: z (height) and y (shift) of the centre, and the slope of its plane, dz/dy."""

    radius: float
    height: float
    shift: float = 0.0
    lean: float = 0.0


def lofted(sections: Sequence[Circle], corners: int) -> Mesh:
    """Make a closed body over circles, from the lowest upward, with flat ends; each circle has `corners` corners."""
    angles = [2 * math.pi * k / corners for k in range(corners)]
    return joined(
        [
            [
                (each.radius * math.cos(a), each.shift + across, each.height + each.lean * across)
                for a, across in ((a, each.radius * math.sin(a)) for a in angles)
            ]
            for each in sections
        ]
    )


def joined(outlines: Sequence[Sequence[Vector3]]) -> Mesh:
    """Make a closed body over flat outlines with equal numbers of corners, which are its first and last faces too.

    Args:
        outlines: corners of each outline [m], counter-clockwise seen from the last one.
    """
    corners = len(outlines[0])
    triangles: list[tuple[int, int, int]] = []
    last = (len(outlines) - 1) * corners
    for low in range(0, last, corners):
        triangles += _strip(range(low, low + corners), range(low + corners, low + 2 * corners))
    for k in range(1, corners - 1):
        triangles.append((0, k + 1, k))
        triangles.append((last, last + k, last + k + 1))
    return np.array([corner for outline in outlines for corner in outline]), np.array(triangles)


def gear_outline(angle: float, teeth: int = 18, tip: float = 0.0392, root: float = 0.0345) -> float:
    """Return the radius [m] of a gear with trapezoidal teeth at an angle [rad]."""
    phase = (angle * teeth / (2 * math.pi)) % 1.0
    slope = min(1.0, max(0.0, 4.0 * (0.375 - abs(phase - 0.5)) + 0.5))
    return root + (tip - root) * slope


def gasket_outline(angle: float) -> float:
    """Return the radius [m] of the gasket's outline: a ring with an ear at either end, slightly skewed."""
    ear = 0.0
    # far intersection of the ray with the end's circle, radius 27 mm at x = +-67 mm
    for side in (1.0, -1.0):
        along = 0.067 * side * math.cos(angle)
        across = 0.067**2 - along**2
        if along > 0 and across < 0.027**2:
            ear = max(ear, along + math.sqrt(0.027**2 - across))
    skew = 0.12
    wall = 0.0381 / max(abs(math.sin(angle - skew)), 1e-9)
    return max(ear, min(wall, 0.0565), 0.036)


def add_mesh(spec: Any, name: str, form: Mesh, *, weighs: bool = False) -> None:
    """Add a mesh asset to a model specification.

    Args:
        spec: the model specification (`MjSpec`).
        name: name of the asset.
        form: vertices and triangles.
        weighs: True if it has the inertia of its convex hull, else that of a shell.
    """
    vertices, triangles = form
    # the shell has no requirements on the mesh
    kinds = mujoco.mjtMeshInertia
    spec.add_mesh(
        name=name,
        uservert=vertices.ravel(),
        userface=triangles.ravel(),
        inertia=kinds.mjMESH_INERTIA_CONVEX if weighs else kinds.mjMESH_INERTIA_SHELL,
    )
