"""State that the engine keeps: its hash, and its copy into a larger model."""

import mujoco
import numpy as np
import pytest

from cellwright.engine.engine_state import CHANGING_FIELDS, copy_data, copy_fields, hash_engine

BALL = '<body pos="0 0 {}"><freejoint/><geom size=".1"/></body>'


def model_of(count: int) -> mujoco.MjModel:
    bodies = "".join(BALL.format(1 + number) for number in range(count))
    option = '<option><flag sleep="enable"/></option><size memory="10M"/>'
    return mujoco.MjModel.from_xml_string(f"<mujoco>{option}<worldbody>{bodies}</worldbody></mujoco>")


@pytest.fixture
def fallen() -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = model_of(2)
    data = mujoco.MjData(model)
    for _ in range(5):
        mujoco.mj_step(model, data)
    return model, data


def test_negative_zero_has_the_hash_of_zero(fallen: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    model, data = fallen
    before = hash_engine(model, data).hexdigest()
    data.qvel[:2] = -0.0
    assert hash_engine(model, data).hexdigest() == before
    data.qvel[0] = 1e-300
    assert hash_engine(model, data).hexdigest() != before


@pytest.mark.parametrize("field", CHANGING_FIELDS)
def test_changing_fields_are_state(field: str) -> None:
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body name="a"><freejoint/><geom size=".1"/></body></worldbody>'
        '<equality><weld body1="a"/></equality></mujoco>'
    )
    data = mujoco.MjData(model)
    before = hash_engine(model, data).hexdigest()
    getattr(model, field)[0, 0] += 0.5
    assert hash_engine(model, data).hexdigest() != before


def test_bodies_of_a_larger_model_sleep_and_the_others_go_on(fallen: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    small, data = fallen
    large = model_of(3)
    grown = mujoco.MjData(large)
    copy_fields(small, large)
    copy_data(data, large, grown)
    assert grown.time == data.time
    assert (grown.tree_asleep < 0).tolist() == [True, True, False]
    for _ in range(5):
        mujoco.mj_step(small, data)
        mujoco.mj_step(large, grown)
    assert np.array_equal(grown.qpos[:14], data.qpos)
    assert grown.qpos[14:17].tolist() == [0.0, 0.0, 3.0]
