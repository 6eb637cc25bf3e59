"""The contract of the kit-building cell bound to its devices."""

from __future__ import annotations

from cellwright.cell.interface.action import TrajectoryAction
from cellwright.cell.interface.cameras import bind_cameras
from cellwright.cell.interface.commands import Commands
from cellwright.cell.interface.devices import GearDevices
from cellwright.cell.interface.plugin_sensors import bind_brought_sensors
from cellwright.cell.interface.publications import Publications
from cellwright.cell.interface.rows import rows
from cellwright.engine.device import Device
from cellwright.middleware.bus import Bus


def bind(bus: Bus, devices: GearDevices, *, competition: bool) -> None:
    """Put every topic, service and action of the contract on the bus.

    Args:
        bus: an empty bus.
        devices: what the names are bound to. The simulation is to be reset afterwards, which begins the first run.
        competition: competition mode, in which cheats are refused.

    Raises:
        UsageError: a sensor's name makes it publish where something else does, in another type.
    """
    table = rows(devices.trial, competition=competition)
    Commands(devices, competition=competition).serve(bus)
    bound: list[Device] = [Publications(bus, devices, table, competition=competition)]
    if devices.arm is not None:
        bound.append(TrajectoryAction(bus, table, devices.simulation, devices.arm))
    for each in bound:
        devices.simulation.add(each)
    bind_cameras(bus, devices)
    bind_brought_sensors(bus, devices)
