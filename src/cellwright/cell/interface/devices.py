"""What the contract of the kit-building cell is bound to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from cellwright.cell.competition import Competition
from cellwright.cell.devices.agv import Agv
from cellwright.cell.devices.arm import Arm
from cellwright.cell.devices.conveyor import Conveyor
from cellwright.cell.devices.gripper.vacuum_gripper import VacuumGripper
from cellwright.cell.devices.kit_tray import KitTray
from cellwright.cell.devices.population import Population
from cellwright.cell.devices.sensors.quality_control import QualityControlSensor
from cellwright.cell.interface.intention import Intention
from cellwright.config.trial.trial import Trial
from cellwright.engine.sensor import Sensor
from cellwright.engine.simulation import Simulation


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
