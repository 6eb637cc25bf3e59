"""The commander: keeps what the joints were told last, and gives it to the driver before each step."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from cellwright.devices.joint_servos import Array
from cellwright.simulation.device import Device
from cellwright.teleop.driver import Driver


class Commander(Device):
    """Targets of all joints.

    Args:
        driver: whom they go to.
    """

    def __init__(self, driver: Driver) -> None:
        super().__init__("commander")
        self.driver = driver
        self.numbers = {name: number for number, name in enumerate(driver.joints)}
        self.aims = np.zeros(len(driver.joints), dtype=int)
        """How often each joint was given a target: whoever gave the newest one can tell whether it still stands."""

    def reset(self) -> None:
        """Hold what the robot stands in."""
        self.desired: Array = self.driver.read().positions.copy()
        self.applied: Array = self.desired.copy()

    def aim(self, joints: Iterable[int], positions: Iterable[float]) -> None:
        """Have joints, by their number, go to positions [rad; m]."""
        chosen = list(joints)
        self.desired[chosen] = list(positions)
        self.aims[chosen] += 1

    def before_step(self) -> None:
        """Give the driver what is to be applied in this step."""
        if not np.array_equal(self.desired, self.applied):
            self.applied = self.desired.copy()
            self.driver.command(self.applied)
