"""Meshes made in code: rings cut from flat outlines, and bodies lofted over circles."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

Mesh: TypeAlias = tuple[NDArray[np.float64], NDArray[np.int64]]
"""Vertices, shape (n, 3) [m], and triangles, shape (m, 3), counter-clockwise seen from outside."""

GEAR = "gear"
GASKET = "gasket"
PULLEY = "pulley"
CUP = "cup"


def ring(outer: Callable[[float], float], inner: float, bottom: float, top: float, corners: int) -> Mesh:
    """A flat ring with a round hole.

    Args:
        outer: outer radius [m] as a function of the angle [rad]; above `inner` everywhere.
        inner: radius of the hole [m].
        bottom: height of the lower face [m].
        top: height of the upper face [m].
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
    triangles: list[tuple[int, int, int]] = []
    for lower, upper in ((low_out, high_out), (high_out, high_in), (high_in, low_in), (low_in, low_out)):
        for k in range(corners):
            following = (k + 1) % corners
            triangles.append((lower[k], lower[following], upper[following]))
            triangles.append((lower[k], upper[following], upper[k]))
    return np.array(vertices), np.array(triangles)


@dataclass(frozen=True, slots=True)
class Circle:
    """Cross-section of a lofted body.

    Attributes:
        radius: [m].
        height: z [m] of the centre.
        shift: y [m] of the centre.
        lean: slope of the circle's plane, dz/dy.
    """

    radius: float
    height: float
    shift: float = 0.0
    lean: float = 0.0


def lofted(sections: Sequence[Circle], corners: int) -> Mesh:
    """A closed body over circles one above the other.

    Args:
        sections: from the lowest upward, both ends closed by a flat face.
        corners: number of corners of each circle.
    """
    angles = [2 * math.pi * k / corners for k in range(corners)]
    vertices = [
        (each.radius * math.cos(a), each.shift + across, each.height + each.lean * across)
        for each in sections
        for a, across in ((a, each.radius * math.sin(a)) for a in angles)
    ]
    triangles: list[tuple[int, int, int]] = []
    for level in range(len(sections) - 1):
        low, high = level * corners, (level + 1) * corners
        for k in range(corners):
            following = (k + 1) % corners
            triangles.append((low + k, low + following, high + following))
            triangles.append((low + k, high + following, high + k))
    last = (len(sections) - 1) * corners
    for k in range(1, corners - 1):
        triangles.append((0, k + 1, k))
        triangles.append((last, last + k, last + k + 1))
    return np.array(vertices), np.array(triangles)


def gear_outline(angle: float, teeth: int = 18, tip: float = 0.0392, root: float = 0.0345) -> float:
    """Radius [m] of a toothed wheel at an angle [rad]: trapezoidal teeth."""
    phase = (angle * teeth / (2 * math.pi)) % 1.0
    slope = min(1.0, max(0.0, 4.0 * (0.375 - abs(phase - 0.5)) + 0.5))
    return root + (tip - root) * slope


def gasket_outline(angle: float) -> float:
    """Radius [m] of the gasket's outline: a ring with an ear at either end, slightly skewed."""
    ear = 0.0
    for side in (1.0, -1.0):  # far intersection of the ray with the end's circle, radius 27 mm at x = +-67 mm
        along = 0.067 * side * math.cos(angle)
        across = 0.067**2 - along**2
        if along > 0 and across < 0.027**2:
            ear = max(ear, along + math.sqrt(0.027**2 - across))
    skew = 0.12
    wall = 0.0381 / max(abs(math.sin(angle - skew)), 1e-9)
    return max(ear, min(wall, 0.0565), 0.036)


def add_mesh(spec: Any, name: str, form: Mesh, *, smooth: bool = False, weighs: bool = False) -> None:
    """Give a model specification a mesh asset; one that weighs something does so as its convex hull."""
    vertices, triangles = form
    kinds = mujoco.mjtMeshInertia  # the shell asks nothing of the form
    spec.add_mesh(
        name=name,
        uservert=vertices.ravel(),
        userface=triangles.ravel(),
        smoothnormal=smooth,
        inertia=kinds.mjMESH_INERTIA_CONVEX if weighs else kinds.mjMESH_INERTIA_SHELL,
    )
