"""Welds that hold parts: names, poses and forces, in a model of two bodies."""

import mujoco
import pytest

from cellwright.engine.simulation import Simulation
from cellwright.mechanism.welds import add_weld, engage_weld, find_weld, grip_name, weld_force
from cellwright.util.pose import Pose

HOLDER, PART = "hand", "bin7|gear_part_1"
BELOW = Pose((0.0, 0.0, -0.2))
MASS, GRAVITY = 0.5, 9.81


def hanging() -> Simulation:
    """A fixed hand, and a part below it, with a weld that is not engaged yet."""
    spec = mujoco.MjSpec()
    spec.worldbody.add_body(name=HOLDER, pos=(0.0, 0.0, 1.0))
    part = spec.worldbody.add_body(name=PART, pos=(0.0, 0.0, 0.8))
    part.add_freejoint()
    part.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(0.02, 0.0, 0.0), mass=MASS)
    add_weld(spec, grip_name(PART, "arm1"), HOLDER, PART, 0.004)
    simulation = Simulation(spec.compile())
    simulation.reset()
    return simulation


def test_first_gripper_has_the_names_of_2017() -> None:
    assert grip_name(PART) == "grip|bin7|gear_part_1"


def test_welds_of_two_grippers_differ() -> None:
    assert grip_name(PART, "arm1") != grip_name(PART, "arm2")


def test_weld_is_found_by_name_alone() -> None:
    model = hanging().model
    assert find_weld(model, grip_name(PART, "arm1")) == 0
    assert find_weld(model, grip_name(PART)) is None


def test_part_falls_until_weld_is_engaged() -> None:
    simulation = hanging()
    simulation.step_until(100_000_000)
    assert simulation.data.qpos[2] < 0.78
    assert weld_force(simulation.data, 0) == 0.0


@pytest.mark.parametrize("body", [HOLDER, PART])
def test_engaged_weld_holds_part_and_bears_its_weight(body: str) -> None:
    simulation = hanging()
    pose = BELOW if body == HOLDER else BELOW.inverse()
    engage_weld(simulation, 0, simulation.model.body(body).id, pose)
    simulation.step_until(1_000_000_000)
    assert simulation.data.qpos[2] == pytest.approx(0.8, abs=1e-4)
    assert weld_force(simulation.data, 0) == pytest.approx(MASS * GRAVITY, rel=1e-3)
