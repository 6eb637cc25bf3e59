"""The contract of the kit-building cell bound to its devices."""

from __future__ import annotations

from cellwright.bus import Bus
from cellwright.contracts.gear import rows
from cellwright.contracts.gear_action import TrajectoryAction
from cellwright.contracts.gear_commands import Commands
from cellwright.contracts.gear_devices import GearDevices
from cellwright.contracts.gear_publications import Publications


def bind(bus: Bus, devices: GearDevices, *, competition: bool) -> Publications:
    """Put every topic, service and action of the contract on the bus.

    Args:
        bus: an empty bus.
        devices: what the names are bound to.
        competition: competition mode, in which cheats are refused.

    Returns:
        The publications; `begin` is to be called whenever a run has begun.

    Raises:
        UsageError: a sensor's name makes it publish where something else does, in another type.
    """
    publications = Publications(bus, devices, rows(devices.trial, competition=competition), competition=competition)
    Commands(devices, competition=competition).serve(bus)
    if devices.arm is not None:
        TrajectoryAction(bus, devices.simulation, devices.arm)
    return publications
