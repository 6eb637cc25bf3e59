"""Recorded keys at a whole node: in this process, and over its socket for slow services."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import pytest
from rich.console import Console

from cellwright.clients.client.in_process import InProcess
from cellwright.clients.client.session import NodeClient
from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.clients.operators.keyboard import MAX_STEPS, Jog, Keyboard
from cellwright.clients.operators.robot import JointLimits, OperatedRobot, ServiceCaller
from cellwright.clients.operators.terminal import panel
from cellwright.robot.node import RobotNode
from cellwright.util.errors import RejectedCommandError
from tests.clients.operators.nodes import robot, served
from tests.support.waiting import wait_until

LIMITS = JointLimits.of(robot().robot)
RIGHT, LEFT, DOWN = "\x1b[C", "\x1b[D", "\x1b[B"


@pytest.fixture(scope="module")
def node() -> RobotNode:
    return RobotNode(robot())


@pytest.fixture
def operator(node: RobotNode) -> Keyboard:
    node.simulation.reset()
    operated = OperatedRobot(NodeClient(InProcess(node, node="/operator")))
    operated.session.sleep(0.15)
    return Keyboard(operated, Jog(operated, LIMITS), ServiceCaller(lambda: operated.session))


def typed(operator: Keyboard, *pieces: str, pause: float = 0.05) -> None:
    for piece in pieces:
        assert operator.take(piece)
        operator.robot.session.sleep(pause)


def shown(operator: Keyboard, *, width: int = 100, height: int = 30) -> str:
    console = Console(width=width, height=height, color_system=None, legacy_windows=False)
    picture = panel(operator.robot, operator.jog, LIMITS, name="two arms", message=operator.message, height=height)
    with console.capture() as captured:
        console.print(picture)
    return captured.get()


def test_keys_move_joint_without_jumps(operator: Keyboard) -> None:
    seen: list[float] = []
    operator.robot.session.subscribe(
        "/io_teleop/applied_joint_cmd", lambda message: seen.append(float(message.position[1]))
    )
    typed(operator, DOWN, "+", RIGHT, RIGHT, LEFT, RIGHT)
    operator.robot.session.sleep(0.3)
    assert operator.robot.positions["right_2"] == pytest.approx(0.7, abs=0.005)
    assert max(abs(after - before) for before, after in pairwise(seen)) <= 0.0501
    assert operator.robot.sent == 4


def test_keys_move_tip_and_gripper(operator: Keyboard) -> None:
    before = operator.robot.tips[1].position
    typed(operator, "t", "+", "z", "z", "y", "c", pause=0.1)
    operator.robot.session.sleep(1.0)
    after = operator.robot.tips[1].position
    assert [one - other for one, other in zip(after, before, strict=True)] == pytest.approx([0, 0.01, 0.02], abs=0.003)
    assert operator.robot.grippers == pytest.approx((0.0, 1.0), abs=0.03)


def test_emergency_stop_overtakes_earlier_keys(operator: Keyboard) -> None:
    typed(operator, RIGHT + RIGHT + " " + RIGHT, pause=0.2)
    assert operator.robot.positions["right_1"] == pytest.approx(0.0, abs=1e-6)
    assert operator.robot.status.emergency_stop
    assert "EMERGENCY STOP" in shown(operator)
    typed(operator, RIGHT)
    assert operator.message == "not sent: the emergency stop is active"


def test_queued_keys_beyond_maximum_are_dropped(operator: Keyboard) -> None:
    typed(operator, 100 * RIGHT, pause=0.5)
    assert operator.robot.sent == MAX_STEPS
    assert operator.robot.positions["right_1"] == pytest.approx(MAX_STEPS * 0.02, abs=0.002)
    assert "too fast for the robot" in operator.message


def test_refused_step_is_shown_and_next_starts_at_measured_position(
    operator: Keyboard, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_targets: object) -> None:
        raise RejectedCommandError("another commands here")

    with monkeypatch.context() as patch:
        patch.setattr(operator.robot, "send", refuse)
        typed(operator, RIGHT)
        assert operator.message == "another commands here"
    typed(operator, RIGHT, pause=0.4)
    assert operator.robot.positions["right_1"] == pytest.approx(0.02, abs=0.002)


def test_keyboard_runs_until_quit_key(operator: Keyboard) -> None:
    pieces, drawn = ["", RIGHT, "", "", "", "", "q", "never read"], 0

    def draw() -> None:
        nonlocal drawn
        drawn += 1

    operator.run(lambda: pieces.pop(0), draw)
    assert pieces == ["never read"]
    assert drawn == 2


def test_panel_shows_selected_joint_in_any_terminal_size(operator: Keyboard) -> None:
    typed(operator, "/", "left_5")
    text = shown(operator)
    assert "find: left_5" in text
    line = next(line for line in text.splitlines() if "left_5" in line and "▶" in line)
    assert line.split()[2:5] == ["0.400", "0.400", "-2.00"]
    assert "takes commands" in text
    assert "▶ right" in text
    for height in (5, 24, 60):
        lines = shown(operator, width=80, height=height).splitlines()
        assert len(lines) <= max(height, 18)
        assert any("▶" in line and "left_5" in line for line in lines)


@pytest.fixture
def far(node: RobotNode) -> Iterator[Keyboard]:
    """The same over a socket in lockstep: time passes while the operator waits. Services have their own connection."""
    node.simulation.reset()
    with served(node, lockstep=True) as address:
        session = NodeClient(SocketTransport(address, node="/operator"))
        operated = OperatedRobot(session)
        services = ServiceCaller(lambda: NodeClient(SocketTransport(address, node="/operator_services")))
        yield Keyboard(operated, Jog(operated, LIMITS), services)
        services.close()
        session.close()


def wait_for(operator: Keyboard, text: str) -> None:
    wait_until(
        lambda: text in operator.message,
        f"message {text!r}",
        seen=lambda: operator.message,
        between=lambda: typed(operator, "", pause=0.02),
    )


def test_service_call_does_not_block_keyboard(far: Keyboard) -> None:
    typed(far, "+", "+", RIGHT, RIGHT, pause=0.2)
    assert far.robot.positions["right_1"] > 0.15
    typed(far, "H")
    assert far.message in ("home …", "not sent: it is moving home")
    typed(far, "e", pause=0.0)
    assert far.message == "still waiting for: home"
    typed(far, " ", pause=0.2)  # while it is on its way
    assert far.robot.session.wait_until(lambda: far.robot.status.emergency_stop, 10.0)
    wait_for(far, "home: ")
    typed(far, "u")
    wait_for(far, "clear the emergency stop: done")
    typed(far, "d")
    wait_for(far, "disable: done")
    assert far.robot.session.wait_until(lambda: not far.robot.status.enabled, 10.0)
    typed(far, RIGHT)
    assert far.message == "not sent: it is not enabled"
