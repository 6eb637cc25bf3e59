"""The surfaces of a scene as triangles, for whatever draws them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cellwright.util.pose import Pose


@dataclass(frozen=True, slots=True)
class Triangles:
    """A surface.

    Attributes:
        points: (n, 3) corners [m].
        normals: (n, 3) which way the surface faces there, of unit length, outwards.
        faces: (m, 3) indices of corners, counterclockwise as seen from outside.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    faces: NDArray[np.int64]

    def placed(self, pose: Pose) -> Triangles:
        """The same in the frame in which `pose` is given."""
        turn = np.array([pose.rotate(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))])
        return Triangles(self.points @ turn + np.array(pose.position), self.normals @ turn, self.faces)


@dataclass(frozen=True, slots=True)
class Fineness:
    """How close to a form its triangles come: what draws them knows what they cost.

    Attributes:
        corners: how many corners a circle of some radius [m] has; a multiple of 4.
        endless: half the side [m] of a plane without end.
        breaks_edges: whether the edges of boxes are broken a little, as those of real things are, to catch the light.
    """

    corners: Callable[[float], int]
    endless: float
    breaks_edges: bool


def joined(surfaces: Iterable[Triangles]) -> Triangles:
    """Several surfaces as one."""
    found = list(surfaces)
    firsts = np.cumsum([0, *(len(each.points) for each in found)])
    return Triangles(
        np.concatenate([each.points for each in found]),
        np.concatenate([each.normals for each in found]),
        np.concatenate([each.faces + first for each, first in zip(found, firsts, strict=False)]),
    )
