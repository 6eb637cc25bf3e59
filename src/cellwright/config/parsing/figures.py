"""What a configuration comes to in the original's terms: names, numbers as written, and the order they were met in.

These figures stand between the file and the `Trial`: they keep what the original's launcher would have written (which
angles, which corner first, which word), where a trial keeps what it means.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from cellwright.util.pose import Pose, Vector3

ZERO: Vector3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Placement:
    """A pose as written: `xyz` [m] and `rpy` [rad], None where the file says nothing and zero is meant."""

    xyz: Vector3 | None = None
    rpy: Vector3 | None = None

    @property
    def pose(self) -> Pose:
        """The pose that is meant."""
        return Pose.from_rpy(self.xyz or ZERO, self.rpy or ZERO)


@dataclass(frozen=True, slots=True)
class ModelFigure:
    """A part by its full name; `origin` is the bin or the reference frame as the file names it."""

    name: str
    type: str
    origin: str
    placement: Placement


@dataclass(frozen=True, slots=True)
class BeltFigure:
    """A part that the belt brings `time` [s] after the start."""

    time: float
    type: str
    placement: Placement


@dataclass(frozen=True, slots=True)
class DropFigure:
    """A region in which parts of a type are lost; the corners [m] in the file's order."""

    name: str
    type: str
    first: Vector3
    second: Vector3
    destination: Placement


@dataclass(frozen=True, slots=True)
class OrderFigure:
    """An order; `condition` and `value` as the file has them."""

    name: str
    condition: str
    value: float
    kit_count: int
    parts: tuple[tuple[str, Placement], ...]


def order_id(index: int) -> str:
    """The id of an order, by its place among the orders."""
    return f"order_{index}"


def kit_type(order_name: str, index: int) -> str:
    """The name of a kit: that of its order and its number from 0."""
    return f"{order_name}_kit_{index}"


@dataclass(frozen=True, slots=True)
class Figures:
    """Everything that the original's launcher would have made of a configuration."""

    time_limit: float = 500
    models: tuple[ModelFigure, ...] = ()
    extra_models: tuple[ModelFigure, ...] = ()
    belt: tuple[BeltFigure, ...] = ()
    faulty: tuple[str, ...] = ()
    drops: tuple[DropFigure, ...] = ()
    orders: tuple[OrderFigure, ...] = ()
    material_locations: Mapping[str, frozenset[str]] = field(default_factory=dict)
