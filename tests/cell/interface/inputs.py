"""All inputs of a served cell and robot, from the tables of their interfaces; a new row is tested automatically."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from cellwright.cell.cell import Cell
from cellwright.cell.interface.rows import rows as gear_rows
from cellwright.middleware.bus import Bus, Direction, Node
from cellwright.middleware.interface.table import Endpoint, EndpointKind
from cellwright.middleware.messages import TYPES
from cellwright.robot.interface import rows as teleop_rows
from cellwright.robot.node import RobotNode
from tests.robot.robots import two_arms
from tests.support.cells import WHOLE


@dataclass(frozen=True)
class Input:
    """A topic that is subscribed to, or a service."""

    name: str
    type_name: str
    """Full name of its message or request."""
    is_service: bool

    def give(self, bus: Bus, message: Any, node: str = "/team") -> Any:
        """Publish a message there, or call it."""
        return (
            bus.call(self.name, message, node=node) if self.is_service else bus.publish(self.name, message, node=node)
        )


def inputs(rows: tuple[Endpoint, ...]) -> list[Input]:
    """Return the inputs of an interface; an action is five topics, which have rows of their own."""
    return [_input(row) for row in rows if row.direction is Direction.IN and row.kind is not EndpointKind.ACTION]


def _input(row: Endpoint) -> Input:
    is_service = row.kind is EndpointKind.SERVICE
    message = TYPES.service(row.type).request if is_service else TYPES.message(row.type)
    return Input(row.name, message.__msgtype__, is_service)


GEAR = inputs(gear_rows(WHOLE, competition=False))
TELEOP = inputs(teleop_rows(two_arms()))


def whole_cell(**more: Any) -> Cell:
    """A cell with all kinds of devices and sensors, outside of competition mode."""
    return Cell(WHOLE, competition=False, **more)


def robot(**more: Any) -> RobotNode:
    """A robot's node with every row of its interface."""
    return RobotNode(two_arms(), **more)


def state_hash(served: Node) -> str:
    """Return a hash of the whole state of a cell or robot."""
    return served.state_hash() if isinstance(served, Cell) else served.simulation.state_hash()
