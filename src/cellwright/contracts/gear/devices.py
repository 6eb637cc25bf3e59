"""What the contract of the kit-building cell is bound to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from cellwright.competition import Competition
from cellwright.contracts.gear.intention import Intention
from cellwright.description.trial import Trial
from cellwright.devices.agv import Agv
from cellwright.devices.arm import Arm
from cellwright.devices.conveyor import Conveyor
from cellwright.devices.gripper.vacuum_gripper import VacuumGripper
from cellwright.devices.kit_tray import KitTray
from cellwright.devices.population import Population
from cellwright.devices.sensors.quality_control import QualityControlSensor
from cellwright.devices.sensors.sensor import Sensor
from cellwright.simulation.simulation import Simulation


@dataclass(frozen=True)
class GearDevices:
    """The devices of one cell. Arm and gripper are None in a cell without an arm, the population without belt parts."""

    trial: Trial
    simulation: Simulation
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
