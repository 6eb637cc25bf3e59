"""Cellwright: industrial robot cells, simulated in Python.

The names that most programs need are imported from here: `cellwright.Cell`, `cellwright.run_trial`, …. A name is loaded
at its first use. So `import cellwright` costs next to nothing, and works under the Python of ROS 1 too.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import TYPE_CHECKING

from cellwright._package import VERSION

__version__ = VERSION

if os.environ.get("MUJOCO_GL", "disable") != "disable":
    from cellwright.util import mujoco_gl

    mujoco_gl.settle()

if TYPE_CHECKING:
    from cellwright.cell.cell import Cell as Cell
    from cellwright.cell.interface.plugins import SensorPlugin as SensorPlugin
    from cellwright.clients.agents.agent import Agent as Agent
    from cellwright.clients.assembled import AssembledRobot as AssembledRobot
    from cellwright.clients.client import Client as Client
    from cellwright.clients.client import NodeClient as NodeClient
    from cellwright.config.trial.trial import Trial as Trial
    from cellwright.engine.device import Device as Device
    from cellwright.engine.sensor import Reading as Reading
    from cellwright.engine.sensor import Sensor as Sensor
    from cellwright.recording.dataset.recorded import recorded_episode as recorded_episode
    from cellwright.recording.opened import Recording as Recording
    from cellwright.recording.opened import open_recording as open_recording
    from cellwright.rendering.cameras.picture_camera import read_pictures as read_pictures
    from cellwright.robot.drivers import Driver as Driver
    from cellwright.robot.node import RobotNode as RobotNode
    from cellwright.running.run import DescriptionWarning as DescriptionWarning
    from cellwright.running.run import Outcome as Outcome
    from cellwright.running.run import Outputs as Outputs
    from cellwright.running.run import PageOptions as PageOptions
    from cellwright.running.run import RecordOptions as RecordOptions
    from cellwright.running.run import RunOptions as RunOptions
    from cellwright.running.run import RunResult as RunResult
    from cellwright.running.run import ServerOptions as ServerOptions
    from cellwright.running.run import Session as Session
    from cellwright.running.run import SessionResult as SessionResult
    from cellwright.running.run import load_robot as load_robot
    from cellwright.running.run import load_trial as load_trial
    from cellwright.running.run import run_cell as run_cell
    from cellwright.running.run import run_trial as run_trial
    from cellwright.util import errors as errors
    from cellwright.util.errors import CellwrightError as CellwrightError
    from cellwright.util.pose import Pose as Pose

_HOMES = {
    "Agent": "clients.agents.agent",
    "AssembledRobot": "clients.assembled",
    "Cell": "cell.cell",
    "CellwrightError": "util.errors",
    "Client": "clients.client",
    "DescriptionWarning": "running.run",
    "Device": "engine.device",
    "Driver": "robot.drivers",
    "NodeClient": "clients.client",
    "Recording": "recording.opened",
    "Outcome": "running.run",
    "Outputs": "running.run",
    "PageOptions": "running.run",
    "RecordOptions": "running.run",
    "Pose": "util.pose",
    "Reading": "engine.sensor",
    "RobotNode": "robot.node",
    "RunOptions": "running.run",
    "RunResult": "running.run",
    "Sensor": "engine.sensor",
    "SensorPlugin": "cell.interface.plugins",
    "ServerOptions": "running.run",
    "Session": "running.run",
    "SessionResult": "running.run",
    "Trial": "config.trial.trial",
    "load_robot": "running.run",
    "load_trial": "running.run",
    "open_recording": "recording.opened",
    "read_pictures": "rendering.cameras.picture_camera",
    "recorded_episode": "recording.dataset.recorded",
    "run_cell": "running.run",
    "run_trial": "running.run",
}
"""Module of each public name."""


class _EngineCheck:
    """Finder that finds nothing: it has the engine's files checked before Python loads them."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:  # noqa: ARG002
        """Check the engine's files if a module is about to load the engine."""
        if name == "mujoco":
            import_module("cellwright.engine.installed").check_files()


sys.meta_path.insert(0, _EngineCheck())

__all__ = ["__version__", "errors", *_HOMES]

if not TYPE_CHECKING:  # so that a type checker reports unknown names

    def __getattr__(name: str) -> object:
        """Return a public name from its module."""
        if name == "errors":
            return import_module("cellwright.util.errors")
        if name not in _HOMES:
            raise AttributeError(f"module 'cellwright' has no attribute {name!r}")
        found = getattr(import_module(f"cellwright.{_HOMES[name]}"), name)
        globals()[name] = found
        return found

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})
