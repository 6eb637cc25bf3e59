"""Surfaces of a layout that parts lie or ride on."""

from dataclasses import dataclass
from typing import Literal

from cellwright.config.layout.layout import Layout
from cellwright.util.pose import Pose


@dataclass(frozen=True, slots=True)
class Surface:
    """Rectangle that parts lie on.

    Attributes:
        section: section of the cell that describes it.
        name: its name there.
        middle: its middle in the world; x and y are along its edges. On a belt x points in the direction of travel.
        size: lengths of these edges [m].
    """

    section: Literal["bins", "belts", "carriers", "trays"]
    name: str
    middle: Pose
    size: tuple[float, float]

    @property
    def key(self) -> str:
        """Dotted path to its description in a file."""
        return f"cell.{self.section}.{self.name}"

    @property
    def is_belt(self) -> bool:
        """True for a belt, whose parts ride along x."""
        return self.section == "belts"


def surfaces(layout: Layout) -> tuple[Surface, ...]:
    """Return the surfaces of all bins, belts, AGVs at their stations and fixed trays.

    Example:
        >>> from cellwright.config.layout.gear2017 import gear2017
        >>> [each.name for each in surfaces(gear2017())][-3:]
        ['belt', 'agv1', 'agv2']
    """
    return (
        *(Surface("bins", each.name, each.pose @ Pose((0.0, 0.0, each.surface)), each.size) for each in layout.bins),
        *(
            Surface("belts", each.name, each.centre @ Pose((0.0, 0.0, each.size[2] / 2)), each.size[:2])
            for each in layout.belts
        ),
        *(Surface("carriers", each.name, each.tray_surface, each.plate) for each in layout.carriers),
        *(Surface("trays", each.name, each.tray_surface, each.plate) for each in layout.trays),
    )
