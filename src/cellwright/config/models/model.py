"""Part types and furniture of somebody's own, as plain values."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, TypeAlias

from cellwright.util.pose import Pose, Vector3

ModelShapeKind: TypeAlias = Literal["box", "cylinder", "capsule", "sphere", "mesh"]
Colour: TypeAlias = tuple[float, float, float, float]
"""Red, green, blue, opacity in 0..1."""


def clipped_colour(numbers: Sequence[float]) -> Colour:
    """The colour of four numbers, each brought into 0..1."""
    red, green, blue, opacity = (min(max(number, 0.0), 1.0) for number in numbers)
    return (red, green, blue, opacity)


@dataclass(frozen=True, slots=True)
class ModelShape:
    """A shape in the frame of its model.

    Attributes:
        kind: box, cylinder and capsule (both along z), sphere, or mesh.
        size: edge lengths [m] of a box; radius and length [m] of a cylinder or a capsule (the length of its straight
            piece); radius of a sphere; factors on the coordinates of a mesh.
        pose: of the shape's centre, or of the mesh's origin.
        colour: None for the model's.
        is_touched: whether it is solid; a mesh is touched where its convex hull is.
        is_seen: whether it is drawn.
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
class Model:
    """Something of somebody's own: shapes, or a file in the engine's own format (MJCF) that has them.

    Attributes:
        shapes: what it is made of; empty with an MJCF file.
        mass: [kg]; None for the file's.
        colour: of shapes that have none of their own; None for grey.
        mjcf: the MJCF file.
    """

    shapes: tuple[ModelShape, ...] = ()
    mass: float | None = None
    colour: Colour | None = None
    mjcf: Path | None = None


@dataclass(frozen=True, slots=True)
class Furniture:
    """A model that stands in the cell and does not move; `pose` is in the world frame."""

    name: str
    model: Model
    pose: Pose = field(default_factory=Pose)
