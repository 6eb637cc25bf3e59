"""Drivers of one's own, by the file that they stand in."""

from __future__ import annotations

from collections.abc import Callable

from cellwright.config.robot.config import RobotConfig
from cellwright.robot.drivers.driver import Driver
from cellwright.robot.drivers.live import DriverError
from cellwright.util.errors import in_a_line
from cellwright.util.plugins import own_classes


def find_driver(name: str) -> Callable[[RobotConfig], Driver]:
    """What makes a driver for a robot: a class in `path/to/file.py:Class`, or `package.module:Class`.

    Raises:
        DriverError: there is no such file, module or class, or it fails when it is imported. Making the driver raises
            it too, when that fails.
    """
    if not own_classes.is_place(name):
        raise DriverError(f"a driver is given as path.py:Class or module:Class, not {name!r}")
    found = own_classes.find(name, method="command", error=DriverError)
    if not callable(found) or not hasattr(found, "command"):
        raise DriverError(f"{name}: a driver is a class with joints, command(targets), read() and close()")

    def make(config: RobotConfig) -> Driver:
        try:
            driver: Driver = found(config)
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            raise DriverError(f"{name}: cannot be made: {in_a_line(error)}") from error
        return driver

    return make
