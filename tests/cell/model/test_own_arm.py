"""Arm of any model in the engine."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.model.build import build_world
from cellwright.cell.model.own_arm import arm_problems
from cellwright.cell.model.solids import solids
from cellwright.clients.client import Client
from cellwright.config.layout.arm_models import joints_of
from cellwright.config.layout.arms import Mount
from cellwright.engine.shapes import Touch
from cellwright.util.pose import Pose
from tests.cell.arm_cells import PEDESTAL, ur5_cell, ur5e_cell


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
    assert problem.key == "cell.arms.arm.home"
    assert problem.message.startswith("the arm cannot move its tool in every direction from there")
    assert "bend it, for instance" in problem.message


def test_drives_as_given_have_the_gains_and_the_inertia_of_the_file() -> None:
    model = build_world(ur5e_cell("drives: as_given")).model
    stiff = build_world(ur5e_cell("drives: stiff")).model
    for name, kp, kv, effort in (("elbow_joint", 2000.0, 400.0, 150.0), ("wrist_1_joint", 500.0, 100.0, 28.0)):
        servo = model.actuator(f"arm/{name}")
        assert tuple(servo.biasprm[1:3]) == pytest.approx((-kp, -kv))
        assert tuple(servo.forcerange) == (-effort, effort)
        assert model.joint(f"arm/{name}").armature == 0.1
        assert stiff.actuator(f"arm/{name}").biasprm[1] != -kp


def test_arm_with_drives_as_given_follows_a_trajectory_and_holds_its_weight() -> None:
    cell = Cell(ur5e_cell("drives: as_given"))
    client = Client.in_process(cell)
    client.sleep(0.1)
    start = client.joint_positions
    end = {**start, "shoulder_pan_joint": start["shoulder_pan_joint"] + 1.0, "elbow_joint": 1.0}
    client.send_arm([[end[name] for name in client.joints]], [1.0])
    client.sleep(2.0)
    found = client.joint_positions
    assert all(found[name] == pytest.approx(end[name], abs=2e-4) for name in end)


def test_named_primitives_touch_in_place_of_the_links_own_shapes() -> None:
    primitives = (
        "forearm_link: [{{capsule: {{radius: 0.05, length: 0.3}}, pose: {{xyz: [0.1, 0, 0.2], rpy: [0, pi/2, 0]}}}}], "
        "upper_arm_link: []"
    )
    text = PEDESTAL.replace("tip: tool0", "tip: tool0\n      collision: {{primitives: {{" + primitives + "}}}}")
    model = build_world(ur5_cell(text)).model
    forearm, upper_arm = model.body("arm/forearm_link"), model.body("arm/upper_arm_link")
    assert (int(forearm.geomnum[0]), int(upper_arm.geomnum[0])) == (1, 0)
    geom = model.geom(int(forearm.geomadr[0]))
    assert (int(geom.type[0]), tuple(geom.size[:2])) == (mujoco.mjtGeom.mjGEOM_CAPSULE, (0.05, 0.15))
    assert tuple(geom.pos) == pytest.approx((0.1, 0.0, 0.2))
    assert (int(geom.contype[0]), int(geom.conaffinity[0])) == Touch.ROBOT.value
    assert int(model.body("arm/shoulder_link").geomnum[0]) > 0
