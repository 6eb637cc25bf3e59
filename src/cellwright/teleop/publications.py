"""What the node says: its topics, each sampled only while somebody listens."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from cellwright.bus import Bus
from cellwright.contracts.sampling import Sampled
from cellwright.contracts.table import Row
from cellwright.description.robot.model import RobotModel
from cellwright.messages import Message
from cellwright.messages.build import joint_state
from cellwright.simulation.simulation import Simulation
from cellwright.teleop.commander import Commander
from cellwright.teleop.driver import Driver


class Publications:
    """The topics that leave the node.

    Args:
        robot: whose node it is.
        driver: tells of the joints.
        stamp: the time that messages carry [ns].
    """

    def __init__(self, robot: RobotModel, driver: Driver, commander: Commander, stamp: Callable[[], int]) -> None:
        self._driver, self._commander, self._stamp = driver, commander, stamp
        self._names = [joint.name for joint in robot.movable]
        self._places = np.array([self._names.index(name) for name in driver.joints], dtype=int)

    def advertise(self, bus: Bus, simulation: Simulation, table: tuple[Row, ...]) -> None:
        """Take a place on the bus."""
        build: dict[str, Callable[[], Message | None]] = {
            "/io_teleop/joint_states": self._joint_states,
            "/io_teleop/applied_joint_cmd": self._applied,
        }
        for row in table:
            if row.name in build:
                Sampled(bus, simulation, row, row.period, build[row.name])

    def _joint_states(self) -> Any:
        columns = np.zeros((3, len(self._names)))  # joints of more than one degree of freedom say 0
        columns[:, self._places] = self._driver.read()
        return joint_state(self._names, *columns, time=self._stamp())

    def _applied(self) -> Any:
        return joint_state(list(self._driver.joints), self._commander.applied, time=self._stamp())
