"""Gliders: passengers of belts. What holds of a part that rides one steadily, and where its ride ends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np

from cellwright.engine.bounding_boxes import Mask, Numbers, Vectors
from cellwright.util.pose import Vector3

_STEADY = np.array((5e-5, 5e-5, 1e-4, 5e-3, 5e-3, 5e-3))
"""Maximum deviation of a part's velocity from that of its belt [m/s, rad/s] when it becomes a passenger.

A cylinder at rest turns to and fro at 1e-3 rad/s for ever.
"""


class Gliders(NamedTuple):
    """Parts that glide: closed and without weight, each has exactly its belt's velocity.

    Attributes:
        speeds: speeds of all belts [m/s] for which the velocities hold.
        bodies: bodies of the parts.
        dofs: their dofs, shape (parts, 6).
        velocities: velocity of each part's belt [m/s].
        exact: bytes of the parts' velocities.
    """

    speeds: list[float]
    bodies: tuple[int, ...]
    dofs: Numbers
    velocities: list[Vector3]
    exact: bytes

    @classmethod
    def of(cls, speeds: list[float], belts: Mapping[int, Vector3], dofs: Numbers) -> Gliders:
        """Return gliders, given as the velocity [m/s] of each one's belt, by body, and the dofs of all bodies."""
        exact = np.zeros((len(belts), 6))
        exact[:, :3] = np.reshape(list(belts.values()), (-1, 3))
        return cls(speeds, tuple(belts), dofs[list(belts)], list(belts.values()), exact.tobytes())

    def find_pushed(self, qvel: Vectors) -> list[int]:
        """Return the bodies that do not have their belt's velocity any more: a program has written another one."""
        velocities = qvel.take(self.dofs)
        if velocities.tobytes() == self.exact:
            return []
        is_steady = are_steady(velocities, self.velocities)
        return [body for body, holds in zip(self.bodies, is_steady.tolist(), strict=True) if not holds]


class BeltEnd(NamedTuple):
    """End of a belt.

    Attributes:
        coordinate: its coordinate in the direction of travel [m].
        towards: share of each side of a box in the coordinate of the box's foremost corner, shape (6,).
    """

    coordinate: float
    towards: Vectors

    @classmethod
    def at(cls, coordinate: float, direction: Vector3) -> BeltEnd:
        """Return the end at a coordinate [m] of a belt with a direction of travel, a unit vector."""
        along = np.array(direction)
        # upper sides are stored with a minus sign
        return cls(coordinate, np.concatenate([np.minimum(along, 0.0), -np.maximum(along, 0.0)]))

    def gap(self, sides: Vectors) -> float:
        """Return the gap [m] to the box of a part, given by its sides of shape (6,)."""
        return self.coordinate - float(self.towards @ sides)


@dataclass(frozen=True, slots=True)
class Ends:
    """Ends of belts that parts ride to: beyond lies a half space, and the gap to it counts along the belt.

    Attributes:
        coordinates: coordinate of each part's end in the direction of travel [m]; infinite without an end.
        towards: share of each side of a part's box in the coordinate of its foremost corner, shape (6, parts).
        exist: True if any part has an end.
    """

    coordinates: Vectors
    towards: Vectors
    exist: bool

    @classmethod
    def of(cls, ends: Sequence[BeltEnd | None]) -> Ends:
        """Return the ends for parts, given as the end of each one's belt, if it rides one."""
        coordinates, towards = np.full(len(ends), np.inf), np.zeros((6, len(ends)))
        for column, end in enumerate(ends):
            if end is not None:
                coordinates[column], towards[:, column] = end
        return cls(coordinates, towards, any(end is not None for end in ends))

    def gaps(self, sides: Vectors, out: Vectors) -> None:
        """Write the gap [m] between each part's box, of sides of shape (6, parts), and the end of its belt."""
        np.subtract(self.coordinates, np.add.reduce(self.towards * sides, axis=0), out=out)


def end_of_belt(model: mujoco.MjModel, belt: int, direction: Vector3) -> BeltEnd:
    """Return the end of a belt, a body with one shape, in its direction of travel."""
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, model.body_quat[belt])
    turned, along = rotation.reshape(3, 3), np.array(direction)
    middle, half = np.split(model.geom_aabb[model.body_geomadr[belt]], 2)
    coordinate = float(along @ (model.body_pos[belt] + turned @ middle) + np.abs(along @ turned) @ half)
    return BeltEnd.at(coordinate, direction)


def are_steady(velocities: Vectors, carried_at: Vector3 | Sequence[Vector3]) -> Mask:
    """Return which parts, with velocities of shape (n, 6), move as a belt at a velocity [m/s], or each as its own."""
    deviation = velocities.copy()
    deviation[:, :3] -= carried_at
    return np.asarray((np.abs(deviation) < _STEADY).all(axis=1))
