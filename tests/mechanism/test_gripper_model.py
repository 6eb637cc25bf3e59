"""Parallel gripper in a model: names, places, motion, and what is left alone."""

import math

import mujoco
import pytest

from cellwright.config.gripper import Pad, ParallelGripperSettings
from cellwright.config.gripper_links import GripperNames, palm_T_grasp
from cellwright.mechanism.gripper_model import PAD_SOLIMP, Contacts, add_parallel_gripper

BITS = (8, 2)


def model_of(settings: ParallelGripperSettings, *prefixes: str) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    for number, prefix in enumerate(prefixes):
        flange = spec.worldbody.add_body(name=f"{prefix}flange", pos=(float(number), 0.0, 1.0))
        add_parallel_gripper(spec, flange, settings, GripperNames(prefix), Contacts(BITS, 0.004))
    return spec.compile()


def test_two_grippers_with_prefixes_share_no_name() -> None:
    model = model_of(ParallelGripperSettings(), "a_", "b_")
    assert {model.body(GripperNames(prefix).palm).id for prefix in ("a_", "b_")} == {2, 6}
    assert {model.actuator(name).id for name in (*GripperNames("a_").joints, *GripperNames("b_").joints)} == {
        0,
        1,
        2,
        3,
    }


@pytest.mark.parametrize("width", [0.0, 0.03, 0.1])
def test_distance_between_pads_is_sum_of_positions(width: float) -> None:
    settings, names = ParallelGripperSettings(), GripperNames()
    model = model_of(settings, "")
    data = mujoco.MjData(model)
    for joint in names.joints:
        data.qpos[model.joint(joint).qposadr[0]] = width / 2
    mujoco.mj_kinematics(model, data)
    left, right = (data.geom(name).xpos for name in names.pads)
    thickness = 2 * model.geom(names.pads[0]).size[1]
    assert left[1] - right[1] == pytest.approx(width + thickness)
    assert left[0] == right[0] == 0.0
    assert left[2] == pytest.approx(data.site(names.grasp).xpos[2])


def test_grasp_is_in_the_middle_of_the_pads() -> None:
    settings = ParallelGripperSettings(pad=Pad((0.03, 0.05)))
    model = model_of(settings, "")
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    x, y, z = palm_T_grasp(settings).position
    assert data.site("gripper_grasp").xpos.tolist() == pytest.approx([x, y, 1.0 + z])


def test_pads_have_settings_and_priority() -> None:
    model = model_of(ParallelGripperSettings(pad=Pad((0.02, 0.04), 0.6)), "")
    for name in GripperNames().pads:
        pad = model.geom(name)
        assert pad.solimp.tolist() == list(PAD_SOLIMP)
        assert pad.priority[0] == 1
        assert pad.friction[0] == 0.6
        assert pad.size[[0, 2]].tolist() == [0.01, 0.02]


def test_every_shape_has_the_given_contact_bits() -> None:
    model = model_of(ParallelGripperSettings(), "")
    assert model.ngeom == 5
    assert set(zip(model.geom_contype.tolist(), model.geom_conaffinity.tolist(), strict=True)) == {BITS}


def test_options_of_the_whole_model_stay() -> None:
    with_gripper, without = model_of(ParallelGripperSettings(), "").opt, mujoco.MjSpec().compile().opt
    for option in ("impratio", "noslip_iterations", "cone", "timestep", "enableflags", "disableflags"):
        assert getattr(with_gripper, option) == getattr(without, option)


def test_fingers_stay_at_equal_distances_under_a_force_on_one() -> None:
    names = GripperNames()
    model = model_of(ParallelGripperSettings(), "")
    data = mujoco.MjData(model)
    left, right = (int(model.joint(name).qposadr[0]) for name in names.joints)
    data.qpos[[left, right]] = 0.03
    data.ctrl[::2] = 0.03
    data.qfrc_applied[int(model.joint(names.joints[0]).dofadr[0])] = 5.0
    for _ in range(500):
        mujoco.mj_step(model, data)
    assert data.qpos[left] == pytest.approx(data.qpos[right], abs=2e-4)
    assert data.qpos[left] > 0.0303


def test_gripper_has_no_weight() -> None:
    model = model_of(ParallelGripperSettings(), "")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert math.hypot(*(data.qfrc_bias - data.qfrc_gravcomp).tolist()) < 1e-12
