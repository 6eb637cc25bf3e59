"""A user's driver: its targets, its readings, and its failures."""

import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cellwright.config.robot.config import RobotConfig
from cellwright.robot.drivers import DriverError, LiveDriver
from cellwright.robot.node import RobotNode, RobotSettings
from cellwright.robot.safety import SafetySettings
from cellwright.robot.servos import Array, JointArrays
from cellwright.util.errors import DescriptionError, UnknownNameError
from tests.robot.robots import two_arms
from tests.robot.talk import Talk
from tests.support.waiting import wait_until

pytestmark = pytest.mark.usefixtures("patient")

NAMES = ("elbow_left", "lift")  # some of the joints, in another order


@dataclass
class Hardware:
    """Robot that is at its targets at once, and fails as a test requests."""

    joints: tuple[str, ...] = NAMES
    positions: Array = field(default_factory=lambda: np.array([-1.0, 0.2]))
    targets: list[list[float]] = field(default_factory=list)
    closed: int = 0
    on_read: Callable[[], object] = lambda: None
    answer: object = None

    def command(self, targets: Array) -> None:
        self.positions = targets
        self.targets.append(targets.tolist())

    def read(self) -> Any:
        self.on_read()
        if self.answer is not None:
            return self.answer
        return JointArrays(self.positions, np.array([0.1, 0.2]), np.array([3.0, 4.0]))

    def close(self) -> None:
        self.closed += 1


def until(condition: Callable[[], object]) -> None:
    """Wait for the thread of a driver."""
    wait_until(condition, "effect of the driver's thread")


def step_until(node: RobotNode, condition: Callable[[], object]) -> None:
    """Step a node until a condition holds; the thread of its driver gets time between the steps."""

    def stepped() -> object:
        node.simulation.step()
        return condition()

    until(stepped)


def fail() -> None:
    raise OSError("the cable is\nout")


def give_up() -> None:
    sys.exit("no bus")  # as vendors' programs do


class OwnError(BaseException):
    """Exception that `except Exception` does not catch."""


def escape() -> None:
    raise OwnError("gone")


@pytest.fixture(scope="module")
def config() -> RobotConfig:
    return two_arms()


def test_targets_and_readings_are_mapped_by_joint_name(config: RobotConfig) -> None:
    hardware = Hardware()
    live = LiveDriver(config, hardware)
    assert live.joints == tuple(joint.name for joint in config.robot.driven)
    elbow, lift = (live.joints.index(name) for name in NAMES)
    positions, velocities, efforts = live.read()
    assert (positions[elbow], positions[lift]) == (-1.0, 0.2)
    assert (velocities[elbow], velocities[lift], efforts[elbow], efforts[lift]) == (0.1, 0.2, 3.0, 4.0)
    assert positions[live.joints.index("shoulder_right")] == 0.5  # without a driver: it keeps its initial position
    targets = np.zeros(len(live.joints))
    targets[[elbow, lift]] = -0.5, 0.3
    live.command(targets)
    until(lambda: live.read().positions[elbow] == -0.5)
    assert hardware.targets == [[-0.5, 0.3]]
    assert not live.fault
    live.close()
    until(lambda: hardware.closed)  # where the thread is late, `close` does not wait for it
    assert hardware.closed == 1


@pytest.mark.parametrize(
    ("hardware", "reason"),
    [
        (Hardware(joints=("elbow",)), "unknown joint 'elbow'; did you mean elbow_"),
        (Hardware(joints=()), "must not be empty"),
        (Hardware(joints=("lift", "lift")), "repeat a name"),
        (Hardware(on_read=fail), "OSError: the cable is out"),
        (Hardware(positions=np.array([np.nan, 0.0])), "positions of elbow_left must be finite"),
        (Hardware(positions=np.zeros(3)), "used: positions must have 2 numbers, one a joint .got 3."),
        (Hardware(on_read=give_up), "SystemExit: no bus"),
        (Hardware(on_read=escape), "OwnError: gone"),
        (Hardware(answer=[0.0, 0.0]), "return positions, velocities and efforts .got a list of 2."),
        (Hardware(answer=dict.fromkeys((*NAMES, "waist"), 0.0)), "got a dict of 3"),
        (Hardware(answer=0.5), "got a float"),
        (Hardware(answer=(0.0, 0.0, 0.0)), "each with one number a joint .got a float for positions."),
        (Hardware(answer=(np.zeros(2), {}, np.zeros(2))), "got a dict of 0 for velocities"),
    ],
)
def test_unusable_driver_is_refused_and_closed(config: RobotConfig, hardware: Hardware, reason: str) -> None:
    with pytest.raises(DriverError, match=reason):
        LiveDriver(config, hardware)
    until(lambda: hardware.closed)  # where the thread is late, the constructor does not wait for it
    assert hardware.closed == 1


def test_failed_node_closes_its_driver(config: RobotConfig) -> None:
    hardware = Hardware()
    with pytest.raises(UnknownNameError, match="tail"):
        RobotNode(config, RobotSettings(safety=SafetySettings(max_speeds=(("tail", 1.0),))), driver=hardware)
    until(lambda: hardware.closed)
    assert hardware.closed == 1
    wheel, *others = config.robot.joints
    twice = replace(config, robot=replace(config.robot, joints=(replace(wheel, name="lift"), *others)))
    with pytest.raises(DescriptionError):
        RobotNode(twice, driver=(hardware := Hardware()))
    until(lambda: hardware.closed)
    assert hardware.closed == 1


@pytest.mark.parametrize(
    ("failure", "reason"),
    [(fail, "OSError: the cable is out"), (give_up, "SystemExit: no bus"), (escape, "OwnError: gone")],
)
def test_failed_driver_holds_robot_until_cleared(config: RobotConfig, failure: Callable[[], None], reason: str) -> None:
    hardware = Hardware()
    live = LiveDriver(config, hardware)
    number = live.joints.index("lift")
    hardware.on_read = failure
    until(lambda: live.fault)
    assert live.fault == reason
    until(lambda: hardware.targets)
    assert hardware.targets == [[-1.0, 0.2]]  # the newest reading
    live.command(np.full(len(live.joints), 0.3))
    hardware.on_read = lambda: None
    before = live.count
    until(lambda: live.read() and live.count > before + 2)
    assert hardware.targets == [[-1.0, 0.2]], "a target reached the failed driver"
    live.clear()
    assert not live.fault
    assert live.read().positions[number] == 0.2
    live.close()


def test_failed_hold_is_sent_again(config: RobotConfig) -> None:
    @dataclass
    class Loose(Hardware):
        """A robot whose cable is out for its first three targets."""

        refused: int = 0

        def command(self, targets: Array) -> None:
            if self.refused < 3:
                self.refused += 1
                fail()
            super().command(targets)

    hardware = Loose()
    live = LiveDriver(config, hardware)
    live.command(np.full(len(live.joints), 0.3))
    until(lambda: live.read() and hardware.targets)
    assert live.fault == "OSError: the cable is out"
    before = live.count
    until(lambda: live.read() and live.count > before + 2)
    assert hardware.targets == [[-1.0, 0.2]]
    live.close()


def test_close_does_not_wait_for_stuck_driver(config: RobotConfig) -> None:
    hardware = Hardware()
    live = LiveDriver(config, hardware, timeout=0.05)
    stuck, free = threading.Event(), threading.Event()

    def stick() -> None:
        stuck.set()
        free.wait()

    hardware.on_read = stick
    until(stuck.is_set)  # a slow machine is silent that long anyway
    until(lambda: live.fault)
    assert live.fault == "no reading for 0.05 s"
    live.close()
    assert not hardware.closed, "close waited for the driver"
    free.set()
    until(lambda: hardware.closed)


def test_time_in_which_process_stands_still_is_no_silence_of_driver(
    config: RobotConfig, monkeypatch: pytest.MonkeyPatch
) -> None:
    free = threading.Event()
    hardware = Hardware(on_read=lambda: next(looks) and free.wait())
    looks = iter([0, 1])  # the first reading works
    now = 100.0
    monkeypatch.setattr("cellwright.robot.drivers.time", SimpleNamespace(monotonic=lambda: now))
    live = LiveDriver(config, hardware, timeout=0.5)
    found = []
    for passed in (0.0, 30.0, 0.09, 0.09, 0.09, 0.09, 0.09):  # [s]
        now += passed
        found.append(live.fault)
    assert found == [""] * 6 + ["no reading for 0.5 s"]
    hardware.on_read = lambda: None
    free.set()
    live.close()


def test_node_drives_hardware_and_mirrors_it_until_failure(config: RobotConfig) -> None:
    hardware, lines = Hardware(), list[str]()
    node = RobotNode(config, driver=hardware, report=lines.append)
    lift = node.simulation.model.joint("lift").qposadr[0]
    assert node.simulation.data.qpos[lift] == 0.2
    number = node.commander.numbers["lift"]
    node.commander.set_targets([number], [0.35])
    step_until(node, lambda: node.simulation.data.qpos[lift] == 0.35)
    assert hardware.targets == [[-1.0, 0.35]]

    hardware.on_read = fail
    step_until(node, lambda: lines)
    fault = "the driver has failed, the robot holds: OSError: the cable is out"
    assert lines == [f"{fault}; call /io_teleop/clear_emergency_stop to clear it"]
    node.commander.set_targets([number], [0.1])
    for _ in range(3):
        node.simulation.step()
    assert lines == lines[:1]
    assert node.commander.limiter.desired[number] == 0.35, "the target changed while the driver had failed"
    assert all(each == [-1.0, 0.35] for each in hardware.targets)
    node.close()
    until(lambda: hardware.closed)
    assert hardware.closed == 1


def test_joints_moved_by_hand_before_first_target_stay(config: RobotConfig) -> None:
    hardware = Hardware()
    talk = Talk(config, driver=hardware)
    lift = talk.node.commander.numbers["lift"]
    hardware.positions = np.array([-1.6, 0.25])
    step_until(talk.node, lambda: talk.node.driver.read().positions[lift] == 0.25)
    talk.steps(2)
    talk.joints({"lift": 0.3})
    step_until(talk.node, lambda: hardware.targets)
    assert hardware.targets == [[-1.6, 0.3]], "the elbow jumps without a command"
    hardware.positions = np.array([-1.5, 0.3])  # pushed: now it is held at its target
    step_until(talk.node, lambda: talk.node.driver.read().positions[lift] == 0.3)
    talk.steps(2)
    talk.joints({"lift": 0.2})
    step_until(talk.node, lambda: hardware.targets[-1][1] == 0.2)
    assert hardware.targets[-1] == [-1.6, 0.2]
    talk.node.close()


def test_cleared_failure_resumes_from_current_posture(config: RobotConfig) -> None:
    hardware = Hardware()
    talk = Talk(config, driver=hardware)
    hardware.on_read = fail

    def count() -> int:
        return sum(line.startswith("the driver has failed") for line in talk.lines)

    step_until(talk.node, lambda: count() == 1)
    until(lambda: hardware.targets)
    hardware.targets.clear()
    assert talk.clear().success
    step_until(talk.node, lambda: count() == 2)  # nothing has changed
    until(lambda: hardware.targets)  # held again

    hardware.on_read = lambda: None
    lift = talk.node.commander.numbers["lift"]

    def moved_by_hand() -> bool:
        """Once is not enough: the command to hold the old posture may still be on its way."""
        hardware.positions = np.array([-1.6, 0.25])
        return bool(talk.node.driver.read().positions[lift] == 0.25)

    step_until(talk.node, moved_by_hand)
    hardware.targets.clear()
    assert talk.clear().success
    talk.joints({"lift": 0.3})
    step_until(talk.node, lambda: hardware.targets and hardware.targets[-1][1] == 0.3)
    assert all(elbow == -1.6 for elbow, _ in hardware.targets), "the elbow jumped"
    talk.node.close()
