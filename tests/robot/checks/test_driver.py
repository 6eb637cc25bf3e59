"""Driver check: it passes the example, and finds defects of others."""

import threading
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cellwright.config.robot.config import RobotConfig
from cellwright.robot.checks.driver import check_driver
from cellwright.robot.servos import Array, JointArrays
from tests.robot.drivers.test_live import NAMES, Hardware
from tests.robot.robots import two_arms
from tests.support.waiting import TIMEOUT

pytestmark = pytest.mark.usefixtures("patient")

EXAMPLE = Path(__file__).parents[3] / "examples" / "my_driver.py"


@pytest.fixture(scope="module")
def config() -> RobotConfig:
    return two_arms()


class Clock:
    """Clock of a check: a sleep takes its full time, and ends after one more reading of the driver."""

    def __init__(self) -> None:
        self.now = 0.0
        self._was_read = threading.Event()

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds
        self._was_read.clear()
        assert self._was_read.wait(TIMEOUT), "the driver is not read"

    def watched(self, driver: Any) -> Any:
        """Return a driver whose readings are counted, and take time."""
        if not hasattr(driver, "read"):
            return driver
        read = driver.read

        def read_and_record() -> Any:
            self.now += getattr(driver, "pause", 0.0)
            expected = read()
            self._was_read.set()
            return expected

        driver.read = read_and_record
        return driver


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """Replace the clock of the check, so that a busy machine does not slow a driver."""
    clock = Clock()
    monkeypatch.setattr("cellwright.robot.checks.driver.time", clock)
    return clock


def test_example_driver_passes_in_under_60_lines(config: RobotConfig, clock: Clock) -> None:
    source = EXAMPLE.read_text(encoding="utf-8")
    room: dict[str, Any] = {}
    exec(compile(source, str(EXAMPLE), "exec"), room)
    room["LAG"] = 0.01
    room["time"] = clock
    assert check_driver(lambda config: clock.watched(room["MyDriver"](config)), config) == []
    assert len(source.splitlines()) < 60


@dataclass
class Stiff(Hardware):
    """Hardware whose lift does not move."""

    def command(self, targets: Any) -> None:
        self.positions = np.array([targets[0], 0.2])


@dataclass
class Coupled(Hardware):
    """Hardware whose lift moves together with the elbow, and far."""

    def command(self, targets: Any) -> None:
        self.positions = np.array([targets[0], targets[1] + 10.0 * (targets[0] + 1.0)])


@dataclass
class Pair(Hardware):
    """A finger with a thumb bolted to it, which ignores its own target."""

    joints: tuple[str, ...] = ("thumb_left", "finger_left")
    positions: Array = field(default_factory=lambda: np.zeros(2))

    def command(self, targets: Any) -> None:
        self.positions = np.array([targets[1], targets[1]])


@dataclass
class Slow(Hardware):
    """Hardware that can be read twenty times a second."""

    pause: float = 0.05


def make(kind: type[Hardware], **more: Any) -> Any:
    return lambda _config: kind(**more)


def failing_maker(_config: RobotConfig) -> Any:
    raise OSError("no such bus")


@pytest.mark.parametrize(
    ("maker", "expected"),
    [
        (make(Hardware), None),
        (make(Pair), None),
        (failing_maker, "the driver cannot be made: OSError: no such bus"),
        (lambda _config: object(), "the driver has no method command"),
        (make(Hardware, joints=("arm",)), "unknown joint 'arm'"),
        (make(Stiff), "lift did not move by 0.02 within 0.2 s"),
        (make(Coupled), "lift moved together with elbow_left"),
        (make(Slow), "must work 100 times"),
    ],
)
def test_check_driver_reports_each_defect(config: RobotConfig, maker: Any, expected: str | None, clock: Clock) -> None:
    problems = check_driver(lambda config: clock.watched(maker(config)), config, within=0.2)
    if expected is None:
        assert problems == []
    else:
        assert any(expected in problem for problem in problems), problems


@pytest.mark.parametrize(("upper", "begin"), [(0.015, 0.0), (0.015, 0.006), (0.015, 0.015), (0.03, 0.015), (0.0, 0.0)])
def test_check_driver_keeps_joints_within_limits(config: RobotConfig, upper: float, begin: float, clock: Clock) -> None:
    joints = tuple(
        replace(joint, limits=replace(joint.limits, lower=0.0, upper=upper)) if joint.name == "finger_left" else joint
        for joint in config.robot.joints
    )
    hardware = Hardware(joints=("finger_left",), positions=np.array([begin]))
    narrow = replace(config, robot=replace(config.robot, joints=joints))
    hardware.read = lambda: JointArrays(hardware.positions, np.zeros(1), np.zeros(1))  # type: ignore[method-assign]
    assert check_driver(lambda _config: clock.watched(hardware), narrow) == []
    assert len(hardware.targets) == (2 if upper > 0.0 else 0)
    assert all(0.0 <= position <= upper for (position,) in hardware.targets), hardware.targets


def test_hardware_joints_exist_in_robot(config: RobotConfig) -> None:
    assert set(NAMES) <= set(config.robot.joint_indices)
