"""Robots in the engine's model of a cell."""

import mujoco
import numpy as np
import pytest

from cellwright.cell.model.build import build_world
from cellwright.cell.model.own_robot import first_positions
from cellwright.cell.model.rearrangement import rearrange
from cellwright.config.robot.model import link_poses
from cellwright.config.trial.trial import Trial
from cellwright.mechanism.robot_bodies import ITERATIONS
from tests.cell.robot_cells import AT_BIN, tandem_cell


def test_links_are_at_the_place_of_the_layout() -> None:
    trial = tandem_cell(AT_BIN.replace("at: [0.0, 0.0, 0.0]", "at: [0.3, -0.2, 0.1], turn: pi/3"))
    world = build_world(trial)
    data = mujoco.MjData(world.model)
    world.set_initial_posture(data)
    mujoco.mj_kinematics(world.model, data)
    (robot,), config = trial.layout.robots, trial.robot_models["tandem"]
    positions = {name.removeprefix("tandem/"): value for name, value in first_positions(trial).items()}
    expected = link_poses(config.robot, positions, robot.pose)
    for link, pose in expected.items():
        assert data.body(f"tandem/{link}").xpos == pytest.approx(pose.position, abs=1e-9)


def test_weight_of_robot_alone_is_compensated() -> None:
    model = build_world(tandem_cell()).model
    for body in range(1, model.nbody):
        is_link = model.body(body).name.startswith("tandem/") and model.body(body).name != "tandem/place"
        assert model.body_gravcomp[body] == float(is_link)


def test_links_of_an_only_robot_touch_parts_and_fixed_things_but_not_each_other() -> None:
    model = build_world(tandem_cell()).model
    own = [geom for geom in range(model.ngeom) if model.body(model.geom_bodyid[geom]).name.startswith("tandem/")]
    bits = {(int(model.geom_contype[geom]), int(model.geom_conaffinity[geom])) for geom in own}
    assert bits == {(4, 1)}


def test_rearranged_model_is_that_of_a_new_cell() -> None:
    trial = tandem_cell()
    world, again = build_world(trial), rearrange(build_world(trial), trial)
    assert (world.initial_qpos == again.initial_qpos).all()
    assert (world.initial_ctrl == again.initial_ctrl).all()
    assert np.array_equal(world.model.dof_frictionloss, again.model.dof_frictionloss)


def test_solver_has_more_iterations_with_a_robot_alone() -> None:
    assert build_world(tandem_cell()).model.opt.iterations == ITERATIONS
    assert build_world(Trial("plain")).model.opt.iterations < ITERATIONS
