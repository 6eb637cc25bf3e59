"""Cellwright: industrial robot cells, simulated in Python.

What most programs need is here by its own name: `cellwright.Cell`, `cellwright.run_trial`, …. A name is imported when
it is first asked for, so that `import cellwright` costs next to nothing, and works under the Python of ROS 1 too.
"""

from __future__ import annotations

import os
from importlib import import_module
from typing import TYPE_CHECKING

__version__ = "0.1.0"

if os.environ.get("MUJOCO_GL", "disable") != "disable":
    from cellwright import mujoco_gl

    mujoco_gl.settle()

if TYPE_CHECKING:
    from cellwright import errors as errors
    from cellwright.agents.agent import Agent as Agent
    from cellwright.assembled import AssembledRobot as AssembledRobot
    from cellwright.cell import Cell as Cell
    from cellwright.client import Client as Client
    from cellwright.client import Session as Session
    from cellwright.contracts.plugin_sensors import SensorPlugin as SensorPlugin
    from cellwright.description.trial import Trial as Trial
    from cellwright.devices.sensors.sensor import Reading as Reading
    from cellwright.devices.sensors.sensor import Sensor as Sensor
    from cellwright.errors import CellwrightError as CellwrightError
    from cellwright.face import DescriptionWarning as DescriptionWarning
    from cellwright.face import load_robot as load_robot
    from cellwright.face import load_trial as load_trial
    from cellwright.face import run_trial as run_trial
    from cellwright.pose import Pose as Pose
    from cellwright.replay.opened import OpenedRecording as OpenedRecording
    from cellwright.replay.opened import open_recording as open_recording
    from cellwright.run import Outcome as Outcome
    from cellwright.run import RunOptions as RunOptions
    from cellwright.run import RunResult as RunResult
    from cellwright.run import run_cell as run_cell
    from cellwright.simulation.device import Device as Device
    from cellwright.teleop.drivers.driver import Driver as Driver
    from cellwright.teleop.node import RobotNode as RobotNode

_HOMES = {
    "Agent": "agents.agent",
    "AssembledRobot": "assembled",
    "Cell": "cell",
    "CellwrightError": "errors",
    "Client": "client",
    "DescriptionWarning": "face",
    "Device": "simulation.device",
    "Driver": "teleop.drivers.driver",
    "OpenedRecording": "replay.opened",
    "Outcome": "run",
    "Pose": "pose",
    "Reading": "devices.sensors.sensor",
    "RobotNode": "teleop.node",
    "RunOptions": "run",
    "RunResult": "run",
    "Sensor": "devices.sensors.sensor",
    "SensorPlugin": "contracts.plugin_sensors",
    "Session": "client",
    "Trial": "description.trial",
    "load_robot": "face",
    "load_trial": "face",
    "open_recording": "replay.opened",
    "run_cell": "run",
    "run_trial": "face",
}
"""The module in which each public name stands."""

__all__ = [
    "__version__",
    "errors",
    *_HOMES,
]

if not TYPE_CHECKING:  # a checker then tells a name that there is not

    def __getattr__(name: str) -> object:
        """A public name, from where it stands."""
        if name == "errors":
            return import_module("cellwright.errors")
        if name not in _HOMES:
            raise AttributeError(f"module 'cellwright' has no attribute {name!r}")
        found = getattr(import_module(f"cellwright.{_HOMES[name]}"), name)
        globals()[name] = found
        return found

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})
