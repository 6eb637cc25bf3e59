"""Checks a driver by driving it: what `Driver` promises, before a robot depends on it."""

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import Limits
from cellwright.robot.drivers import Driver, DriverError, LiveDriver
from cellwright.util.errors import in_a_line

NUDGE = 0.02
"""How far each joint is moved, and back [rad; m]; away from a limit that is near, and no farther than to the other."""
LEAST = 1e-3
"""Joints that have no more way than this [rad; m] are left alone."""
RATE = 100
"""How often a driver is to be read [1/s]: so often joint states leave the node."""

_LOOK = 0.5  # [s], how long readings are counted
_NAP = 0.002  # [s]


def check_driver(make: Callable[[RobotConfig], Driver], config: RobotConfig, *, within: float = 5.0) -> list[str]:
    """What is wrong with a driver, a sentence each; empty if nothing was found.

    The robot moves: each joint of the driver that `make` makes by `NUDGE` and back, one after another, each way
    `within` so long [s]. Nothing may stand in its way.
    """
    try:
        driver = make(config)
    except Exception as error:  # somebody else's code
        return [f"it cannot be made: {in_a_line(error)}"]
    problems = _lacking(driver)
    if problems:
        return problems
    try:
        live = LiveDriver(config, driver)
    except DriverError as error:
        return [str(error)]
    try:
        problems += _slow(live) + _moved(live, driver, config, within)
        if live.fault:
            problems.append(f"it failed: {live.fault}")
    finally:
        live.close()
    return problems


def _lacking(driver: object) -> list[str]:
    lacking = [name for name in ("command", "read", "close") if not callable(getattr(driver, name, None))]
    problems = [f"it has no method {name}" for name in lacking]
    return problems if hasattr(driver, "joints") else [*problems, "it has no attribute joints"]


def _slow(live: LiveDriver) -> list[str]:
    """Count readings."""
    before, begun = live.count, time.monotonic()
    _wait(lambda: bool(live.fault), _LOOK, live)
    rate = (live.count - before) / (time.monotonic() - begun)
    return [f"it can be read {rate:.0f} times a second, and {RATE} are needed"] if rate < RATE else []


def _moved(live: LiveDriver, driver: Driver, config: RobotConfig, within: float) -> list[str]:
    """Move each joint there and back; those that follow another go with it."""
    problems = []
    robot, begin = config.robot, live.read().positions.copy()
    for name in driver.joints:
        if robot.joint(name).mimic is not None:
            continue
        number = live.joints.index(name)
        nudge = _nudge(robot.joint(name).limits, begin[number])
        if abs(nudge) < LEAST:
            continue
        there = begin.copy()
        there[number] += nudge
        for each in robot.driven:
            if each.mimic and each.mimic.joint == name and each.name in driver.joints:  # others stay where they were
                there[live.joints.index(each.name)] += each.mimic.multiplier * nudge
        for targets, what in ((there, "go"), (begin, "come back")):
            live.command(targets)
            if not _wait(partial(_is_there, live, number, targets[number], abs(nudge) / 4), within, live):
                problems.append(f"{name} did not {what} {abs(nudge):.2g} within {within:g} s")
                break
            away = np.abs(live.read().positions - targets)
            away[number] = 0.0
            if away.max() > NUDGE / 2:
                problems.append(f"{live.joints[int(away.argmax())]} moved along with {name}")
        if live.fault:
            break
    return problems


def _nudge(limits: Limits, position: float) -> float:
    """By how much a joint is to be moved from where it stands [rad; m]: never past a limit."""
    up, down = max(0.0, limits.upper - position), max(0.0, position - limits.lower)
    return min(NUDGE, up) if up >= min(NUDGE, down) else -min(NUDGE, down)


def _is_there(live: LiveDriver, number: int, goal: float, near: float) -> bool:
    return bool(live.fault) or abs(live.read().positions[number] - goal) < near


def _wait(condition: Callable[[], bool], within: float, live: LiveDriver) -> bool:
    """Wait for something while the driver is read as the node does; whether it came."""
    end = time.monotonic() + within
    while not condition():
        if time.monotonic() > end:
            return False
        live.read()
        time.sleep(_NAP)
    return True
