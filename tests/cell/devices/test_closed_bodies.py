"""Closed bodies: the engine's broad phase passes over them, and opens them as they were."""

import mujoco
import numpy as np
import pytest

from cellwright.cell.devices.closed_bodies import ClosedBodies

BALL = '<body name="ball" pos="0 0 .09"><freejoint/><geom size=".1"/></body>'


@pytest.fixture
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody><geom type="plane" size="9 9 1"/>{BALL}</worldbody></mujoco>'
    )


def contacts(model: mujoco.MjModel) -> int:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return int(data.ncon)


def test_closed_body_has_no_contact_until_it_is_opened(model: mujoco.MjModel) -> None:
    bodies, ball = ClosedBodies(model), np.array([1])
    assert contacts(model) == 1
    bodies.close(ball)
    assert (contacts(model), bodies.is_closed.tolist()) == (0, [False, True])
    bodies.open(ball)
    assert (contacts(model), bodies.is_closed.tolist()) == (1, [False, False])


@pytest.mark.parametrize("is_weightless", [True, False])
def test_carried_body_weighs_again_when_it_is_opened(model: mujoco.MjModel, is_weightless: bool) -> None:
    bodies = ClosedBodies(model)
    bodies.carry(1, is_weightless=is_weightless)
    assert (contacts(model), bodies.is_closed.tolist()) == (0, [False, False])
    assert model.body_gravcomp[1] == float(is_weightless)
    bodies.open(np.array([1]))
    assert (contacts(model), model.body_gravcomp[1]) == (1, 0.0)


def test_contacts_can_be_skipped_altogether(model: mujoco.MjModel) -> None:
    bodies = ClosedBodies(model)
    bodies.allow_contacts(False)
    assert (contacts(model), bodies.has_contacts) == (0, False)
    bodies.allow_contacts(True)
    assert (contacts(model), bodies.has_contacts) == (1, True)
