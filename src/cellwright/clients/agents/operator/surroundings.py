"""Surroundings of the arms as the operator sees them: the parts and the belts, by the process that has the cell."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

from cellwright.util.pose import Pose, Vector3


class SeenPart(NamedTuple):
    """A part in the cell: its name, its type, its pose, and its linear velocity in the world [m/s]."""

    name: str
    type: str
    world_T_part: Pose
    velocity: Vector3


class Surroundings(Protocol):
    """Parts and belts of a cell, now. A person sees them on the page; no sensor is asked."""

    def parts(self) -> Sequence[SeenPart]:
        """Return all parts in the cell."""
        ...

    def belts(self) -> Mapping[str, Vector3]:
        """Return the present velocity of each belt's surface in the world [m/s], by the belt's name."""
        ...
