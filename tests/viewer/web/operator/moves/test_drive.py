"""Buttons of the base, in each of its modes, at a real base."""

import math
from dataclasses import replace

import pytest

from cellwright.clients.operators.robot import MoveBase, command_message
from cellwright.config.robot.config import BaseMode
from cellwright.middleware.messages.conversions import floats
from cellwright.robot.base import MODE
from cellwright.robot.node import RobotNode
from cellwright.viewer.web.operator.moves import (
    BASE_DIRECTIONS,
    BASE_SPEED,
    BASE_TURN_SPEED,
    BUTTON_RATE,
    base_command,
    base_directions,
)
from tests.robot.robots import two_arms


@pytest.mark.parametrize("mode", list(BaseMode))
def test_held_base_button_moves_base_for_a_second(mode: BaseMode) -> None:
    node = RobotNode(replace(two_arms(), others={MODE: mode.value}))
    assert node.base.mode is mode
    for direction in base_directions(mode):
        turn, x, y = BASE_DIRECTIONS[direction]
        node.simulation.reset()
        before = node.base.pose
        for beat in range(round(BUTTON_RATE)):
            topic, message = command_message(MoveBase(base_command(mode, direction)), 0)
            node.bus.publish(topic, message, node="/me")
            node.simulation.step_until(round((beat + 1) / BUTTON_RATE * 1e9))
        moved = before.inverse() @ node.base.pose
        assert moved.position == pytest.approx((x * BASE_SPEED, y * BASE_SPEED, 0.0), abs=0.01)
        assert moved.yaw == pytest.approx(turn * BASE_TURN_SPEED, abs=0.01)
        still = node.base.pose
        node.simulation.step_until(node.simulation.now + 400_000_000)
        assert math.dist(node.base.pose.position, still.position) < BASE_SPEED * 0.25, (
            "when let go of, it comes to rest"
        )


def test_original_base_mode_has_sideways_and_turns_only() -> None:
    assert "forward" not in base_directions(BaseMode.ORIGINAL)
    assert set(base_directions(BaseMode.VELOCITY)) == set(BASE_DIRECTIONS)
    assert floats(base_command(BaseMode.ORIGINAL, "left")).shape == (2,)
