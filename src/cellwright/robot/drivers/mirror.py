"""The model of a robot that somebody else's driver moves: it shows what the driver reads."""

from __future__ import annotations

from collections.abc import Callable

from cellwright.engine.device import Device
from cellwright.robot.drivers.live import LiveDriver
from cellwright.robot.servos import JointServos


class Mirror(Device):
    """Puts the model's joints where the robot's are, before each step, so that nothing moves by physics.

    Args:
        driver: of the robot.
        servos: of the model.
        stop: stops the robot, and says why: joints are to stay where they are until somebody clears the stop.
        stand: called while the robot works: until its first target nothing holds it, and somebody may move it.
    """

    def __init__(
        self, driver: LiveDriver, servos: JointServos, stop: Callable[[str], None], stand: Callable[[], None]
    ) -> None:
        super().__init__("mirror")
        self._driver = driver
        self._servos = servos
        self._stop = stop
        self._stand = stand

    def reset(self) -> None:
        """Begin with the posture of the robot."""
        self._show()

    def before_step(self) -> None:
        """Look at the robot; a driver that has failed is an emergency stop."""
        self._show()
        fault = self._driver.fault
        if fault:
            self._stop(f"the driver has failed, and the robot holds: {fault}")
        else:
            self._stand()

    def close(self) -> None:
        """Let go of the robot."""
        self._driver.close()

    def _show(self) -> None:
        self._servos.place(range(len(self._servos.joints)), self._driver.read().positions)
