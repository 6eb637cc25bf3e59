"""Devices behind the interface of the kit-building cell, and the intention that the agent states."""

import json
from collections.abc import Mapping
from typing import Any, TypeVar

from cellwright.cell.competition import Competition
from cellwright.cell.devices.agv import Agv
from cellwright.cell.devices.arm import Arm
from cellwright.cell.devices.conveyor import Conveyor, Population
from cellwright.cell.devices.grippers import Gripper
from cellwright.cell.devices.kit_sender import KitSender
from cellwright.cell.devices.kit_tray import KitTray
from cellwright.cell.devices.logical_camera import QualityControlSensor
from cellwright.config.trial.trial import Trial
from cellwright.engine.sensor import Sensor
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus
from cellwright.util.errors import RejectedCommandError, UsageError, printable

MAX_INTENTION_LENGTH = 200
"""Largest length of a stored intention [characters]; the rest is cut off."""

MAX_OPERATOR_STATE = 100_000
"""Largest length of the state that an operator agent reports [characters]."""

D = TypeVar("D")


class OperatorReport:
    """The latest state that an operator agent has reported, for pages; not part of the cell's state."""

    def __init__(self) -> None:
        self.state: Mapping[str, Any] | None = None
        """The state; None if no operator agent has come in this run."""

    def update(self, text: str) -> None:
        """Take a report.

        Raises:
            RejectedCommandError: it is no JSON object, or too long.
        """
        try:
            state = json.loads(text) if len(text) <= MAX_OPERATOR_STATE else None
        except (ValueError, RecursionError):
            state = None
        if not isinstance(state, dict):
            raise RejectedCommandError(
                f"operator: the state must be a JSON object of at most {MAX_OPERATOR_STATE} characters "
                f"(got {text[:40]!r})"
            )
        self.state = state

    def clear(self) -> None:
        """Forget the agent: another run begins."""
        self.state = None


class Intention:
    """The latest statement of an agent about its current activity."""

    def __init__(self) -> None:
        self.text = ""
        """The statement; empty if there was none in this run."""
        self.node = ""
        """Name of the node that made it."""
        self.time = 0
        """Its simulation time [ns]."""
        self.operator = OperatorReport()
        """Latest report of an operator agent."""

    def update(self, text: str, node: str, now: int) -> None:
        """Record a statement, reduced to one printable line."""
        line = " ".join(printable(text[: 4 * MAX_INTENTION_LENGTH], 4 * MAX_INTENTION_LENGTH).split())
        self.text = line if len(line) <= MAX_INTENTION_LENGTH else line[: MAX_INTENTION_LENGTH - 1] + "…"
        self.node, self.time = node, now

    def clear(self) -> None:
        """Discard the statement, and what an operator agent has reported."""
        self.text, self.node, self.time = "", "", 0
        self.operator.clear()


class CellDevices:
    """Devices of a cell, as its interface uses them.

    Arms, belts and what submits kits are found by their names in the layout, grippers by the names of their arms.
    Populations are found by those of their belts, and trays, AGVs and quality control sensors by their numbers.
    """

    trial: Trial
    simulation: Simulation
    bus: Bus
    competition: Competition
    conveyors: Mapping[str, Conveyor]
    populations: Mapping[str, Population]
    arms: Mapping[str, Arm]
    grippers: Mapping[str, Gripper]
    trays: Mapping[int, KitTray]
    agvs: Mapping[int, Agv]
    senders: Mapping[str, KitSender]
    sensors: Mapping[str, Sensor[Any]]
    quality: Mapping[int, QualityControlSensor]
    intention: Intention

    @property
    def arm(self) -> Arm | None:
        """The only arm; None if the cell has none. Those of a cell with several are in `arms`."""
        return _only(self.arms, "arms")

    @property
    def gripper(self) -> Gripper | None:
        """The only gripper; None if the cell has none. Those of a cell with several are in `grippers`."""
        return _only(self.grippers, "grippers")


def named(devices: Mapping[str, D], name: str | None) -> D:
    """Return a device by its name; the only one, for rows that do not name it."""
    return devices[name] if name is not None else next(iter(devices.values()))


def of_arm(devices: Mapping[str, D], trial: Trial, namespace: str | None) -> D:
    """Return what is there for the arm with a namespace; None is that of rows without one."""
    return devices[next(arm.name for arm in trial.arms if arm.namespace == (namespace or ""))]


def _only(devices: Mapping[str, D], kind: str) -> D | None:
    """Return the only device; None if there is none."""
    if len(devices) > 1:
        raise UsageError(f"the cell has several {kind}; take one of {', '.join(devices)} from cell.{kind}")
    return next(iter(devices.values()), None)
