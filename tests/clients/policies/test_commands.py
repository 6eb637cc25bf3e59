"""Commands of a policy agent: those of the environment's stepper, bit for bit."""

from collections.abc import Callable

import pytest

from cellwright import Cell, load_trial
from cellwright.clients.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.clients.policies.commands import Commands
from cellwright.config.trial.gear2017 import load_trial as load_text
from cellwright.config.trial.trial import Trial
from cellwright.envs.stepper import NODE, CellStepper
from tests.cell.arm_cells import ARMS, TWO_ON_A_RAIL
from tests.cell.robot_cells import tandem_cell
from tests.config.test_control import FINGERS
from tests.envs.test_stepper import actions_of
from tests.support.cells import run


def lesson() -> Trial:
    return load_trial("lesson")


def fingers() -> Trial:
    return load_text(text=FINGERS.format(model=ARMS / "ur5.urdf")).trial


def two_arms() -> Trial:
    return load_text(text=TWO_ON_A_RAIL).trial


@pytest.mark.parametrize("make", [lesson, fingers, two_arms, tandem_cell])
def test_messages_of_an_action_are_a_step_of_an_environment(make: Callable[[], Trial]) -> None:
    trial = make()
    stepper, other = CellStepper(Cell(trial), rate=20), Cell(trial)
    commands = Commands(Client(InProcess(other, node=NODE)), stepper.space, 50_000_000)
    first = stepper.read()
    commands.begin(first)
    for action in actions_of(stepper.space, first):
        stepper.step(action)
        commands.send(action)
        run(other, 0.05)
    assert stepper.cell.state_hash() == other.state_hash()
