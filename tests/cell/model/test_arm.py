"""Arm: its chain, its servos, its compliance."""

import json
import math
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from cellwright.config.arm import ARM_JOINTS, ArmSettings, JointGains
from cellwright.config.trial.trial import CellSettings, Trial
from cellwright.config.ur10 import FIGURES, GRIPPER, INITIAL_POSITIONS, UR10
from cellwright.util.errors import UnknownNameError
from tests.cell.model.arm_poses import ON_BELT, PICK, PLACE, READY, ZERO
from tests.cell.model.bench import Bench, cell
from tests.support.places import BELT

FK = json.loads((Path(__file__).parents[2] / "data" / "ur10_rail_fk.json").read_text())["cases"]


def arm(**settings: Any) -> Trial:
    return cell(has_arm=True, settings=CellSettings(arm=ArmSettings(**settings)))


@pytest.fixture(scope="module")
def original() -> Bench:
    return Bench(arm())


@pytest.fixture(scope="module")
def floating() -> Bench:
    """Return a bench with the original servo and no support."""
    bench = Bench(arm())
    bench.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    return bench


def joint_value(bench: Bench, joint: str) -> float:
    return float(bench.data.qpos[bench.model.joint(joint).qposadr[0]])


@pytest.mark.parametrize("case", FK, ids=[case["name"] for case in FK])
def test_arm_agrees_with_ur10_forward_kinematics(original: Bench, case: dict[str, Any]) -> None:
    data = mujoco.MjData(original.model)
    for joint, value in case["joints"].items():
        data.qpos[original.model.joint(joint).qposadr[0]] = value
    mujoco.mj_kinematics(original.model, data)
    for link in ("wrist_3_link", GRIPPER):
        expected = np.array(case[link])
        assert data.body(link).xpos == pytest.approx(expected[:3, 3], abs=1e-6)
        assert data.body(link).xmat.reshape(3, 3) == pytest.approx(expected[:3, :3], abs=1e-6)


def test_tool_frames_are_fixed_to_last_wrist(original: Bench) -> None:
    model, data = original.model, mujoco.MjData(original.model)
    mujoco.mj_kinematics(model, data)
    wrist = data.body("wrist_3_link")
    for site in ("ee_link", "tool0"):
        local = wrist.xmat.reshape(3, 3).T @ (data.site(site).xpos - wrist.xpos)
        assert local == pytest.approx((0.0, 0.0922, 0.0), abs=1e-9)
    tool_z = data.site("tool0").xmat.reshape(3, 3)[:, 2]
    assert tool_z == pytest.approx(wrist.xmat.reshape(3, 3)[:, 1], abs=1e-9)
    assert data.site("base").xmat.reshape(3, 3)[0, 0] == pytest.approx(-1.0)


def test_links_have_masses_and_inertia_of_original(original: Bench) -> None:
    masses = (4.0, 7.778, 12.93, 3.87, 1.96, 1.96, 0.202, 0.01)
    links = [joint.child for joint in UR10.joints]
    for link, mass in zip(links, masses, strict=True):
        assert original.model.body(link).mass[0] == mass
    assert original.model.body("upper_arm_link").ipos == pytest.approx((0, 0, 0.306))
    # as the public robot description has them
    assert original.model.body("upper_arm_link").inertia == pytest.approx((0.421753803798, 0.421753803798, 0.036365625))
    assert original.model.body("shoulder_link").inertia == pytest.approx(
        (0.0314743125769, 0.0314743125769, 0.021875625)
    )


def test_arm_joints_come_first_in_order_of_controller(original: Bench) -> None:
    model = original.model
    assert ARM_JOINTS == ARM_JOINTS
    assert tuple(model.joint(i).name for i in range(7)) == ARM_JOINTS
    assert tuple(model.actuator(i).name for i in range(7)) == ARM_JOINTS
    assert list(model.actuator_ctrlnum[:7]) == [2] * 7


def test_original_servo_has_original_parameters(original: Bench) -> None:
    model = original.model
    for joint in UR10.driven:
        figures, limits = FIGURES[joint.name], joint.limits
        actuator, dof = model.actuator(joint.name), int(model.joint(joint.name).dofadr[0])
        assert (-actuator.biasprm[1], -actuator.biasprm[2]) == (figures.gains.p, figures.gains.d)
        assert list(actuator.forcerange) == [-limits.effort, limits.effort]
        assert model.dof_damping[dof] == figures.damping
        assert model.dof_frictionloss[dof] == 0.0  # it never acted in the original
        assert model.dof_armature[dof] == 0.0
        assert list(model.joint(joint.name).range) == [limits.lower, limits.upper]
    assert {model.body(body).name for body in np.flatnonzero(model.body_gravcomp)} == {BELT.body}


def test_integral_term_is_clamped_in_units_of_force() -> None:
    """Lift: i 10, clamped to 50 N m, so that the integral itself stops at 5 rad s."""
    bench = Bench(arm())
    model, data = bench.model, bench.data
    assert model.na == 2
    lift, elbow = (int(model.actuator(name).actadr[0]) for name in ("shoulder_lift_joint", "elbow_joint"))
    assert (model.actuator("shoulder_lift_joint").gainprm[0], model.actuator("elbow_joint").gainprm[0]) == (10.0, 1.0)
    data.act[lift], data.act[elbow] = 5.0, -25.0
    bench.run(0.2)  # the errors persist; the clamp holds
    assert abs(data.act[lift]) <= 5.0 + 1e-5
    assert abs(data.act[elbow]) <= 25.0 + 1e-5


def test_configured_gains_replace_original_gains() -> None:
    bench = Bench(arm(gains={"elbow_joint": JointGains(123.0, 4.0), "wrist_3_joint": JointGains(7.0, 1.0, 2.0, 6.0)}))
    model = bench.model
    assert (-model.actuator("elbow_joint").biasprm[1], -model.actuator("elbow_joint").biasprm[2]) == (123.0, 4.0)
    assert model.actuator("wrist_3_joint").gainprm[0] == 2.0
    assert model.actuator("wrist_3_joint").dynprm[0] == 3.0
    assert -model.actuator("wrist_1_joint").biasprm[1] == 100.0
    assert model.na == 2  # lift, and wrist 3 instead of the elbow


def test_settings_for_unknown_joint_are_refused_with_suggestion() -> None:
    with pytest.raises(UnknownNameError, match="unknown arm joint 'elbow'; did you mean elbow_joint"):
        Bench(arm(gains={"elbow": JointGains(1.0, 1.0)}))
    with pytest.raises(UnknownNameError, match="unknown arm joint 'rail'"):
        Bench(arm(dry_friction={"rail": 500.0}))


def test_initial_posture_is_default_or_configured(original: Bench) -> None:
    bench = Bench(arm())
    assert {name: joint_value(bench, name) for name in ARM_JOINTS} == INITIAL_POSITIONS
    assert INITIAL_POSITIONS["shoulder_pan_joint"] == 3.14
    configured = Bench(cell(has_arm=True, initial_joint_states={"elbow_joint": 2.0}))
    assert joint_value(configured, "elbow_joint") == 2.0
    assert joint_value(configured, "wrist_1_joint") == 3.77
    with pytest.raises(UnknownNameError, match="arm joint"):
        Bench(cell(has_arm=True, initial_joint_states={"elbow": 1.0}))


def test_initial_posture_is_held_from_first_step() -> None:
    bench = Bench(arm())
    bench.run(1.0)
    for name, value in INITIAL_POSITIONS.items():
        # the soft wrists sag under the weight below them
        assert joint_value(bench, name) == pytest.approx(value, abs=0.03 if "wrist" in name else 0.002)


SAG = [(PICK, -1.24), (ON_BELT, -2.06), (PLACE, -2.98), (ZERO, -3.25)]


@pytest.mark.parametrize(("joints", "sag"), SAG, ids=["pick", "belt", "place", "zero"])
def test_original_servo_has_computed_static_sag(floating: Bench, joints: dict[str, float], sag: float) -> None:
    """Height that the gripper loses to gravity [mm], as computed from the original's gains and masses."""
    mujoco.mj_resetData(floating.model, floating.data)
    floating.world.set_initial_posture(floating.data)
    floating.put_arm(joints)
    before = floating.body_pose(GRIPPER).position[2]
    floating.run(3.0)
    assert (floating.body_pose(GRIPPER).position[2] - before) * 1e3 == pytest.approx(sag, abs=0.05)


@pytest.mark.parametrize(("joint", "error"), [("linear_arm_actuator_joint", 0.045), ("shoulder_pan_joint", 0.0018)])
def test_rail_and_pan_joint_reach_setpoint(floating: Bench, joint: str, error: float) -> None:
    """Published dry friction would hold them back; the servos bring them to within a thousandth."""
    mujoco.mj_resetData(floating.model, floating.data)
    floating.world.set_initial_posture(floating.data)
    floating.command(joint, INITIAL_POSITIONS[joint] + error)
    floating.run(3.0)
    assert joint_value(floating, joint) == pytest.approx(INITIAL_POSITIONS[joint] + error, abs=1e-3 * error)


@pytest.mark.parametrize(("joint", "error"), [("linear_arm_actuator_joint", 0.045), ("shoulder_pan_joint", 0.0018)])
def test_configured_dry_friction_holds_without_creep(joint: str, error: float) -> None:
    """The servo pulls with nine tenths of the joint's dry friction for ten seconds."""
    bench = Bench(arm(dry_friction={name: each.friction for name, each in FIGURES.items()}))
    bench.run(1.0)
    start = joint_value(bench, joint)
    bench.command(joint, INITIAL_POSITIONS[joint] + error)
    bench.run(10.0)
    assert abs(joint_value(bench, joint) - start) < 5e-3 * error


def test_joint_force_stays_within_effort_limit() -> None:
    bench = Bench(arm())
    bench.command("elbow_joint", 6.0)
    highest = 0.0
    for _ in range(200):
        mujoco.mj_step(bench.model, bench.data)
        highest = max(highest, float(np.abs(bench.data.actuator("elbow_joint").force[0])))
    assert highest == pytest.approx(150.0)


@pytest.mark.parametrize("step", [(1, 500), (1, 250)])
def test_precise_servo_follows_within_milliradian(step: tuple[int, int]) -> None:
    """All joints swing at once, at up to 2.1 rad/s and 9 rad/s^2.

    Setpoints: the position desired when a step begins, the velocity desired when it ends.
    """
    bench = Bench(cell(has_arm=True, settings=CellSettings(timestep=step, arm=ArmSettings(servo="precise"))))
    bench.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    bench.put_arm(READY)
    timestep = bench.model.opt.timestep

    def swing(start: float, time: float) -> float:
        return start + 0.5 * (1 - math.cos(4.2 * time)) * (1 - math.exp(-3 * time * time))

    worst = 0.0
    for k in range(round(3.0 / timestep)):
        now, then = k * timestep, (k + 1) * timestep
        for name, start in READY.items():
            slope = (swing(start, then + 1e-6) - swing(start, then - 1e-6)) / 2e-6
            bench.command(name, swing(start, now), slope)
        mujoco.mj_step(bench.model, bench.data)
        worst = max(worst, *(abs(joint_value(bench, name) - swing(start, then)) for name, start in READY.items()))
    assert worst < 1e-3


def test_precise_servo_does_not_sag() -> None:
    bench = Bench(arm(servo="precise"))
    bench.put_arm(READY)
    bench.run(2.0)
    assert {name: joint_value(bench, name) for name in ARM_JOINTS} == pytest.approx(READY, abs=1e-9)


def test_precise_servo_uses_configured_gains() -> None:
    bench = Bench(arm(servo="precise", gains={"elbow_joint": JointGains(500.0, 50.0)}))
    assert -bench.model.actuator("elbow_joint").biasprm[1] == 500.0
    assert -bench.model.actuator("shoulder_lift_joint").biasprm[1] == 1.2e5


def test_arm_does_not_collide_with_its_rail(original: Bench) -> None:
    """As in the original, whose robot has no self-collision."""
    model = original.model
    robot = [g for g in range(model.ngeom) if model.geom_contype[g] == 4]
    assert len(robot) > 15
    assert all(model.geom_conaffinity[g] == 1 for g in robot)
    rail = model.body("linear_arm_actuator").id
    assert any(model.geom_bodyid[g] == rail for g in robot)
