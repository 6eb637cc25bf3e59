"""Cost of a socket, with few messages."""

import pytest

from benchmarks import socket
from benchmarks.costs import lesson_cell
from cellwright.clients.client import ARM_JOINTS
from cellwright.middleware.messages.conversions import joint_trajectory, trajectory_point
from tests.support.quick_children import QUICK_SERVING


@QUICK_SERVING
@pytest.mark.slow
def test_socket_quick_run_yields_figures_without_loss(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "lockstep", lambda _until: iter(()))  # it is a run of the command, tested with that
    progress: list[str] = []
    figures = {figure.label: figure for figure in socket.measure(progress.append, quick=True)}
    assert len(progress) == 4
    for label in ("a service call", "a command, until it is answered", "a goal, until its status comes"):
        assert figures[label].value > 0.0
    lost = [figure for label, figure in figures.items() if label.endswith("lost")]
    assert [(figure.value, figure.maximum) for figure in lost] == [(0, 0.0)]
    assert 0.0 < figures["real time, with a subscriber"].value < 1.5


def test_tick_without_listener_is_timed() -> None:
    cost, received = socket.ticks_with(None, 20)
    assert cost > 0.0
    assert received == 0


def test_goal_message_is_accepted_by_arm() -> None:
    way = joint_trajectory(ARM_JOINTS, [trajectory_point((0.0,) * 7, time_from_start=10**9)])
    goal = socket.goal_message(way, "a goal")
    cell = lesson_cell()
    progress: list[object] = []
    cell.bus.subscribe(f"{socket.FOLLOW}/result", progress.append)
    cell.bus.publish(f"{socket.FOLLOW}/goal", goal)
    assert progress == []  # not rejected
    assert cell.arm is not None
    assert cell.arm.controller.goal is not None
    assert cell.arm.controller.goal.goal_id == "a goal"


def test_times_figure_has_median_and_99_percent() -> None:
    figure = socket.times("waiting", 3, lambda index: None)
    assert (figure.label, figure.unit) == ("waiting", "ms")
    assert 0.0 <= figure.value < 1000.0
    assert figure.note.startswith("median; 99 % below ")
