"""The base's buttons, in each of its modes, at a real base."""

import math
from dataclasses import replace

import pytest

from cellwright.clients.operators.orders import MoveBase
from cellwright.middleware.messages.build import floats
from cellwright.robot.base import MODE, Mode
from cellwright.robot.node import RobotNode
from cellwright.viewer.web.operator.drive import DIRECTIONS, RATE, SPEED, TURNING, directions, numbers
from cellwright.viewer.web.operator.messages import message
from tests.robot.robots import two_arms


@pytest.mark.parametrize("mode", list(Mode))
def test_a_button_that_is_held_for_a_second(mode: Mode) -> None:
    node = RobotNode(replace(two_arms(), others={MODE: mode.value}))
    assert node.base.mode is mode
    for direction in directions(mode):
        turn, x, y = DIRECTIONS[direction]
        node.simulation.reset()
        before = node.base.pose
        for beat in range(round(RATE)):
            topic, said = message(MoveBase(numbers(mode, direction)), 0)
            node.bus.publish(topic, said, node="/me")
            node.simulation.step_until(round((beat + 1) / RATE * 1e9))
        moved = before.inverse() @ node.base.pose
        assert moved.position == pytest.approx((x * SPEED, y * SPEED, 0.0), abs=0.01)
        assert moved.yaw == pytest.approx(turn * TURNING, abs=0.01)
        still = node.base.pose
        node.simulation.step_until(node.simulation.now + 400_000_000)
        assert math.dist(node.base.pose.position, still.position) < SPEED * 0.25, "when let go of, it comes to rest"


def test_the_original_goes_sideways_only() -> None:
    assert "forward" not in directions(Mode.ORIGINAL)
    assert set(directions(Mode.VELOCITY)) == set(DIRECTIONS)
    assert floats(numbers(Mode.ORIGINAL, "left")).shape == (2,)
