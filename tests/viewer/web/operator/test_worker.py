"""Operator at a real node in real time: hands reach their targets, a stop gets through, and a node may end."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from cellwright.clients.operators.robot import Ask
from cellwright.robot.node import RobotNode, RobotSettings
from cellwright.robot.safety import SafetySettings
from cellwright.util.pose import Pose
from cellwright.viewer.web.operator.command_queue import CommandQueue
from cellwright.viewer.web.operator.robot_state import RobotState, rotation_angle
from cellwright.viewer.web.operator.worker import NODE, Worker
from tests.clients.operators.nodes import robot
from tests.support.waiting import wait_until
from tests.viewer.web.operator.robots import number, served

ME = 1
ELBOW = number("right_3")


@pytest.fixture
def node() -> Iterator[RobotNode]:
    node = RobotNode(robot(), RobotSettings(safety=SafetySettings(one_commander=0.5)))
    yield node
    node.close()


def at_work(worker: Worker) -> CommandQueue:
    """Command queue, once the robot's state is known."""
    worker.start()
    wait_until(lambda: worker.queue is not None and worker.queue.is_at_rest, "robot at rest")
    assert worker.queue is not None
    return worker.queue


def current_state(queue: CommandQueue) -> RobotState:
    assert queue.state is not None
    return queue.state


@pytest.mark.slow
def test_dragged_hand_reaches_target_and_other_stays(node: RobotNode) -> None:
    with served(node) as address:
        worker = Worker(address)
        queue = at_work(worker)
        right, left = current_state(queue).tips
        world_T_aim = Pose((-0.06, 0.03, 0.05)) @ right
        assert queue.grab(0, ME, right)
        for share in np.linspace(0.0, 1.0, 20):
            x, y, z = np.add(right.position, share * np.subtract(world_T_aim.position, right.position)).tolist()
            queue.drag(0, ME, Pose((x, y, z), right.quaternion))
        wait_until(
            lambda: math.dist(current_state(queue).tips[0].position, world_T_aim.position) < 1e-3, "end of the motion"
        )
        assert rotation_angle(current_state(queue).tips[0], right) < 0.01
        assert math.dist(current_state(queue).tips[1].position, left.position) < 2e-3
        assert NODE in current_state(queue).commander
        wait_until(lambda: queue.delay.seconds is not None, "figure of the delay")
        queue.release(0, ME)
        taken = current_state(queue).taken
        wait_until(lambda: current_state(queue).commander == "", "silence of the hand")
        assert current_state(queue).taken <= taken + 1, "what is let go of says nothing"
        worker.close()


def test_worker_sends_sliders_grippers_stop_and_home(node: RobotNode) -> None:
    with served(node) as address:
        worker = Worker(address)
        queue = at_work(worker)
        queue.slide(ELBOW, -0.9)
        wait_until(lambda: abs((current_state(queue).positions[ELBOW] or 0.0) + 0.9) < 2e-3, "elbow at its target")
        queue.grip(1, 0.5)
        wait_until(lambda: abs(current_state(queue).grippers[1] - 0.5) < 0.05, "gripper at its target")
        assert current_state(queue).grippers[0] < 0.05

        queue.slide(ELBOW, 1.5)
        assert worker.stop() == ""
        wait_until(lambda: current_state(queue).is_stopped, "emergency stop")
        assert (current_state(queue).positions[ELBOW] or 0.0) < 0.5, "it comes before all else"
        assert not queue.slide(ELBOW, 1.5)
        queue.ask(Ask.CLEAR_STOP)
        wait_until(lambda: not current_state(queue).is_stopped, "end of the emergency stop")

        queue.ask(Ask.HOME)
        wait_until(lambda: abs((current_state(queue).positions[ELBOW] or 0.0) + 1.2) < 2e-3, "elbow at home")
        wait_until(lambda: "home: done" in queue.notes.text, "answer to the way home")
        worker.close()
    assert worker.queue is not None


def test_refusal_ends_drag_with_reason(node: RobotNode) -> None:
    with served(node) as address:
        first, second = Worker(address), Worker(address)
        second._link.node = "/other_browser"
        one, other = at_work(first), at_work(second)
        for queue in (one, other):
            tip = current_state(queue).tips[0]
            assert queue.grab(0, ME, tip)
            queue.drag(0, ME, Pose((0.0, 0.0, 0.01)) @ tip)
            wait_until(lambda queue=queue: current_state(queue).taken > 0, "command that was taken")  # type: ignore[misc]
        wait_until(lambda: f"{NODE} commands this topic" in other.notes.text, "reason of the refusal")
        assert not other.hands.holds
        wait_until(lambda: current_state(other).refused > 0, "count of the refusal")
        first.close()
        second.close()


def test_worker_reconnects_and_keeps_stop(node: RobotNode) -> None:
    with served(node) as address:
        worker = Worker(address)
        queue = at_work(worker)
        queue.slide(ELBOW, 1.0)
    wait_until(lambda: queue.state is None, "notice that the robot is gone")
    assert "not delivered yet" in worker.stop()
    assert "not delivered yet" in queue.notes.text
    other = RobotNode(robot())
    with served(other, port=address[1]):
        wait_until(lambda: other.commander.is_stopped, "emergency stop of the other robot")
        wait_until(lambda: worker.queue is queue and queue.state is not None, "robot that is back")
        assert queue.due() == []
        worker.close()
    other.close()
