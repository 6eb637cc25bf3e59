"""Traps of the engine with sleeping bodies, each with the remedy that devices use (`wake`, `keep_awake`)."""

from fractions import Fraction

import mujoco
import numpy as np
import pytest

from cellwright.engine.simulation import Simulation
from tests.engine.scene import make_simulation

BELT = """
<mujoco>
  <option integrator="implicitfast" cone="elliptic"><flag sleep="enable"/></option>
  <worldbody>
    <geom name="belt" type="box" size="2 .3 .1" pos="0 0 -.1" surfacevel="1e-9 0 0 0 0 0"/>
    <body name="part" pos="0 0 .011"><freejoint/><geom type="cylinder" size=".04 .01"/></body>
    <body name="cup" pos="0 0 .5"><joint name="cup" type="slide" axis="0 0 1"/>
      <geom size=".01" contype="0" conaffinity="0"/></body>
    <body name="shelf" pos="0 0 .5"/>
  </worldbody>
  <equality><weld name="grip" body1="cup" body2="part" active="false"/>
    <weld name="hang" body1="shelf" body2="part" active="false"/></equality>
  <actuator><pid joint="cup" kp="1e4" kv="1e2"/></actuator>
</mujoco>
"""


def make_belt() -> Simulation:
    simulation = Simulation(mujoco.MjModel.from_xml_string(BELT), timestep=Fraction(1, 500))
    simulation.reset()
    return simulation


def is_asleep(simulation: Simulation, body: str) -> bool:
    tree = simulation.model.body_treeid[simulation.model.body(body).id]
    return bool(simulation.data.tree_asleep[tree] >= 0)


def test_resting_parts_sleep_until_touched() -> None:
    simulation = make_simulation()
    simulation.reset()
    simulation.step_until(10**9)
    assert is_asleep(simulation, "block1")
    address = simulation.model.jnt_qposadr[simulation.model.body_jntadr[simulation.model.body("block2").id]]
    simulation.data.qpos[address : address + 3] = (0.0, 0.0, 0.2)
    simulation.step_until(1_200_000_000)
    assert not is_asleep(simulation, "block1")


def test_changed_belt_speed_needs_wake_to_wake_parts() -> None:
    simulation = make_belt()
    simulation.step_until(10**9)
    assert is_asleep(simulation, "part")
    start = float(simulation.data.qpos[0])
    simulation.model.geom_surfacevel[simulation.model.geom("belt").id, 0] = 0.2
    simulation.step_until(2 * 10**9)
    assert float(simulation.data.qpos[0]) == start, "the engine has fixed this: remove `wake`"
    simulation.wake(simulation.model.body("part").id)
    simulation.step_until(3 * 10**9)
    assert simulation.data.qpos[0] - start == pytest.approx(0.2, abs=0.01)


def test_wake_does_not_change_state() -> None:
    simulation = make_belt()
    simulation.step_until(10**9)
    before = simulation.state_hash()
    simulation.wake(simulation.model.body("part").id)
    assert simulation.state_hash() == before
    moving = make_belt()
    moving.data.qvel[0] = 0.5
    moving.wake(moving.model.body("part").id)
    assert moving.data.qvel[0] == 0.5


def test_wake_of_fixed_body_does_nothing() -> None:
    simulation = make_belt()
    before = simulation.data.qvel.copy()
    simulation.wake(0)
    simulation.keep_awake(0)
    assert np.array_equal(simulation.data.qvel, before)


@pytest.mark.parametrize("weld_name", ["grip", "hang"])
@pytest.mark.parametrize("hold", [0.3, 1.0, 2.0])
def test_part_released_in_mid_air_falls(hold: float, weld_name: str) -> None:
    simulation = make_belt()
    model, data = simulation.model, simulation.data
    weld = model.equality(weld_name).id
    data.qpos[:3] = (0.0, 0.0, 0.4)
    model.eq_data[weld, 3:10] = (0.0, 0.0, -0.1, 1.0, 0.0, 0.0, 0.0)
    data.eq_active[weld] = 1
    simulation.step_until(round(hold * 1e9))
    data.eq_active[weld] = 0
    simulation.keep_awake(model.body("part").id)
    simulation.step_until(simulation.now + 500_000_000)
    assert data.qpos[2] < 0.02


def test_reset_restores_changed_model_fields() -> None:
    simulation = make_belt()
    belt = simulation.model.geom("belt").id
    simulation.model.geom_surfacevel[belt, 0] = 0.2
    simulation.reset()
    assert simulation.model.geom_surfacevel[belt, 0] == pytest.approx(1e-9)
