"""Devices behind the interface of the kit-building cell, and the intention that the agent states."""

from collections.abc import Mapping
from typing import Any, TypeVar

from cellwright.cell.competition import Competition
from cellwright.cell.devices.agv import Agv
from cellwright.cell.devices.arm import Arm
from cellwright.cell.devices.conveyor import Conveyor, Population
from cellwright.cell.devices.kit_sender import KitSender
from cellwright.cell.devices.kit_tray import KitTray
from cellwright.cell.devices.logical_camera import QualityControlSensor
from cellwright.cell.devices.vacuum_gripper import VacuumGripper
from cellwright.config.trial.trial import Trial
from cellwright.engine.sensor import Sensor
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus
from cellwright.util.errors import UsageError, printable

MAX_INTENTION_LENGTH = 200
"""Largest length of a stored intention [characters]; the rest is cut off."""

D = TypeVar("D")


class Intention:
    """The latest statement of an agent about its current activity."""

    def __init__(self) -> None:
        self.text = ""
        """The statement; empty if there was none in this run."""
        self.node = ""
        """Name of the node that made it."""
        self.time = 0
        """Its simulation time [ns]."""

    def update(self, text: str, node: str, now: int) -> None:
        """Record a statement, reduced to one printable line."""
        line = " ".join(printable(text[: 4 * MAX_INTENTION_LENGTH], 4 * MAX_INTENTION_LENGTH).split())
        self.text = line if len(line) <= MAX_INTENTION_LENGTH else line[: MAX_INTENTION_LENGTH - 1] + "…"
        self.node, self.time = node, now

    def clear(self) -> None:
        """Discard the statement."""
        self.text, self.node, self.time = "", "", 0


class CellDevices:
    """Devices of a cell, as its interface uses them.

    Arm and gripper are None in a cell without an arm. Belts and what submits kits are found by their names in the
    layout, populations by the names of their belts, and trays, AGVs and quality control sensors by their numbers.
    """

    trial: Trial
    simulation: Simulation
    bus: Bus
    competition: Competition
    conveyors: Mapping[str, Conveyor]
    populations: Mapping[str, Population]
    arm: Arm | None
    gripper: VacuumGripper | None
    trays: Mapping[int, KitTray]
    agvs: Mapping[int, Agv]
    senders: Mapping[str, KitSender]
    sensors: Mapping[str, Sensor[Any]]
    quality: Mapping[int, QualityControlSensor]
    intention: Intention


def named(devices: Mapping[str, D], name: str | None) -> D:
    """Return a device by its name; the only one, for rows that do not name it."""
    return devices[name] if name is not None else next(iter(devices.values()))


def present(device: D | None) -> D:
    """Return a device that a cell may lack, for rows that exist only with it."""
    if device is None:
        raise UsageError("this cell has no such device")
    return device
