"""Targets of a file, played to a whole node in this process, and its recordings of itself."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cellwright.clients.client.in_process import InProcess
from cellwright.clients.client.session import NodeClient
from cellwright.clients.operators.playback import (
    JointRecorder,
    Targets,
    TargetSample,
    approach,
    check,
    play,
    read_targets,
)
from cellwright.clients.operators.robot import (
    GRIPPER_COMMAND,
    JOINT_COMMAND,
    JointLimits,
    MoveGrippers,
    MoveJoints,
    OperatedRobot,
)
from cellwright.robot.node import RobotNode
from cellwright.util.errors import RunEndedError, UnknownNameError, UsageError
from tests.clients.operators.nodes import robot

LIMITS = JointLimits.of(robot().robot)


@pytest.fixture(scope="module")
def node() -> RobotNode:
    return RobotNode(robot())


@pytest.fixture
def operated(node: RobotNode) -> OperatedRobot:
    node.simulation.reset()
    return OperatedRobot(NodeClient(InProcess(node, node="/operator")))


def targets(*samples: tuple[float, Mapping[str, float]], topic: str = JOINT_COMMAND) -> Targets:
    return Targets(Path("motion.csv"), tuple(TargetSample(time, topic, values) for time, values in samples))


def collected(operated: OperatedRobot, topic: str = JOINT_COMMAND) -> list[tuple[float, dict[str, float]]]:
    """Return a list that collects the messages on a topic from now on, with their times."""
    found: list[tuple[float, dict[str, float]]] = []

    def collect(message: object) -> None:
        names, positions = message.name, message.position  # type: ignore[attr-defined]
        found.append((operated.session.time, dict(zip(names, map(float, positions), strict=True))))

    operated.session.subscribe(topic, collect)
    return found


def test_approach_is_slow_and_starts_at_measured_position(operated: OperatedRobot) -> None:
    messages = collected(operated)
    begun = operated.session.time
    approach(operated, {"right_1": 1.0, "left_2": 0.5})
    positions = np.array([values["right_1"] for _, values in messages])
    speeds = np.diff(positions) / np.diff([time for time, _ in messages])
    assert abs(positions[0]) < 1e-3
    assert positions[-1] == 1.0
    assert speeds.min() >= 0.0
    assert 0.4 < speeds.max() <= 0.51
    assert operated.session.time - begun == pytest.approx(math.pi, abs=0.15)
    assert operated.positions["right_1"] == pytest.approx(1.0, abs=0.05)
    assert operated.positions["left_2"] == pytest.approx(0.5, abs=0.05)


def test_approach_of_robot_at_first_target_is_short(operated: OperatedRobot) -> None:
    begun = operated.session.time
    approach(operated, {"right_1": 0.0})
    assert operated.session.time - begun < 0.6
    approach(operated, {})
    assert operated.session.time - begun < 0.6


def test_approach_to_unreachable_target_is_refused(operated: OperatedRobot) -> None:
    with pytest.raises(UsageError, match=r"right_1 did not reach the first target: it is at 2, and the target is 2\.5"):
        approach(operated, {"right_1": 2.5}, 0.5)  # its limit is 2


@pytest.mark.parametrize("speed", [1.0, 0.5, 4.0])
def test_play_sends_targets_on_time_at_given_speed(speed: float, operated: OperatedRobot) -> None:
    messages, begun = collected(operated), operated.session.time
    samples = [(3.0 + 0.1 * number, {"right_1": 0.02 * number}) for number in range(6)]
    play(operated, targets(*samples), speed=speed)
    operated.session.sleep(0.02)
    assert [values for _, values in messages] == [values for _, values in samples]
    times = np.array([time - begun for time, _ in messages])
    assert times == pytest.approx(np.arange(6) * 0.1 / speed, abs=2.5 / 240)


def test_play_sends_only_newest_of_targets_due_at_once(operated: OperatedRobot) -> None:
    messages = collected(operated)
    crowd = [(0.0, {"right_1": 0.001 * number}) for number in range(50)]
    play(operated, targets(*crowd, (0.0, {"left_1": 0.1}), (0.1, {"right_1": 0.2})))
    operated.session.sleep(0.02)
    assert [values for _, values in messages] == [{"right_1": pytest.approx(0.049)}, {"left_1": 0.1}, {"right_1": 0.2}]


def test_play_sends_gripper_targets_as_gripper_command(
    operated: OperatedRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent: list[Any] = []
    monkeypatch.setattr(operated, "send", sent.append)
    play(operated, targets((0.0, {"gripper_right": 0.0, "gripper_left": 1.0}), topic=GRIPPER_COMMAND))
    assert sent == [MoveGrippers((0.0, 1.0))]


@pytest.mark.parametrize(
    ("sample", "error", "reason"),
    [
        ((0.0, {"rigth_1": 0.0}), UnknownNameError, "did you mean right_1"),
        ((0.0, {"right_1": 2.1}), UsageError, r"right_1: motion\.csv from 2\.1 to 2\.1 leaves its limits"),
    ],
)
def test_targets_unfit_for_robot_are_refused(
    sample: tuple[float, dict[str, float]], error: type[Exception], reason: str, operated: OperatedRobot
) -> None:
    with pytest.raises(error, match=reason):
        check(operated, targets(sample), LIMITS)


def test_targets_for_more_grippers_than_robot_has_are_refused(
    operated: OperatedRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(OperatedRobot, "grippers", property(lambda _robot: (0.0,)))
    two = targets((0.0, {"gripper_right": 0.0, "gripper_left": 1.0}), topic=GRIPPER_COMMAND)
    with pytest.raises(UsageError, match=r"has targets for 2 grippers .the robot has 1"):
        check(operated, two, LIMITS)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["motion.csv", "motion.jsonl"])
def test_recorded_motion_can_be_played_again(name: str, operated: OperatedRobot, tmp_path: Path) -> None:
    recorder = JointRecorder(operated, tmp_path / name)
    operated.send(MoveJoints({"right_1": 0.3, "left_4": -0.2}))
    operated.session.sleep(0.5)
    recorder.close()
    operated.session.sleep(0.1)
    found = read_targets(tmp_path / name)
    assert recorder.lines == len(found.samples) == pytest.approx(50, abs=2)
    assert recorder.time == pytest.approx(found.duration, abs=1e-5)
    assert set(found.first) == set(operated.joints)
    check(operated, found, LIMITS)
    assert found.samples[-1].values == pytest.approx(operated.positions, abs=1e-4)
    operated.send(MoveJoints({"right_1": 0.0, "left_4": 0.0}))
    operated.session.sleep(0.5)
    approach(operated, found.first, 0.2)
    play(operated, found)
    operated.session.sleep(0.3)
    assert operated.positions["right_1"] == pytest.approx(0.3, abs=0.01)
    assert operated.positions["left_4"] == pytest.approx(-0.2, abs=0.01)


def test_recorder_with_unwritable_file_is_refused(operated: OperatedRobot, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="cannot be written: No such file or directory"):
        JointRecorder(operated, tmp_path / "none" / "motion.csv")


def test_recorder_closes_file_after_node_is_gone(operated: OperatedRobot, tmp_path: Path) -> None:
    recorder = JointRecorder(operated, tmp_path / "motion.csv")
    operated.session.sleep(0.1)

    def leave() -> None:
        raise RunEndedError("the server has closed the connection")

    recorder._unsubscribe = leave
    recorder.close()
    assert len((tmp_path / "motion.csv").read_text().splitlines()) == recorder.lines + 1 > 5
    assert not recorder.is_writing
