"""A test signal through a whole node, in this process: time is the simulation's."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from cellwright.clients.client.in_process import InProcess
from cellwright.clients.client.session import NodeClient
from cellwright.clients.operators.exercise import Wave, WaveShape, check_signal, exercise
from cellwright.clients.operators.robot import JointLimits, MoveJoints, OperatedRobot
from cellwright.robot.node import RobotNode
from cellwright.util.errors import RunEndedError, UnknownNameError, UsageError
from tests.clients.operators.nodes import robot

LIMITS = JointLimits.of(robot().robot)
SINE = Wave(WaveShape.SINE, 0.3, 1.0, 1)


@pytest.fixture(scope="module")
def node() -> RobotNode:
    return RobotNode(robot())


@pytest.fixture
def operated(node: RobotNode) -> OperatedRobot:
    node.simulation.reset()
    return OperatedRobot(NodeClient(InProcess(node, node="/operator")))


def test_sine_is_followed_with_lag_of_servo(operated: OperatedRobot) -> None:
    found = exercise(operated, "right_2", SINE)
    assert found.start == pytest.approx(0.6, abs=1e-6)
    figures = found.tracking
    assert figures.delay == pytest.approx(1 / 24, abs=0.008)  # a velocity servo of 24/s
    lag = math.atan(2 * math.pi / 24) / (2 * math.pi)
    assert figures.worst == pytest.approx(2 * 0.3 * math.sin(math.pi * lag), rel=0.15)
    assert figures.rate == pytest.approx(100.0, rel=0.01)
    assert found.note == ""
    assert found.trace.targets.min() == pytest.approx(0.3, abs=1e-3)
    assert found.trace.targets.max() == pytest.approx(0.9, abs=1e-3)
    assert operated.positions["right_2"] == pytest.approx(0.6, abs=1e-3)


def test_exercise_commands_only_named_joint(operated: OperatedRobot) -> None:
    before = operated.positions
    exercise(operated, "left_6", SINE)
    operated.session.sleep(0.5)
    assert operated.positions == pytest.approx(before, abs=0.01)


def test_step_figures_and_progress_are_reported(operated: OperatedRobot) -> None:
    seen: list[float] = []
    found = exercise(operated, "right_6", Wave(WaveShape.STEP, 0.2, 1.0, 1), on_progress=seen.append).tracking
    assert found.step is not None
    assert found.step.rise == pytest.approx(math.log(9) / 24, abs=0.02)
    assert found.step.overshoot < 0.01
    assert found.judged == found.step.rest < 0.001 < 0.19 < found.worst
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


def test_exercise_of_lost_robot_leaves_no_subscription(
    operated: OperatedRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The way back cannot be sent any more, and the other half of the clean-up happens all the same."""
    sent: list[float] = []

    def send(_robot: OperatedRobot, order: MoveJoints) -> None:
        sent.append(order.targets["right_1"])
        if len(sent) > 20:
            raise RunEndedError("the server has closed the connection")

    monkeypatch.setattr(OperatedRobot, "send", send)
    bus = operated.session.transport.cell.bus  # type: ignore[attr-defined]
    before = bus.topic("/io_teleop/joint_states").subscribers
    with pytest.raises(RunEndedError):
        exercise(operated, "right_1", SINE)
    assert len(sent) == 22
    assert bus.topic("/io_teleop/joint_states").subscribers == before


def test_node_that_limits_targets_is_reported(operated: OperatedRobot, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        OperatedRobot, "applied", property(lambda robot: {"right_1": min(robot.positions["right_1"], 0.1)})
    )
    note = exercise(operated, "right_1", Wave(WaveShape.RAMP, 0.3, 1.0, 1)).note
    assert note.startswith("sent 0 to 0.3, the node applied ")
    assert note.endswith("to 0.1: it limits the targets")


def test_signal_for_mimic_joint_is_refused(operated: OperatedRobot) -> None:
    limits = replace(LIMITS, leaders={"right_6": "right_5"})
    with pytest.raises(UsageError, match=r"^right_6 follows right_5 \(mimic\); test that one$"):
        check_signal(operated, ["right_6"], SINE, limits)


def test_signal_beyond_limits_is_refused_before_motion(operated: OperatedRobot) -> None:
    before = operated.positions
    with pytest.raises(UsageError, match=r"right_3: a sine of 1 from -2\.2 to -0\.2 leaves"):
        check_signal(operated, ["right_1", "right_3"], replace(SINE, amplitude=1.0), LIMITS)
    with pytest.raises(UsageError, match=r"; give a smaller --amplitude, or --wave step$"):
        check_signal(operated, ["right_3"], replace(SINE, amplitude=1.0), LIMITS)
    with pytest.raises(UsageError, match=r"; give a smaller --amplitude, or one of the other sign$"):
        check_signal(operated, ["right_3"], Wave(WaveShape.STEP, -1.0, 2.0, 1), LIMITS)
    check_signal(operated, ["right_3"], replace(SINE, amplitude=1.0), JointLimits())
    assert check_signal(operated, ["right_1"], SINE, LIMITS) == []
    assert check_signal(operated, ["right_1"], replace(SINE, frequency=2.0), LIMITS) == [
        "right_1: the signal is too fast for the joint (needs 3.77 a second, limit 3)"
    ]
    assert check_signal(operated, ["right_1"], Wave(WaveShape.STEP, 0.3, 2.0, 1), LIMITS) == []
    with pytest.raises(UnknownNameError, match="did you mean right_1"):
        check_signal(operated, ["rigth_1"], SINE, LIMITS)
    operated.session.sleep(0.1)
    assert operated.positions == before
