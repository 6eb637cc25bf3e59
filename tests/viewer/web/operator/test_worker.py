"""The operator at a real node in real time: hands get where they are put, a stop gets through, and a node may go."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from cellwright.operators.orders import Ask
from cellwright.pose import Pose
from cellwright.teleop.node import RobotNode
from cellwright.teleop.safety.settings import SafetySettings
from cellwright.viewer.web.operator.desk import Desk
from cellwright.viewer.web.operator.reach import angle
from cellwright.viewer.web.operator.robot import Standing
from cellwright.viewer.web.operator.worker import NODE, Worker
from tests.operators.nodes import robot
from tests.viewer.web.operator.robots import number, served, wait_for

ME = 1
ELBOW = number("right_3")


@pytest.fixture
def node() -> Iterator[RobotNode]:
    node = RobotNode(robot(), safety=SafetySettings(one_commander=0.5))
    yield node
    node.close()


def at_work(worker: Worker) -> Desk:
    """Its desk, once the robot has told how it stands."""
    worker.start()
    wait_for(lambda: worker.desk is not None and worker.desk.is_at_rest, "no robot is heard of that rests")
    assert worker.desk is not None
    return worker.desk


def stands(desk: Desk) -> Standing:
    assert desk.standing is not None
    return desk.standing


def test_a_dragged_hand_gets_there_and_the_other_one_stays(node: RobotNode) -> None:
    with served(node) as address:
        worker = Worker(address)
        desk = at_work(worker)
        right, left = stands(desk).tips
        world_T_aim = Pose((-0.06, 0.03, 0.05)) @ right
        assert desk.grab(0, ME, right)
        for share in np.linspace(0.0, 1.0, 20):
            x, y, z = np.add(right.position, share * np.subtract(world_T_aim.position, right.position)).tolist()
            desk.drag(0, ME, Pose((x, y, z), right.quaternion))
        wait_for(lambda: math.dist(stands(desk).tips[0].position, world_T_aim.position) < 1e-3, "it does not get there")
        assert angle(stands(desk).tips[0], right) < 0.01
        assert math.dist(stands(desk).tips[1].position, left.position) < 2e-3
        assert NODE in stands(desk).commander
        wait_for(lambda: desk.delay.seconds is not None, "its delay is not known")
        desk.release(0, ME)
        taken = stands(desk).taken
        wait_for(lambda: stands(desk).commander == "", "it is still heard from")
        assert stands(desk).taken <= taken + 1, "what is let go of says nothing"
        worker.close()


def test_sliders_grippers_stop_and_home(node: RobotNode) -> None:
    with served(node) as address:
        worker = Worker(address)
        desk = at_work(worker)
        desk.slide(ELBOW, -0.9)
        wait_for(lambda: abs((stands(desk).positions[ELBOW] or 0.0) + 0.9) < 2e-3, "the elbow does not get there")
        desk.grip(1, 0.5)
        wait_for(lambda: abs(stands(desk).grippers[1] - 0.5) < 0.05, "the gripper does not get there")
        assert stands(desk).grippers[0] < 0.05

        desk.slide(ELBOW, 1.5)
        assert worker.stop() == ""
        wait_for(lambda: stands(desk).is_stopped, "the stop does not get through")
        assert (stands(desk).positions[ELBOW] or 0.0) < 0.5, "it comes before all else"
        assert not desk.slide(ELBOW, 1.5)
        desk.ask(Ask.CLEAR_STOP)
        wait_for(lambda: not stands(desk).is_stopped, "the stop is not cleared")

        desk.ask(Ask.HOME)
        wait_for(lambda: abs((stands(desk).positions[ELBOW] or 0.0) + 1.2) < 2e-3, "it does not go home")
        wait_for(lambda: "home: done" in desk.notes.text, "nobody says that it is there")
        worker.close()
    assert worker.desk is not None


def test_a_refusal_says_why_and_ends_the_drag(node: RobotNode) -> None:
    with served(node) as address:
        first, second = Worker(address), Worker(address)
        second._link.node = "/other_browser"
        one, other = at_work(first), at_work(second)
        for desk in (one, other):
            tip = stands(desk).tips[0]
            assert desk.grab(0, ME, tip)
            desk.drag(0, ME, Pose((0.0, 0.0, 0.01)) @ tip)
            wait_for(lambda desk=desk: stands(desk).taken > 0, "nothing was taken")  # type: ignore[misc]
        wait_for(lambda: f"{NODE} commands here" in other.notes.text, "nobody says why")
        assert not other.hands.is_held(0)
        wait_for(lambda: stands(other).refused > 0, "it is not counted")
        first.close()
        second.close()


def test_it_finds_its_way_back_and_a_stop_is_not_lost(node: RobotNode) -> None:
    with served(node) as address:
        worker = Worker(address)
        desk = at_work(worker)
        desk.slide(ELBOW, 1.0)
    wait_for(lambda: desk.standing is None, "it has not noticed")
    assert "not got through yet" in worker.stop()
    assert "not got through yet" in desk.notes.text
    other = RobotNode(robot())
    with served(other, port=address[1]):
        wait_for(lambda: other.commander.is_stopped, "the stop has not got through")
        wait_for(lambda: worker.desk is desk and desk.standing is not None, "it has not come back")
        assert desk.due() == []
        worker.close()
    other.close()
