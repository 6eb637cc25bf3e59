"""Surfaces of a layout that parts lie on, by the names of what has them."""

from collections.abc import Mapping
from dataclasses import dataclass

from cellwright.config.layout.layout import Belt, Layout
from cellwright.util.pose import Pose


@dataclass(frozen=True, slots=True)
class Surface:
    """Rectangle that parts lie on.

    Attributes:
        pose: its middle in the world; on a belt x points in the direction of travel.
        size: edge lengths along x and y [m].
        is_belt: True for a belt.
    """

    pose: Pose
    size: tuple[float, float]
    is_belt: bool = False


def surfaces(layout: Layout) -> Mapping[str, Surface]:
    """Return the surface of each bin, belt, AGV at its station and fixed tray, by its name.

    Example:
        >>> from cellwright.config.layout.gear2017 import gear2017
        >>> surfaces(gear2017())["bin7"].pose.position
        (-0.3, 0.23, 0.725)
    """
    return {
        **{each.name: Surface(each.pose @ Pose((0.0, 0.0, each.surface)), each.size) for each in layout.bins},
        **{each.name: _belt(each) for each in layout.belts},
        **{each.name: Surface(each.tray_surface, each.plate) for each in layout.stations},
    }


def _belt(belt: Belt) -> Surface:
    length, width, thickness = belt.size
    return Surface(belt.centre @ Pose((0.0, 0.0, thickness / 2)), (length, width), is_belt=True)
