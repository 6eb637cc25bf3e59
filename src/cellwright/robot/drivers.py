"""Drivers: the protocol, the thread that calls a user's driver, the model that mirrors it, and plugin look-up."""

import contextlib
import threading
import time
from collections.abc import Callable, Mapping, Sized
from typing import Protocol

import numpy as np

from cellwright.config.robot.config import RobotConfig
from cellwright.engine.device import Device
from cellwright.robot.servos import Array, JointArrays, JointServos
from cellwright.util import plugins
from cellwright.util.errors import CellwrightError, UnknownNameError, one_line

DRIVER_TIMEOUT = 0.5
"""Silence of a driver [s] that counts as failure; as long as other robot frameworks wait for feedback."""
FIRST_READING_TIMEOUT = 10.0
"""Maximum duration of the first reading [s]: the hardware may have to be found and switched on."""
_IDLE_INTERVAL = 0.05  # [s] between two readings while the node is idle
_JOIN_TIMEOUT = 0.5  # [s]
_MAX_LOOK_INTERVAL = 0.1
"""Silence [s] that counts between two looks at most: after a longer one, this process itself stood still."""
_COLUMNS = ", ".join(JointArrays._fields[:-1]) + " and " + JointArrays._fields[-1]


class Driver(Protocol):
    """Driver of a robot's joints, as the node commands and reads them.

    Every array is in the order of `joints`: one number each [rad; m]. Targets are finite and within the limits of the
    joints, and have passed all safety checks.

    Example:
        >>> class Lift:
        ...     joints = ("lift",)
        ...     def command(self, targets):
        ...         self.position = targets
        ...     def read(self):
        ...         return JointArrays(self.position, velocities=np.zeros(1), efforts=np.zeros(1))
        ...     def close(self):
        ...         pass
        >>> lift: Driver = Lift()
        >>> lift.command(np.array([0.2]))
        >>> lift.read().positions.tolist()
        [0.2]
    """

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints with one degree of freedom, in the order of their indices."""
        ...

    def command(self, targets: Array) -> None:
        """Move to these positions; called before a step, and only when they have changed."""
        ...

    def read(self) -> JointArrays:
        """Return the current readings; called after a step."""
        ...

    def close(self) -> None:
        """Release the robot, which must stand still from then on."""
        ...


class DriverError(CellwrightError):
    """Driver that breaks the protocol of `Driver`; the text says how."""


class LiveDriver:
    """Adapter from a user's driver to all joints of the robot with one degree of freedom.

    The driver may have only some of them, in any order; the others keep their initial positions. The node never waits
    for hardware: a thread takes the newest targets, and the node sees the newest readings. A driver fails when it
    raises, returns invalid numbers or is silent for too long. It then holds the posture that it read last, and gets no
    target until the failure is cleared.

    Args:
        config: the robot.
        driver: the driver; all of its methods are called by one thread.
        timeout: silence [s] that counts as failure.

    Raises:
        DriverError: its joints are not the robot's, or its first reading fails; the driver is closed in both cases.
    """

    def __init__(self, config: RobotConfig, driver: Driver, *, timeout: float = DRIVER_TIMEOUT) -> None:
        robot = config.robot
        self.joints = tuple(joint.name for joint in robot.driven)
        self._driver = driver
        self._timeout = timeout
        try:
            self._places = _joint_numbers(self.joints, driver)
        except DriverError:
            close_driver(driver)
            raise
        self.count = 0
        """Number of readings."""
        still = np.zeros(len(self.joints))
        start = np.array([config.start.get(name, 0.0) for name in self.joints])
        self._readings = JointArrays(start, still, still)
        self._targets: Array | None = None
        self._fault = ""
        self._is_holding = False
        self._has_ended = False
        self._lock = threading.Lock()
        self._awake = threading.Event()
        self._silence, self._looked = 0.0, time.monotonic()
        first = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(first,), name="driver", daemon=True)
        self._thread.start()
        if not first.wait(FIRST_READING_TIMEOUT):
            self._fault = f"no first reading within {FIRST_READING_TIMEOUT:g} s"
        if self._fault:
            self.close()
            raise DriverError(f"the driver cannot be used: {self._fault}")

    @property
    def fault(self) -> str:
        """Reason why the driver is held; empty while it works."""
        with self._lock:
            now = time.monotonic()
            self._silence += min(now - self._looked, _MAX_LOOK_INTERVAL)
            self._looked = now
            if not self._fault and self._silence > self._timeout:
                self._fault = f"no reading for {self._timeout:g} s"
            return self._fault

    def clear(self) -> None:
        """Use the driver again, from a new reading; it fails again if the cause persists."""
        with self._lock:
            self._fault = ""
            self._is_holding = False
            self._targets = None
            self._silence = 0.0

    def command(self, targets: Array) -> None:
        """Set targets [rad; m] of all joints for the thread; they replace targets that it has not taken yet."""
        with self._lock:
            if not self._fault:
                self._targets = targets[self._places].copy()
        self._awake.set()

    def read(self) -> JointArrays:
        """Return the newest readings."""
        self._awake.set()
        return self._readings

    def close(self) -> None:
        """Release the robot, without waiting for a driver that is stuck."""
        self._has_ended = True
        self._awake.set()
        if threading.current_thread() is not self._thread:
            self._thread.join(_JOIN_TIMEOUT)

    def _run(self, first: threading.Event) -> None:
        while not self._has_ended:
            try:
                self._exchange()
            except DriverError as error:
                self._fail(str(error))
            except BaseException as error:  # user code must not stop the node
                self._fail(one_line(error))
            first.set()
            self._awake.wait(_IDLE_INTERVAL)
            self._awake.clear()
        close_driver(self._driver)

    def _exchange(self) -> None:
        """Pass new targets to the driver, and read it."""
        with self._lock:
            targets, self._targets = self._targets, None
            is_failed = bool(self._fault)
            if is_failed:
                targets = None if self._is_holding else self._readings.positions[self._places].copy()
        if targets is not None:
            self._driver.command(targets)
            # Not before: a hold that failed is sent again.
            with self._lock:
                # The failure may have been cleared meanwhile.
                self._is_holding = is_failed and bool(self._fault)
        readings = self._checked(self._driver.read())
        with self._lock:
            self._readings = readings
            self.count += 1
            self._silence = 0.0

    def _checked(self, found: JointArrays) -> JointArrays:
        if not isinstance(found, Sized) or isinstance(found, Mapping) or len(found) != len(JointArrays._fields):
            raise DriverError(f"read() must return {_COLUMNS} (got {_describe_type(found)})")
        columns = []
        for name, old, values in zip(JointArrays._fields, self._readings, found, strict=True):
            if np.ndim(values) != 1:
                problem = f"got {_describe_type(values)} for {name}"
                raise DriverError(f"read() must return {_COLUMNS}, each with one number a joint ({problem})")
            numbers = np.asarray(values, dtype=float)
            if numbers.shape != self._places.shape:
                raise DriverError(f"{name} must have {self._places.size} numbers, one a joint (got {numbers.size})")
            if not np.isfinite(numbers).all():
                joint = self.joints[self._places[np.flatnonzero(~np.isfinite(numbers))[0]]]
                raise DriverError(f"{name} of {joint} must be finite")
            column = old.copy()
            column[self._places] = numbers
            columns.append(column)
        return JointArrays(*columns)

    def _fail(self, reason: str) -> None:
        with self._lock:
            self._silence = 0.0
            if not self._fault:
                self._fault = reason


def close_driver(driver: Driver) -> None:
    """Close a driver, and ignore what it raises."""
    with contextlib.suppress(BaseException):
        driver.close()


def _describe_type(value: object) -> str:
    return f"a {type(value).__name__}" + (f" of {len(value)}" if isinstance(value, Sized) else "")


def _joint_numbers(joints: tuple[str, ...], driver: Driver) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return the number of each of the driver's joints among the robot's."""
    try:
        names = tuple(driver.joints)
    except Exception as error:  # user code
        raise DriverError(f"the driver cannot be used: its joints: {one_line(error)}") from error
    for name in names:
        if name not in joints:
            raise DriverError(f"the driver cannot be used: {UnknownNameError('joint', str(name), joints)}")
    if not names or len(set(names)) != len(names):
        raise DriverError("the driver cannot be used: joints must not be empty or repeat a name")
    return np.array([joints.index(name) for name in names], dtype=np.int64)


class Mirror(Device):
    """Device that sets the model's joints to the robot's positions before each step, in place of physics.

    It calls `stop`, with the reason, when the driver has failed, and `hold` while it works. Until the first target
    nothing holds the robot, and it may be moved by hand.
    """

    def __init__(
        self, driver: LiveDriver, servos: JointServos, stop: Callable[[str], None], hold: Callable[[], None]
    ) -> None:
        super().__init__("mirror")
        self._driver, self._servos, self._stop, self._hold = driver, servos, stop, hold

    def reset(self) -> None:
        """Start in the posture of the robot."""
        self._show()

    def before_step(self) -> None:
        """Read the robot; a driver that has failed causes an emergency stop."""
        self._show()
        fault = self._driver.fault
        if fault:
            self._stop(f"the driver has failed, the robot holds: {fault}")
        else:
            self._hold()

    def close(self) -> None:
        """Release the robot."""
        self._driver.close()

    def _show(self) -> None:
        self._servos.place(range(len(self._servos.joints)), self._driver.read().positions)


def find_driver(name: str) -> Callable[[RobotConfig], Driver]:
    """Return the factory of a driver: a class in `path/to/file.py:Class`, or `package.module:Class`.

    Raises:
        DriverError: there is no such file, module or class, or its import fails. Making the driver raises it too, when
            that fails.
    """
    if not plugins.is_class_path(name):
        raise DriverError(f"a driver must be path.py:Class or module:Class (got {name!r})")
    found = plugins.find_class(name, method="command", error=DriverError)
    if not callable(found) or not hasattr(found, "command"):
        raise DriverError(f"{name}: not a driver; give a class with joints, command(targets), read() and close()")
    return plugins.make_factory(name, found, DriverError)
