"""Devices that the interface of the kit-building cell is bound to, and the intention that the agent states."""

from collections.abc import Mapping
from typing import Any, TypeVar

from cellwright.cell.competition import Competition
from cellwright.cell.devices.agv import Agv
from cellwright.cell.devices.arm import Arm
from cellwright.cell.devices.conveyor import Conveyor, Population
from cellwright.cell.devices.kit_tray import KitTray
from cellwright.cell.devices.logical_camera import QualityControlSensor
from cellwright.cell.devices.vacuum_gripper import VacuumGripper
from cellwright.config.trial.trial import Trial
from cellwright.engine.sensor import Sensor
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus
from cellwright.util.errors import UsageError, showable

MAX_INTENTION_LENGTH = 200
"""Characters that are kept of it."""


class Intention:
    """The newest word of an agent about what it is doing."""

    def __init__(self) -> None:
        self.text = ""
        """What it said; empty when nothing was said in this run."""
        self.node = ""
        """Who said it."""
        self.time = 0
        """When [ns]."""

    def say(self, text: str, node: str, now: int) -> None:
        """Take note of a word; it is made fit for a line of text."""
        line = " ".join(showable(text[: 4 * MAX_INTENTION_LENGTH], 4 * MAX_INTENTION_LENGTH).split())
        self.text = line if len(line) <= MAX_INTENTION_LENGTH else line[: MAX_INTENTION_LENGTH - 1] + "…"
        self.node, self.time = node, now

    def forget(self) -> None:
        """Begin with nothing said."""
        self.text, self.node, self.time = "", "", 0


class CellDevices:
    """What a cell consists of, as its interface sees it.

    Arm and gripper are None in a cell without an arm, the population without belt parts.
    """

    trial: Trial
    simulation: Simulation
    bus: Bus
    competition: Competition
    conveyor: Conveyor
    population: Population | None
    arm: Arm | None
    gripper: VacuumGripper | None
    trays: Mapping[int, KitTray]
    agvs: Mapping[int, Agv]
    sensors: Mapping[str, Sensor[Any]]
    quality: Mapping[int, QualityControlSensor]
    intention: Intention


D = TypeVar("D")


def present(device: D | None) -> D:
    """A device that a cell may lack, where a row of the table is only there with it."""
    if device is None:
        raise UsageError("this cell has no such device")
    return device
