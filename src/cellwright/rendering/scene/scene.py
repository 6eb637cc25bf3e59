"""Shapes on bodies: what there is to be seen, whatever moves it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, StrEnum

import numpy as np
from numpy.typing import NDArray

from cellwright.util.pose import Pose, Vector3


class Form(StrEnum):
    """The form of a shape, and what its `size` [m] says; all are centred on the shape's pose."""

    PLANE = "plane"
    """Half the sides along x and y, 0 for one without end; it is seen from above."""
    SPHERE = "sphere"
    """Radius."""
    CAPSULE = "capsule"
    """Radius, and half the length of the cylinder between the caps, along z."""
    ELLIPSOID = "ellipsoid"
    """The three radii."""
    CYLINDER = "cylinder"
    """Radius, and half the height along z."""
    BOX = "box"
    """Half the sides."""
    MESH = "mesh"
    """Nothing: the mesh is as large as it is."""


class Layer(IntEnum):
    """Why a shape is there."""

    BOTH = 1
    """It is seen, and touched."""
    LOOKS = 2
    """It is only seen."""
    TOUCH = 3
    """It is only touched: what the engine takes for something that looks otherwise."""
    MARK = 4
    """It is a mark for those who build the cell, and drawn in no picture."""


SEEN = frozenset({Layer.BOTH, Layer.LOOKS})
"""What is seen."""
TOUCHED = frozenset({Layer.BOTH, Layer.TOUCH})
"""What the engine takes it for."""


@dataclass(frozen=True, slots=True)
class Mesh:
    """A surface of triangles.

    Attributes:
        vertices: (n, 3) [m], in the frame of the shape; float32.
        faces: (m, 3) indices of vertices, counterclockwise as seen from outside; int32.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]


@dataclass(frozen=True, slots=True)
class Shape:
    """One shape, fixed to a body.

    Attributes:
        body: index in `Scene.bodies`; 0 for what stands still.
        form: its form.
        size: its size [m]; see `Form`.
        pose: in the frame of its body.
        colour: red, green, blue and opacity, sRGB 0..1.
        layer: why it is there.
        mesh: index in `Scene.meshes`; None unless the form is MESH.
    """

    body: int
    form: Form
    size: Vector3
    pose: Pose
    colour: tuple[float, float, float, float]
    layer: Layer
    mesh: int | None = None


@dataclass(frozen=True, slots=True)
class Scene:
    """What there is to be seen.

    Attributes:
        name: of the trial or the robot.
        bodies: names of the bodies that may move, each once; the first is "world", which stands still and holds all
            that does.
        shapes: the shapes on them.
        meshes: surfaces that shapes refer to.
    """

    name: str
    bodies: tuple[str, ...]
    shapes: tuple[Shape, ...]
    meshes: tuple[Mesh, ...]
