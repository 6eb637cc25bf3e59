"""The shapes of a scene, as fine as a page shows them."""

from __future__ import annotations

import math

from cellwright.rendering.scene import Scene, Shape
from cellwright.rendering.scene.forms import triangles
from cellwright.rendering.scene.triangles import Fineness, Triangles

_FINEST, _COARSEST = 48, 12  # corners of a circle


def surface(shape: Shape, scene: Scene) -> Triangles:
    """A shape's surface, in the frame of its body."""
    return triangles(shape, scene, _FINENESS)


def _corners(radius: float) -> int:
    return int(min(max(round(220 * math.sqrt(max(radius, 0.0))), _COARSEST), _FINEST) // 4 * 4)


_FINENESS = Fineness(corners=_corners, endless=30.0, breaks_edges=True)
