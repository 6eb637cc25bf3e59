"""Cellwright: industrial robot cells, simulated in Python.

The names that most programs need are imported from here: `cellwright.Cell`, `cellwright.run_trial`, …. A name is loaded
at its first use. So `import cellwright` costs next to nothing, and works under the Python of ROS 1 too.
"""

from __future__ import annotations

import os
import sys
import warnings
from importlib import import_module
from importlib.machinery import ModuleSpec
from typing import TYPE_CHECKING, cast

from cellwright._package import VERSION

__version__ = VERSION

if os.environ.get("MUJOCO_GL", "disable") != "disable":
    from cellwright.util import mujoco_gl

    mujoco_gl.settle()

if TYPE_CHECKING:
    from importlib.abc import Loader
    from types import ModuleType

    from cellwright.cell.cell import Cell as Cell
    from cellwright.cell.interface.plugins import SensorPlugin as SensorPlugin
    from cellwright.clients.agents.agent import Agent as Agent
    from cellwright.clients.assembled import AssembledRobot as AssembledRobot
    from cellwright.clients.client import Client as Client
    from cellwright.clients.client import NodeClient as NodeClient
    from cellwright.config.trial.trial import Trial as Trial
    from cellwright.engine.sensor import Reading as Reading
    from cellwright.engine.sensor import Sensor as Sensor
    from cellwright.engine.simulation import Device as Device
    from cellwright.recording.replay.opened import Recording as Recording
    from cellwright.recording.replay.opened import open_recording as open_recording
    from cellwright.rendering.cameras.picture_camera import read_pictures as read_pictures
    from cellwright.robot.drivers import Driver as Driver
    from cellwright.robot.node import RobotNode as RobotNode
    from cellwright.running.run import DescriptionWarning as DescriptionWarning
    from cellwright.running.run import Outcome as Outcome
    from cellwright.running.run import PageOptions as PageOptions
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
    "Device": "engine.simulation",
    "Driver": "robot.drivers",
    "NodeClient": "clients.client",
    "Recording": "recording.replay.opened",
    "Outcome": "running.run",
    "PageOptions": "running.run",
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
    "open_recording": "recording.replay.opened",
    "read_pictures": "rendering.cameras.picture_camera",
    "run_cell": "running.run",
    "run_trial": "running.run",
}
"""Module of each public name."""

_MOVED = {
    "agents": "clients.agents",
    "agents.agent": "clients.agents.agent",
    "agents.lesson": "clients.agents.lesson",
    "assembled": "clients.assembled",
    "client": "clients.client",
    "client.session": "clients.client.session",
    "client.transports": "clients.client",
    "client.transports.in_process": "clients.client.in_process",
    "contracts": "cell.interface",
    "contracts.plugin_sensors": "cell.interface.plugins",
    "contracts.table": "middleware.interface.table",
    "description": "config.trial",
    "description.catalogue": "config.trial.catalogue",
    "description.gear2017": "config.trial.gear2017",
    "description.robot": "config.robot",
    "description.robot.config": "config.robot.config",
    "description.robot.posture": "config.robot.model",
    "description.robot.robots": "config.robot.robots",
    "description.trial": "config.trial.trial",
    "devices": "cell.devices",
    "devices.sensors": "cell.devices",
    "devices.sensors.picture_camera": "rendering.cameras.picture_camera",
    "devices.sensors.scene": "cell.devices.logical_camera",
    "devices.sensors.sensor": "engine.sensor",
    "errors": "util.errors",
    "kitting": "cell.kitting",
    "kitting.effects": "cell.kitting.effects",
    "messages": "middleware.messages",
    "messages.build": "middleware.messages.conversions",
    "messages.control_msgs": "middleware.messages.control_msgs",
    "messages.osrf_gear": "middleware.messages.osrf_gear",
    "messages.standard": "middleware.messages.standard",
    "messages.std_srvs": "middleware.messages.std_srvs",
    "operators": "clients.operators",
    "operators.exercise": "clients.operators.exercise",
    "operators.robot": "clients.operators.robot",
    "operators.waves": "clients.operators.exercise",
    "pose": "util.pose",
    "recording.json_lines": "util.files",
    "recording.run_log": "recording.format.run_log",
    "rendering.robots": "robot.pictures",
    "replay": "recording.replay",
    "replay.opened": "recording.replay.opened",
    "run": "running.run",
    "simulation": "engine",
    "simulation.device": "engine.simulation",
    "teleop": "robot",
    "teleop.node": "robot.node",
    "teleop.safety": "robot",
    "teleop.safety.settings": "robot.safety",
    "variation": "cell.variation",
    "world": "cell.model",
    "world.arm": "cell.model.arm",
    "world.robot": "robot.model",
    "world.shapes": "engine.shapes",
}
"""Module paths that the pages of version 0.1 documented, and their present ones. The old names work in 0.2."""


class _Moved:
    """Finder and loader of modules by their names in version 0.1."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:  # noqa: ARG002
        """Return the spec of the present module for an old name; None for any other name."""
        home = _MOVED.get(name[len("cellwright.") :]) if name.startswith("cellwright.") else None
        return ModuleSpec(name, cast("Loader", self), origin=f"cellwright.{home}") if home else None

    def create_module(self, spec: ModuleSpec) -> None:
        """Leave the creation of the module to Python."""

    def exec_module(self, module: ModuleType) -> None:
        """Replace the module by the present one."""
        old, new = module.__name__, str(getattr(module.__spec__, "origin", None))
        warnings.warn(f"{old} is deprecated; use {new}", DeprecationWarning, stacklevel=2)
        sys.modules[old] = import_module(new)


class _EngineCheck:
    """Finder that finds nothing: it has the engine's files checked before Python loads them."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:  # noqa: ARG002
        """Check the engine's files if a module is about to load the engine."""
        if name == "mujoco":
            import_module("cellwright.engine.installed").check_files()


sys.meta_path.insert(0, _EngineCheck())
sys.meta_path.insert(0, _Moved())  # before the finder of files, which would load a present module a second time

__all__ = ["__version__", "errors", *_HOMES]

if not TYPE_CHECKING:  # so that a type checker reports unknown names

    def __getattr__(name: str) -> object:
        """Return a public name from its module."""
        if name == "errors":
            return import_module("cellwright.util.errors")
        if name == "OpenedRecording":  # its name in version 0.1
            warnings.warn(
                "cellwright.OpenedRecording is deprecated; use cellwright.Recording", DeprecationWarning, stacklevel=2
            )
            name = "Recording"
        if name not in _HOMES:
            raise AttributeError(f"module 'cellwright' has no attribute {name!r}")
        found = getattr(import_module(f"cellwright.{_HOMES[name]}"), name)
        globals()[name] = found
        return found

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})
