"""Shapes to draw a robot with: those that every reader of URDF knows, and what can be put together from them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import product

from cellwright.config.models.model import ModelShapeKind
from cellwright.util.pose import Pose, Vector3

SHELL, DARK, AZURE, GLASS, RUBBER = "shell", "graphite", "azure", "glass", "rubber"
COLOURS = {
    SHELL: (0.80, 0.81, 0.83, 1.0),
    DARK: (0.17, 0.18, 0.20, 1.0),
    AZURE: (0.05, 0.45, 0.80, 1.0),
    GLASS: (0.03, 0.04, 0.06, 1.0),
    RUBBER: (0.30, 0.31, 0.33, 1.0),
}
"""Red, green, blue, opacity in 0..1, by name."""


@dataclass(frozen=True, slots=True)
class Shape:
    """A box, cylinder or sphere.

    Attributes:
        kind: which of them.
        size: edge lengths [m] of a box; radius and length [m] of a cylinder, which lies along z; radius of a sphere.
        pose: of its centre.
        colour: one of `COLOURS`; empty for a shape that is only touched.
    """

    kind: ModelShapeKind
    size: Vector3
    pose: Pose
    colour: str

    def mirrored(self) -> Shape:
        """The same on the other side of the plane y = 0."""
        (x, y, z), (roll, pitch, yaw) = self.pose.position, self.pose.rpy
        return replace(self, pose=Pose.from_rpy((x, -y, z), (-roll, pitch, -yaw)))

    def seen_from(self, frame: Pose) -> Shape:
        """The same in another frame, whose pose is given in this one."""
        return replace(self, pose=frame.inverse() @ self.pose)


def block(centre: Vector3, size: Vector3, colour: str, rpy: Vector3 = (0.0, 0.0, 0.0)) -> Shape:
    """A box with edges of `size` [m], turned by roll, pitch, yaw [rad]."""
    return Shape("box", size, Pose.from_rpy(centre, rpy), colour)


def ball(centre: Vector3, radius: float, colour: str) -> Shape:
    """A sphere; centre and radius in m."""
    return Shape("sphere", (radius, 0.0, 0.0), Pose(centre), colour)


def rod(start: Vector3, end: Vector3, radius: float, colour: str) -> Shape:
    """A cylinder from one point to another [m]."""
    x, y, z = (b - a for a, b in zip(start, end, strict=True))
    length = math.hypot(x, y, z)
    middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2, (start[2] + end[2]) / 2)
    turned = (0.0, math.atan2(math.hypot(x, y), z), math.atan2(y, x))
    return Shape("cylinder", (radius, length, 0.0), Pose.from_rpy(middle, turned), colour)


def capsule(start: Vector3, end: Vector3, radius: float, colour: str) -> list[Shape]:
    """A rod with round ends, whose middles are `start` and `end` [m]."""
    return [rod(start, end, radius, colour), ball(start, radius, colour), ball(end, radius, colour)]


def cushion(centre: Vector3, size: Vector3, radius: float, colour: str) -> list[Shape]:
    """A box all of whose edges and corners are round; centre, edge lengths and radius in m."""
    x, y, z = centre
    inner = [length - 2 * radius for length in size]
    found = [
        block(centre, (size[0], inner[1], inner[2]), colour),
        block(centre, (inner[0], size[1], inner[2]), colour),
        block(centre, (inner[0], inner[1], size[2]), colour),
    ]
    a, b, c = (length / 2 for length in inner)
    for s, t in product((-1, 1), repeat=2):
        found.append(rod((x - a, y + s * b, z + t * c), (x + a, y + s * b, z + t * c), radius, colour))
        found.append(rod((x + s * a, y - b, z + t * c), (x + s * a, y + b, z + t * c), radius, colour))
        found.append(rod((x + s * a, y + t * b, z - c), (x + s * a, y + t * b, z + c), radius, colour))
    found.extend(ball((x + r * a, y + s * b, z + t * c), radius, colour) for r, s, t in product((-1, 1), repeat=3))
    return found
