"""Driver check: drives a robot and tests what `Driver` promises."""

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import Limits
from cellwright.robot.drivers import Driver, DriverError, LiveDriver
from cellwright.util.errors import one_line

NUDGE = 0.02
"""Motion of each joint, and back [rad; m]; away from a near limit, and at most to the other limit."""
MIN_RANGE = 1e-3
"""Joints with a smaller range [rad; m] are not moved."""
RATE = 100
"""Required rate of readings [1/s]: the rate of joint states."""

_LOOK = 0.5  # [s], time in which readings are counted
_LOOKS = 5  # number of such times at most; the best counts, since other programs slow this one down
_NAP = 0.002  # [s]


def check_driver(make: Callable[[RobotConfig], Driver], config: RobotConfig, *, within: float = 5.0) -> list[str]:
    """Check a driver; return a sentence for each defect.

    The robot moves, and needs free space: each joint of the driver goes by `NUDGE` and back, one after another.

    Args:
        make: makes the driver.
        config: the robot.
        within: time limit of each motion [s].
    """
    try:
        driver = make(config)
    except Exception as error:  # user code
        return [f"the driver cannot be made: {one_line(error)}"]
    problems = _missing_members(driver)
    if problems:
        return problems
    try:
        live = LiveDriver(config, driver)
    except DriverError as error:
        return [str(error)]
    try:
        problems += _rate_problems(live) + _motion_problems(live, driver, config, within)
        if live.fault:
            problems.append(f"the driver failed: {live.fault}")
    finally:
        live.close()
    return problems


def _missing_members(driver: object) -> list[str]:
    missing = [name for name in ("command", "read", "close") if not callable(getattr(driver, name, None))]
    problems = [f"the driver has no method {name}" for name in missing]
    return problems if hasattr(driver, "joints") else [*problems, "the driver has no attribute joints"]


def _rate_problems(live: LiveDriver) -> list[str]:
    """Check the rate of readings."""
    best = 0.0
    for _ in range(_LOOKS):
        before, started = live.count, time.monotonic()
        _wait(lambda: bool(live.fault), _LOOK, live)
        best = max(best, (live.count - before) / (time.monotonic() - started))
        if best >= RATE or live.fault:
            break
    return [f"read() must work {RATE} times a second (got {best:.0f})"] if best < RATE else []


def _motion_problems(live: LiveDriver, driver: Driver, config: RobotConfig, within: float) -> list[str]:
    """Move each joint there and back, together with joints that mimic it."""
    problems = []
    robot, begin = config.robot, live.read().positions.copy()
    for name in driver.joints:
        if robot.joint(name).mimic is not None:
            continue
        number = live.joints.index(name)
        nudge = _nudge(robot.joint(name).limits, begin[number])
        if abs(nudge) < MIN_RANGE:
            continue
        target_positions = begin.copy()
        target_positions[number] += nudge
        for each in robot.driven:
            if each.mimic and each.mimic.joint == name and each.name in driver.joints:  # others keep their positions
                target_positions[live.joints.index(each.name)] += each.mimic.multiplier * nudge
        for targets, motion in ((target_positions, "move by"), (begin, "move back by")):
            live.command(targets)
            if not _wait(partial(_is_there, live, number, targets[number], abs(nudge) / 4), within, live):
                problems.append(f"{name} did not {motion} {abs(nudge):.2g} within {within:g} s")
                break
            deviation = np.abs(live.read().positions - targets)
            deviation[number] = 0.0
            if deviation.max() > NUDGE / 2:
                problems.append(f"{live.joints[int(deviation.argmax())]} moved together with {name}")
        if live.fault:
            break
    return problems


def _nudge(limits: Limits, position: float) -> float:
    """Return the motion of a joint from its position [rad; m], within its limits."""
    up, down = max(0.0, limits.upper - position), max(0.0, position - limits.lower)
    return min(NUDGE, up) if up >= min(NUDGE, down) else -min(NUDGE, down)


def _is_there(live: LiveDriver, number: int, goal: float, near: float) -> bool:
    return bool(live.fault) or abs(live.read().positions[number] - goal) < near


def _wait(condition: Callable[[], bool], within: float, live: LiveDriver) -> bool:
    """Wait for a condition while the driver is read as by the node; return whether it came true."""
    end = time.monotonic() + within
    while not condition():
        if time.monotonic() > end:
            return False
        live.read()
        time.sleep(_NAP)
    return True
