"""Robots of a cell, driven over their own topics: the only door from the cell to the room of robots."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from cellwright.cell.devices.hands import HoldingHand
from cellwright.cell.devices.parts import Parts
from cellwright.cell.interface.rows import NODE
from cellwright.config.layout.robots import CellRobot
from cellwright.config.robot.config import RobotConfig
from cellwright.config.trial.trial import Trial
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus
from cellwright.middleware.interface.binding import bind
from cellwright.rendering.cameras.render_service import RenderService

if TYPE_CHECKING:
    from cellwright.robot.controller import RobotController

_RANKS = 1000
"""Ranks that the topics of a cell, and of each of its robots, may have."""


def add_robots(
    trial: Trial, simulation: Simulation, bus: Bus, pictures: RenderService, parts: Parts
) -> dict[str, RobotController]:
    """Let the robots of a cell be driven over their own topics, which are on the cell's bus, and due after its own.

    Args:
        trial: the trial, with whose model the simulation was made.
        simulation: the cell's.
        bus: the cell's.
        pictures: draws the pictures of their cameras.
        parts: the parts that their hands may hold.

    Returns:
        Their controllers, by name.
    """
    found = {}
    for number, robot in enumerate(trial.layout.robots, 1):
        controller = _add(robot, trial.robot_models[robot.name], simulation, bus, pictures, number * _RANKS)
        for hand in robot.hands:
            simulation.add(HoldingHand(parts, hand, partial(_closing, controller, hand.side)))
        found[robot.name] = controller
    return found


def _closing(controller: RobotController, side: int) -> float:
    """Return how far the targets of a gripper are closed, from 0 to 1."""
    return controller.grippers[side].status(controller.commander.applied)


def _add(
    robot: CellRobot, config: RobotConfig, simulation: Simulation, bus: Bus, pictures: RenderService, rank: int
) -> RobotController:
    from cellwright.robot.controller import Place, RobotController  # most cells have no robots
    from cellwright.robot.interface import rows_in_cell
    from cellwright.robot.model import build_links
    from cellwright.robot.publications import add_cameras
    from cellwright.robot.safety import SafetySettings

    clock = simulation.clock
    place = Place(bus, clock.read, clock.message_time, lambda: clock.offset, robot.prefix, robot.namespace)
    controller = RobotController(config, build_links(config), place, SafetySettings())
    controller.add_devices(simulation)
    cameras = add_cameras(
        config, simulation, pictures, _reporter(bus), prefix=robot.prefix, frame_prefix=robot.frame_prefix
    )
    table = rows_in_cell(config, cameras=cameras, node=NODE, namespace=robot.namespace)
    bind(bus, simulation, table, controller.handlers(cameras), first=rank)
    return controller


def _reporter(bus: Bus) -> Callable[[str], None]:
    """Return a function that gives a line to those who listen to the notices of a bus."""

    def report(line: str) -> None:
        for take in bus.on_notice:
            take(line)

    return report
