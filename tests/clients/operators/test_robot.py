"""A robot's node as its operator sees it, over the topics of a whole node and of another vendor's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from cellwright.clients.client.in_process import InProcess
from cellwright.clients.client.session import NodeClient
from cellwright.clients.operators import exercise
from cellwright.clients.operators.exercise import Wave, WaveShape
from cellwright.clients.operators.robot import (
    JOINT_COMMAND,
    JointLimits,
    MoveGrippers,
    MoveJoints,
    MoveTips,
    Now,
    OperatedRobot,
)
from cellwright.middleware.messages.cellwright_msgs import TeleopStatus
from cellwright.middleware.messages.conversions import joint_state, nanoseconds
from cellwright.robot.node import RobotNode
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose
from tests.clients.operators.nodes import robot


class MinimalTransport:
    """A transport to another vendor's node: a test sets its messages, and time passes on request."""

    def __init__(self, states: list[Any]) -> None:
        self.states = states
        self.time = 0
        self.callbacks: dict[str, Callable[[Any], None]] = {}
        self.published: list[tuple[str, Any]] = []

    knows_all_topics = True

    def topics(self) -> dict[str, str]:
        return {}

    def now(self) -> int:
        return self.time

    def advance(self, until: int | None, finished: Callable[[], bool] | None = None) -> None:
        self.time = self.time + 10_000_000_000 if until is None else until
        while self.states:
            self.callbacks["/io_teleop/joint_states"](self.states.pop(0))
            if finished is not None and finished():
                return

    def subscribe(self, topic: str, callback: Callable[[Any], None], *, passive: bool = False) -> Callable[[], None]:
        self.callbacks[topic] = callback
        return lambda: None

    def publish(self, topic: str, message: Any) -> None:
        self.published.append((topic, message))

    def call(self, service: str, request: Any) -> Any:
        raise NotImplementedError

    def close(self) -> None:
        pass


@pytest.fixture(scope="module")
def node() -> RobotNode:
    return RobotNode(robot(), stamp=lambda: 5_000_000_000)


@pytest.fixture
def operated(node: RobotNode) -> OperatedRobot:
    node.simulation.reset()
    return OperatedRobot(NodeClient(InProcess(node, node="/operator")))


def test_operated_robot_has_state_published_by_node(operated: OperatedRobot) -> None:
    assert operated.joints[:3] == ("right_1", "right_2", "right_3")
    assert operated.positions["right_2"] == pytest.approx(0.6)
    assert operated.applied["right_2"] == pytest.approx(0.6)
    operated.session.sleep(0.1)
    assert len(operated.grippers) == len(operated.tips) == 2
    assert operated.tips[0].position[1] == pytest.approx(-0.3, abs=1e-6)
    assert operated.status.enabled
    assert operated.why_not() == ""


@pytest.mark.slow
def test_joints_grippers_and_tips_move_to_sent_targets(operated: OperatedRobot) -> None:
    operated.session.sleep(0.05)
    right = operated.tips[0]
    x, y, z = right.position
    operated.send(MoveJoints({"left_1": 0.2}))
    operated.send(MoveGrippers((1.0, 0.5)))
    operated.session.sleep(0.8)
    assert operated.positions["left_1"] == pytest.approx(0.2, abs=0.01)
    assert operated.grippers == pytest.approx((1.0, 0.5), abs=0.05)
    operated.send(MoveTips((Pose((x, y, z + 0.03), right.quaternion), operated.tips[1])))
    operated.session.sleep(1.0)
    assert operated.tips[0].position == pytest.approx((x, y, z + 0.03), abs=0.005)
    assert operated.sent == 3


def test_why_not_after_emergency_stop_names_it(operated: OperatedRobot) -> None:
    operated.send(Now.STOP)
    operated.session.sleep(0.3)
    assert operated.why_not() == "the emergency stop is active"


@pytest.mark.parametrize(
    ("status", "reason", "word"),
    [
        (TeleopStatus(), "", ""),
        (TeleopStatus(enabled=False), "it is not enabled", "enable"),
        (TeleopStatus(resetting=True), "it is moving home", ""),
        (TeleopStatus(enabled=False, emergency_stop=True), "the emergency stop is active", "clear-stop"),
    ],
)
def test_status_gives_reason_for_refused_commands(status: TeleopStatus, reason: str, word: str) -> None:
    transport = MinimalTransport([joint_state(["head"], [0.1], time=0)])
    operated = OperatedRobot(NodeClient(transport))
    transport.callbacks["/io_teleop/status"](status)
    assert operated.why_not() == reason
    if not reason:
        operated.check_ready()
        return
    with pytest.raises(UsageError) as caught:
        operated.check_ready()
    assert str(caught.value).startswith(f"the robot takes no commands: {reason}")
    assert str(caught.value).endswith(f"cellwright operate call {word}" if word else reason)


def test_node_with_joint_states_only_is_operated() -> None:
    transport = MinimalTransport([joint_state(["head", "elbow", "wrist"], [0.1, float("nan")], time=0)])
    operated = OperatedRobot(NodeClient(transport))
    assert operated.joints == ("head", "elbow", "wrist")
    assert operated.positions == {"head": 0.1}
    assert operated.position("head") == 0.1
    for strange in ("elbow", "wrist"):
        with pytest.raises(UsageError, match=f"the node publishes no position of {strange}"):
            operated.position(strange)
        with pytest.raises(UsageError, match="publishes no position"):
            exercise.check_signal(operated, [strange], Wave(WaveShape.SINE, 0.1, 1.0, 1), JointLimits())
    assert (operated.applied, operated.grippers, operated.tips) == ({}, (), ())
    assert (operated.status, operated.why_not()) == (None, "")


def test_silent_node_is_refused() -> None:
    with pytest.raises(UsageError, match="no messages on /io_teleop/joint_states"):
        OperatedRobot(NodeClient(MinimalTransport([])))


def test_commands_are_stamped_with_time_of_node() -> None:
    transport = MinimalTransport([joint_state(["head"], [0.1], time=7_000_000_000_000)])
    operated = OperatedRobot(NodeClient(transport))
    operated.send(MoveJoints({"head": 0.2}))
    transport.time += 3_000_000
    operated.send(MoveJoints({"head": 0.2}))
    transport.callbacks["/io_teleop/joint_states"](joint_state(["head"], [0.1], time=6_999_000_000_000))
    operated.send(MoveJoints({"head": 0.2}))
    stamps = [nanoseconds(message.header.stamp) for topic, message in transport.published if topic == JOINT_COMMAND]
    assert stamps[:2] == [7_000_000_000_000, 7_000_003_000_000]
    assert stamps == sorted(stamps)
