"""Actions: absolute targets in their units, and changes of targets scaled to ±1."""

from __future__ import annotations

import numpy as np
import pytest

from cellwright import Cell, load_trial
from cellwright.config.trial.gear2017 import load_trial as load_text
from cellwright.envs.actions import SLIDE_SPEED, TURN_SPEED, Actions, Control
from cellwright.envs.stepper import CellStepper
from cellwright.util.errors import UsageError
from tests.cell.arm_cells import ARMS
from tests.config.test_control import FINGERS

PERIOD = 0.05


def actions_of(stepper: CellStepper, control: Control) -> Actions:
    return Actions(stepper.space, control, PERIOD)


def lesson() -> CellStepper:
    return CellStepper(Cell(load_trial("lesson")))


def test_absolute_actions_are_the_targets() -> None:
    stepper = lesson()
    actions = actions_of(stepper, "absolute")
    assert actions.box.low.tolist() == pytest.approx([each.low for each in stepper.space.channels])
    assert actions.box.high.tolist() == pytest.approx([each.high for each in stepper.space.channels])
    action = np.arange(8, dtype=np.float32) / 10
    assert actions.targets(action, stepper) == action.astype(float).tolist()


def test_changes_move_targets_at_their_speeds_and_switch_suction_above_zero() -> None:
    stepper = lesson()
    actions = actions_of(stepper, "delta")
    assert (actions.box.low == -1.0).all()
    assert (actions.box.high == 1.0).all()
    before = stepper.desired()
    after = actions.targets([1.0, -0.5, 0, 0, 0, 0, 7.0, 0.2], stepper)
    steps = [SLIDE_SPEED * PERIOD, -0.5 * TURN_SPEED * PERIOD, 0, 0, 0, 0, TURN_SPEED * PERIOD]
    assert after[:7] == pytest.approx(np.add(before[:7], steps).tolist())
    assert after[7] == 1.0
    assert actions.targets([0.0] * 8, stepper)[7] == 0.0


def test_changes_add_to_targets_and_not_to_what_was_reached() -> None:
    stepper = lesson()
    actions, before = actions_of(stepper, "delta"), stepper.desired()
    for _ in range(4):
        stepper.step(actions.targets([1.0] + [0.0] * 7, stepper))
    assert stepper.desired()[0] == pytest.approx(before[0] + 4 * SLIDE_SPEED * PERIOD)


def test_a_width_goes_from_closed_to_open() -> None:
    stepper = CellStepper(Cell(load_text(text=FINGERS.format(model=ARMS / "ur5.urdf")).trial))
    actions = actions_of(stepper, "delta")
    widths = [actions.targets([0.0] * 6 + [share], stepper)[-1] for share in (-1.0, 0.0, 1.0)]
    assert widths == pytest.approx([0.0, 0.04, 0.08])


@pytest.mark.parametrize("control", ["absolute", "delta"])
def test_wrong_actions_are_refused_by_the_names_of_their_channels(control: Control) -> None:
    stepper = lesson()
    actions = actions_of(stepper, control)
    with pytest.raises(UsageError, match=r"action: must have 8 numbers \(got 3\)"):
        stepper.step(actions.targets([0.0] * 3, stepper))
    with pytest.raises(UsageError, match="elbow_joint must be finite"):
        stepper.step(actions.targets([0, 0, 0, np.inf, 0, 0, 0, 0], stepper))
    assert stepper.cell.simulation.now == 0
