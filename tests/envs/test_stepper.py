"""Stepper of a cell: its periods are those of a client's messages, bit for bit."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from cellwright import Cell, load_trial
from cellwright.clients.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.config.control import ControlSpace
from cellwright.config.trial.gear2017 import load_trial as load_text
from cellwright.config.trial.trial import Trial
from cellwright.envs.stepper import NODE, CellStepper
from cellwright.middleware.messages.control_msgs import GripperCommand
from cellwright.middleware.messages.conversions import joint_state
from cellwright.util.errors import UsageError
from tests.cell.arm_cells import ARMS, TWO_ON_A_RAIL
from tests.cell.robot_cells import tandem_cell
from tests.config.test_control import FINGERS
from tests.support.cells import run

ACTIONS = 12


def actions_of(space: ControlSpace, first: Sequence[float]) -> list[list[float]]:
    """Return actions around a posture, the grippers switched now and then."""
    generator = np.random.default_rng(7)
    found = []
    for number in range(ACTIONS):
        action = [value + shift for value, shift in zip(first, generator.uniform(-0.2, 0.2, len(first)), strict=True)]
        for place, channel in enumerate(space.channels):
            if channel.kind == "suction":
                action[place] = float(number % 5 < 3)
            elif channel.kind == "width":
                action[place] = 0.02 if number % 5 < 3 else channel.high
        found.append(space.targets(action))
    return found


def send(client: Client, cell: Cell, space: ControlSpace, action: Sequence[float], before: Sequence[float]) -> None:
    """Send an action as a program sends it: a trajectory of one point, and what has changed at the grippers."""
    by_arm: dict[str, list[int]] = {}
    for place, channel in enumerate(space.channels):
        if not channel.robot:
            by_arm.setdefault(channel.arm, []).append(place)
    for arm, places in by_arm.items():
        topics = f"/ariac/{arm}" if arm else "/ariac"
        device = client.arm(arm) if arm else client
        joints = [place for place in places if space.channels[place].kind == "joint"]
        names = [space.channels[place].joint for place in joints]
        device.send_arm([[action[place] for place in joints]], [0.05], joints=names)
        for place in places:
            if space.channels[place].kind == "suction" and action[place] != before[place]:
                device.control_gripper(action[place] > 0.5)
            if space.channels[place].kind == "width" and action[place] != before[place]:
                client.publish(f"{topics}/gripper/command", GripperCommand(action[place], 0.0))
    for robot in cell.trial.layout.robots:
        own = [place for place, channel in enumerate(space.channels) if channel.robot == robot.name]
        message = joint_state([space.channels[place].joint for place in own], [action[place] for place in own])
        cell.bus.publish(f"/{robot.namespace}/joint_cmd", message, node=NODE)


def lesson() -> Trial:
    return load_trial("lesson")


def fingers() -> Trial:
    return load_text(text=FINGERS.format(model=ARMS / "ur5.urdf")).trial


def two_arms() -> Trial:
    return load_text(text=TWO_ON_A_RAIL).trial


@pytest.mark.parametrize("make", [lesson, fingers, two_arms, tandem_cell])
def test_steps_are_those_of_messages_bit_for_bit(make: Callable[[], Trial]) -> None:
    trial = make()
    stepper, other = CellStepper(Cell(trial), rate=20), Cell(trial)
    client = Client(InProcess(other, node=NODE))
    before = stepper.read()
    for action in actions_of(stepper.space, before):
        stepper.step(action)
        send(client, other, stepper.space, action, before)
        run(other, 0.05)
        before = action
    assert stepper.cell.state_hash() == other.state_hash()


def test_measured_values_are_in_the_order_and_range_of_the_channels() -> None:
    stepper = CellStepper(Cell(load_trial("lesson")), rate=20)
    first = stepper.read()
    assert first == [*stepper.cell.arms["arm"].read().positions, 0.0]
    stepper.step([*first[:-1], 1.0])
    assert stepper.read()[-1] == 1.0
    assert stepper.read()[:-1] == pytest.approx(first[:-1], abs=0.01)


def test_targets_are_reached_at_the_end_of_a_period_of_their_own() -> None:
    stepper = CellStepper(Cell(load_trial("lesson")), rate=2)
    action = stepper.read()
    action[1] += 0.3
    stepper.step(action)
    assert stepper.cell.simulation.time == 0.5
    desired = stepper.cell.arms["arm"].controller
    assert desired.positions(stepper.cell.simulation.now) == action[:-1]
    assert desired.positions(stepper.cell.simulation.now // 2)[1] == pytest.approx(action[1] - 0.15, abs=1e-6)


def test_a_wrong_action_changes_nothing() -> None:
    stepper = CellStepper(Cell(load_trial("lesson")), rate=20)
    before = stepper.cell.state_hash()
    with pytest.raises(UsageError, match="action: must have 8 numbers"):
        stepper.step([0.0])
    with pytest.raises(UsageError, match="shoulder_pan_joint must be finite"):
        stepper.step([0.0, float("nan"), *[0.0] * 6])
    assert stepper.cell.state_hash() == before


def test_cells_without_anything_to_command_and_odd_rates_are_refused() -> None:
    with pytest.raises(UsageError, match="there is no arm and no robot to command"):
        CellStepper(Cell(load_text(text="cell: {bins: {bin1: {at: [0.8, 0.0]}}}").trial))
    with pytest.raises(UsageError, match="whole ticks of 2 ms"):
        CellStepper(Cell(load_trial("lesson")), rate=30)
