"""User-defined part types and furniture, as plain values."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cellwright.util.pose import Pose, Vector3

ModelShapeKind: TypeAlias = Literal["box", "cylinder", "capsule", "sphere", "mesh"]
Colour: TypeAlias = tuple[float, float, float, float]
"""Red, green, blue, opacity in 0..1."""


def clipped_colour(numbers: Sequence[float]) -> Colour:
    """Return four numbers as a colour, each clipped to 0..1."""
    red, green, blue, opacity = (min(max(number, 0.0), 1.0) for number in numbers)
    return (red, green, blue, opacity)


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Triangles of one colour: vertices, shape (n, 3), and triangles as vertex indices, shape (m, 3).

    `colour` is None if the file gives none.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    colour: Colour | None = None


@dataclass(frozen=True, slots=True)
class ModelShape:
    """A shape in the frame of its model.

    Attributes:
        kind: box, cylinder and capsule (both along z), sphere, or mesh.
        size: edge lengths [m] of a box; radius and length [m] of a cylinder or a capsule (without its round ends);
            radius [m] of a sphere; scale factors of a mesh.
        pose: pose of the shape's centre, or of the mesh's origin.
        colour: None for the model's.
        is_touched: True if it is solid; a mesh collides as its convex hull.
        is_seen: True if it is drawn.
        mesh: the mesh's file.
    """

    kind: ModelShapeKind
    size: Vector3
    pose: Pose = field(default_factory=Pose)
    colour: Colour | None = None
    is_touched: bool = True
    is_seen: bool = True
    mesh: Path | None = None


@dataclass(frozen=True, slots=True)
class UserModel:
    """User-defined model: shapes, or a file in the engine's own format (MJCF) that has them.

    Attributes:
        shapes: its shapes; empty with an MJCF file.
        mass: [kg]; None for the file's.
        colour: colour of shapes that have none of their own; None for grey.
        mjcf: the MJCF file.
    """

    shapes: tuple[ModelShape, ...] = ()
    mass: float | None = None
    colour: Colour | None = None
    mjcf: Path | None = None


@dataclass(frozen=True, slots=True)
class Furniture:
    """Static model in the cell; `pose` is in the world frame."""

    name: str
    model: UserModel
    pose: Pose = field(default_factory=Pose)
