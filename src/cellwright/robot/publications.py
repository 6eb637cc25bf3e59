"""What the node says: its topics, each sampled only while somebody listens."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from cellwright.config.robot.model import RobotModel
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus
from cellwright.middleware.interface.sampling import Sampled
from cellwright.middleware.interface.table import Row
from cellwright.middleware.messages import Message
from cellwright.middleware.messages.build import joint_state, stamp
from cellwright.middleware.messages.standard import Clock
from cellwright.robot.commander import Commander
from cellwright.robot.drivers.driver import Driver
from cellwright.robot.hands.grippers import GripperRange
from cellwright.robot.status import StatusTopic

_CLOCK_RANK = -10  # a message never comes before the clock that it is stamped with


class Publications:
    """The topics that leave the node.

    Args:
        robot: whose node it is.
        driver: tells of the joints.
        commander: tells of what is applied.
        grippers: right, left.
        told: the time that messages carry [ns].
    """

    def __init__(
        self,
        robot: RobotModel,
        driver: Driver,
        commander: Commander,
        grippers: Sequence[GripperRange],
        told: Callable[[], int],
    ) -> None:
        self._driver, self._commander, self._grippers, self._told = driver, commander, tuple(grippers), told
        self._names = [joint.name for joint in robot.movable]
        self._places = np.array([self._names.index(name) for name in driver.joints], dtype=int)
        self._driven = list(driver.joints)
        self._gripper_names = [f"gripper_{number}" for number in range(len(self._grippers))]

    def advertise(self, bus: Bus, simulation: Simulation, table: tuple[Row, ...]) -> None:
        """Take a place on the bus."""
        build: dict[str, Callable[[], Message | None]] = {
            "/clock": lambda: Clock(stamp(simulation.now)),
            "/io_teleop/joint_states": self._joint_states,
            "/io_teleop/applied_joint_cmd": self._applied,
            "/io_teleop/gripper_states": self._gripper_states,
        }
        for number, row in enumerate(table, 1):
            if row.name in build:
                rank = _CLOCK_RANK if row.name == "/clock" else number
                Sampled(bus, simulation, row, row.period, build[row.name], rank=rank)
            elif row.name == "/io_teleop/status":
                simulation.add(StatusTopic(bus, simulation, row, self._commander, rank=number))

    def _joint_states(self) -> Any:
        columns = np.zeros((3, len(self._names)))  # joints of more than one degree of freedom say 0
        columns[:, self._places] = self._driver.read()
        columns += 0.0  # nobody wants to read -0.0
        return joint_state(self._names, *columns, time=self._told())

    def _applied(self) -> Any:
        return joint_state(self._driven, self._commander.applied, time=self._told())

    def _gripper_states(self) -> Any:
        positions = self._driver.read().positions
        statuses = [gripper.status(positions) for gripper in self._grippers]
        return joint_state(self._gripper_names, statuses, time=self._told())
