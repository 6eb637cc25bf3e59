"""Arm of any model in the engine."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from cellwright.cell.model.build import build_world
from cellwright.cell.model.own_arm import arm_problems
from cellwright.cell.model.solids import solids
from cellwright.config.layout.arm_models import joints_of
from cellwright.config.layout.arms import Mount
from cellwright.engine.shapes import Touch
from cellwright.util.pose import Pose
from tests.cell.arm_cells import ur5_cell


def test_arm_begins_at_home_and_holds_its_weight() -> None:
    trial = ur5_cell()
    world = build_world(trial)
    data = mujoco.MjData(world.model)
    world.set_initial_posture(data)
    for _ in range(500):
        mujoco.mj_step(world.model, data)
    (arm,) = trial.arms
    for name in trial.joints:
        assert data.joint(f"arm/{name}").qpos[0] == pytest.approx(arm.home.get(name, 0.0), abs=1e-4)
    # the cup looks down, 0.1 m before the flange
    assert data.body("arm/vacuum_gripper_link").xmat.reshape(3, 3)[2, 2] == pytest.approx(1.0, abs=1e-3)


def test_links_touch_parts_and_furniture_but_not_each_other() -> None:
    model = build_world(ur5_cell()).model
    cup = model.geom("arm/vacuum_gripper_cup")
    assert (int(cup.contype[0]), int(cup.conaffinity[0])) == Touch.ROBOT.value
    assert int(cup.contype[0]) & int(cup.conaffinity[0]) == 0


def test_moving_links_are_the_arms_among_the_solids() -> None:
    found = solids(build_world(ur5_cell()))
    assert "vacuum_gripper_link" in found
    assert not any("/" in frame for frame in found)
    assert "arm_pedestal" in {shape["body"] for shape in found["world"]}


def test_rail_carries_the_arm_and_touches_parts_alone() -> None:
    trial = ur5_cell()
    (arm,) = trial.arms
    rail = replace(arm, mount=Mount("rail", Pose((0.0, 0.0, 0.5)), range=(-0.5, 0.5)))
    trial = replace(trial, layout=replace(trial.layout, arms=(rail,)))
    model = build_world(trial).model
    assert next(iter(joints_of(rail, trial.arm_models))) == "rail_joint"
    beam = model.body("arm/rail")
    bits = {
        (int(model.geom_contype[g]), int(model.geom_conaffinity[g]))
        for g in range(int(beam.geomadr[0]), int(beam.geomadr[0] + beam.geomnum[0]))
    }
    assert bits == {(2, 0)}
    data = mujoco.MjData(model)
    data.joint("arm/rail_joint").qpos[0] = 0.3
    mujoco.mj_kinematics(model, data)
    assert np.allclose(data.body("arm/base_link").xpos, (0.0, 0.3, 0.5))


def test_home_at_a_singularity_is_a_problem_with_a_bent_one_as_the_remedy() -> None:
    trial = ur5_cell()
    (arm,) = trial.arms
    assert arm_problems(trial) == []
    straight = replace(trial, layout=replace(trial.layout, arms=(replace(arm, home={}),)))
    (problem,) = arm_problems(straight)
    assert problem.startswith("cell.arms.arm.home: the arm cannot move its tool in every direction from there")
    assert "bend it, for instance" in problem
