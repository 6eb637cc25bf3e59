"""Guard of an arm that a person works."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.operator.aids import outward_down
from cellwright.clients.agents.operator.guard import LEAST, PRESS, ArmGuard
from cellwright.clients.agents.operator.tool_arms import OperatedArm, operated_arms
from cellwright.clients.client.client import Client
from cellwright.clients.policies.targets import solve
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.util.pose import Pose
from tests.cell.arm_cells import TWO_ON_A_RAIL, finger_cell, ur5_cell
from tests.support.cells import ABOVE_THE_ROD, ARM_ONLY, INITIAL

BIN, WALL = 0.725, 0.066
"""Height of the surface of a bin, and of its walls above it [m]."""


def guard_of(trial: Trial, home: Sequence[float] | None = None) -> tuple[OperatedArm, ArmGuard, list[float]]:
    client = Client.in_process(Cell(trial))
    arm = operated_arms(client)[0]
    assert arm.arm is not None
    hand = client.arm(arm.arm.namespace) if arm.arm.namespace else client
    client.sleep(0.1)
    at = [hand.joint_positions[name] for name in arm.joints] if home is None else list(home)
    return arm, ArmGuard(client.solids(), client.chains()[arm.name], arm.arm, client.layout().arms, at), at


def lowered(arm: OperatedArm, q: Sequence[float], height: float) -> list[float]:
    """Return joints with the tool upright at a height, straight below where it is."""
    found = list(q)
    assert arm.outward is not None
    tool = outward_down(arm.world_T_tool(q), arm.outward)
    x, y, _ = tool.position
    for _ in range(50):
        goal = arm.tool.world_T_base(found).relative(Pose((x, y, height), tool.quaternion))
        for place, value in zip(arm.tool.places, solve(arm.tool, goal, found), strict=True):
            found[place] = value
    return found


def test_cup_may_stand_on_a_bin_and_not_be_pressed_into_it() -> None:
    arm, guard, _ = guard_of(ARM_ONLY, INITIAL)
    above = lowered(arm, ABOVE_THE_ROD, BIN + 0.1)
    touching = lowered(arm, ABOVE_THE_ROD, BIN + 0.005 - PRESS / 2)
    pressed = lowered(arm, ABOVE_THE_ROD, BIN + 0.005 - 2 * PRESS)
    assert guard.refusal(above, touching) == ""
    assert "would be pressed into bin7" in guard.refusal(touching, pressed)
    assert guard.refusal(pressed, touching) == "", "it may always go away"


def test_link_that_comes_near_is_stopped() -> None:
    _, guard, _ = guard_of(ARM_ONLY, INITIAL)
    # the elbow goes down into the bins: shoulder lift to 0.3 rad below the horizontal, stretched
    low = [0.0, 3.14, 0.2, 0.3, 3.77, -1.51, 0.0]
    refusal = guard.refusal(INITIAL, low)
    assert refusal
    assert "would come within" in refusal or "would be pressed" in refusal
    assert guard.refusal(low, INITIAL) == ""


@pytest.mark.parametrize("trial", [ur5_cell(), finger_cell(), load_trial(text=TWO_ON_A_RAIL).trial])
def test_arm_at_home_is_free(trial: Trial) -> None:
    arm, guard, home = guard_of(trial)
    x, y, z = arm.world_T_tool(home).position
    nearby = lowered(arm, home, z - 2 * LEAST)
    assert guard.refusal(home, nearby) == "", (x, y, z)
