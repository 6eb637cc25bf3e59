"""The model of a robot that somebody else's driver moves: it shows what the driver reads."""

from __future__ import annotations

from collections.abc import Callable

from cellwright.devices.joint_servos import JointServos
from cellwright.simulation.device import Device
from cellwright.teleop.live_driver import LiveDriver


class Mirror(Device):
    """Puts the model's joints where the robot's are, before each step, so that nothing moves by physics.

    Args:
        driver: of the robot.
        servos: of the model.
        hold: forgets what the joints were told, so that they are to stay where they are.
        report: takes a line about each failure of the driver.
    """

    def __init__(
        self, driver: LiveDriver, servos: JointServos, hold: Callable[[], None], report: Callable[[str], None]
    ) -> None:
        super().__init__("mirror")
        self._driver = driver
        self._servos = servos
        self._hold = hold
        self._report = report
        self._told = ""

    def reset(self) -> None:
        """Begin with the posture of the robot."""
        self._show()

    def before_step(self) -> None:
        """Look at the robot; while its driver has failed, whatever comes is forgotten."""
        self._show()
        fault = self._driver.fault
        if fault:
            self._hold()
            if not self._told:
                self._report(f"the driver has failed, and the robot holds: {fault}")
        self._told = fault

    def close(self) -> None:
        """Let go of the robot."""
        self._driver.close()

    def _show(self) -> None:
        self._servos.place(range(len(self._servos.joints)), self._driver.read().positions)
