"""Robots in the engine: poses, masses and names of their bodies."""

import math
from dataclasses import replace
from fractions import Fraction

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.config.models.model import ModelShape
from cellwright.config.robot.config import GripperConfig
from cellwright.config.robot.model import Inertial, Joint, JointType, Limits, Link, link_poses
from cellwright.mechanism.robot_bodies import DEFAULT_MASS, FINGER_MASS
from cellwright.robot.model import BASE_BODY, RobotWorld, body_of, build_robot
from cellwright.util.errors import DescriptionError
from cellwright.util.pose import Pose
from tests.cell.model.robots import of_joints
from tests.robot.robots import two_arms

REVOLUTE, FIXED = JointType.REVOLUTE, JointType.FIXED
PLACE = Pose.from_rpy((0.3, -0.2, 0.9), (0.1, 0.2, 1.5))


def forward(world: RobotWorld, posture: dict[str, float]) -> mujoco.MjData:
    data = mujoco.MjData(world.model)
    for name, value in posture.items():
        data.qpos[world.model.joint(name).qposadr[0]] = value
    mujoco.mj_forward(world.model, data)
    return data


def body_pose(data: mujoco.MjData, link: str) -> Pose:
    body = data.body(body_of(link))
    return Pose(tuple(body.xpos.tolist()), tuple(body.xquat.tolist()))


WORLDS = {
    link: build_robot(replace(two_arms(), fixed_link=link, base_pose=PLACE))
    for link in ("base", "torso", "hand_right", "antenna", "tip_left")
}


@pytest.mark.slow
@settings(max_examples=20)
@given(numbers=st.lists(st.floats(-2.0, 2.0), min_size=14, max_size=14), fixed_link=st.sampled_from(sorted(WORLDS)))
def test_links_keep_relative_poses_with_any_fixed_link(numbers: list[float], fixed_link: str) -> None:
    world = WORLDS[fixed_link]
    robot = world.config.robot
    posture = dict(zip((joint.name for joint in robot.driven), numbers, strict=True))
    data = forward(world, posture)
    poses = link_poses(robot, posture)
    assert body_pose(data, fixed_link).position == pytest.approx(PLACE.position)
    for link, pose in poses.items():
        expected = PLACE @ poses[fixed_link].inverse() @ pose
        found = body_pose(data, link)
        assert found.position == pytest.approx(expected.position, abs=1e-9)
        assert abs(np.dot(found.quaternion, expected.quaternion)) == pytest.approx(1.0)


def test_robot_starts_at_home_without_gravity_on_movable_base() -> None:
    world = build_robot(two_arms(), timestep=Fraction(1, 1000))
    data = mujoco.MjData(world.model)
    world.set_initial_posture(data)
    assert data.joint("elbow_left").qpos[0] == -1.0
    assert world.model.opt.timestep == 0.001
    assert world.model.opt.gravity.tolist() == [0.0, 0.0, 0.0]
    assert world.model.body(BASE_BODY).mocapid[0] == 0


def hinge(child: str, parent: str = "root", limits: Limits | None = None, name: str = "") -> Joint:
    return Joint(
        name or f"to {child}", REVOLUTE, parent, child, Pose((0.0, 0.0, 0.3)), limits=limits or Limits(-1.0, 1.0)
    )


def test_joint_that_cannot_be_at_0_starts_at_nearest_limit() -> None:
    ranges = {"above": (0.2, 1.0), "below": (-1.0, -0.3), "around": (-1.0, 1.0), "one_sided": (0.1, math.inf)}
    joints = [
        Joint(name, REVOLUTE, f"link_{number}", f"link_{number + 1}", limits=Limits(*ends, 10.0, 1.0))
        for number, (name, ends) in enumerate(ranges.items())
    ]
    world = build_robot(of_joints(*joints))
    data = mujoco.MjData(world.model)
    world.set_initial_posture(data)
    assert {name: data.joint(name).qpos[0] for name in ranges} == {
        "above": 0.2,
        "below": -0.3,
        "around": 0.0,
        "one_sided": 0.1,
    }


def test_link_without_mass_gets_default_mass() -> None:
    links = {"finger": Link("finger", Inertial(2.0, inertia=(0.2, 0.2, 0.2, 0, 0, 0)))}
    config = of_joints(hinge("arm"), hinge("finger", "arm"), links=links, grippers=(GripperConfig(("to finger",)),))
    model = build_robot(config).model
    assert model.body("arm").mass[0] == DEFAULT_MASS
    assert model.body("finger").mass[0] == FINGER_MASS
    assert model.body("finger").inertia == pytest.approx([0.2 * FINGER_MASS / 2.0] * 3)  # lighter, of the same form


LYING = Pose.from_rpy((5.0, 0.0, 0.0), (0.0, math.pi / 2, 0.0))
SLAB, BALL = ModelShape("box", (0.1, 0.2, 0.3)), ModelShape("sphere", (0.1, 0.0, 0.0))
ROD = [0.2 / 12, 0.2 / 12, 0.08 / 12]  # of a box of 0.2 m by 0.2 m by 0.4 m and 1 kg


@pytest.mark.parametrize(
    ("shapes", "inertia"),
    [
        # as PyBullet has it, but for its margins of 1 mm
        ((ModelShape("box", (0.2, 0.2, 0.2)),), [0.2**2 / 6] * 3),
        ((SLAB,), [0.13 / 12, 0.10 / 12, 0.05 / 12]),
        ((replace(SLAB, pose=LYING),), [0.05 / 12, 0.10 / 12, 0.13 / 12]),
        ((BALL, replace(BALL, pose=Pose((0.0, 0.0, 0.2)))), ROD),
        ((ModelShape("cylinder", (0.1, 0.4, 0.0)),), ROD),
        ((ModelShape("capsule", (0.1, 0.2, 0.0)),), ROD),
        ((replace(SLAB, is_touched=False),), [1e-9] * 3),
    ],
)
def test_link_without_mass_gets_inertia_of_bounding_box(shapes: tuple[ModelShape, ...], inertia: list[float]) -> None:
    model = build_robot(of_joints(hinge("arm"), links={"arm": Link("arm", shapes=shapes)})).model
    assert sorted(model.body("arm").inertia) == pytest.approx(sorted(inertia), rel=1e-6)
    assert model.body("arm").mass[0] == DEFAULT_MASS


def test_inertia_is_rotated_with_its_axes() -> None:
    turned = Pose.from_rpy((0.1, 0.0, 0.0), (0.0, 0.0, math.pi / 2))
    links = {"arm": Link("arm", Inertial(1.0, turned, (0.1, 0.2, 0.25, 0.0, 0.0, 0.0)))}
    world = build_robot(of_joints(hinge("arm"), links=links))
    data = forward(world, {})
    data.qfrc_applied[0] = 3.0
    world.model.dof_frictionloss[:] = 0.0  # without its drive
    mujoco.mj_forward(world.model, data)
    assert data.qacc[0] == pytest.approx(3.0 / 0.2)  # its second axis lies along x, about which it turns


def test_links_with_impossible_inertia_stay_finite() -> None:
    links = {
        "nothing": Link("nothing", Inertial(0.0)),
        "thin": Link("thin", Inertial(1.0, inertia=(1e-12, 1e-12, 5.0, 0, 0, 0))),
    }
    world = build_robot(of_joints(hinge("nothing"), hinge("thin", "nothing"), links=links))
    data = forward(world, {"to thin": 0.5})
    data.qvel[:] = 1.0
    mujoco.mj_step(world.model, data, 100)
    assert np.isfinite(data.qpos).all()


def test_joints_have_limits_of_urdf() -> None:
    locked, free = Limits(0.5, 0.5), Limits(lower=0.0)
    config = of_joints(hinge("a"), hinge("b", limits=locked), hinge("c", limits=free))
    model = build_robot(config).model
    assert model.joint("to a").range.tolist() == model.actuator("to a").ctrlrange.tolist() == [-1.0, 1.0]
    assert model.joint("to b").range == pytest.approx([0.5, 0.5], abs=1e-6)
    assert model.jnt_limited.tolist() == [1, 1, 0]


def test_spherical_joint_is_ball_and_other_multi_axis_joints_are_fixed() -> None:
    joints = [
        Joint(kind, kind, "root", f"after {kind}")
        for kind in (JointType.SPHERICAL, JointType.PLANAR, JointType.FLOATING, JointType.FIXED)
    ]
    model = build_robot(of_joints(*joints)).model
    assert model.jnt_type.tolist() == [mujoco.mjtJoint.mjJNT_BALL]
    assert model.nu == 0


@pytest.mark.parametrize("name", ["world", BASE_BODY, "cellwright link world"])
def test_link_with_reserved_name_is_built(name: str) -> None:
    config = of_joints(Joint("j", FIXED, name, "arm", Pose((0.0, 0.0, 1.0))), base_pose=PLACE)
    data = forward(build_robot(config), {})
    assert body_pose(data, name).position == pytest.approx(PLACE.position)
    assert body_of("arm") == "arm"


def test_chain_of_400_links_is_built() -> None:
    joints = [hinge(f"link {k + 1}", f"link {k}") for k in range(400)]
    data = forward(build_robot(of_joints(*joints)), {})
    assert body_pose(data, "link 400").position[2] == pytest.approx(0.3 * 400)


def test_engine_refusal_is_reported_in_one_line() -> None:
    with pytest.raises(
        DescriptionError, match=r"^robot.urdf: the engine cannot build this robot: .*repeated name"
    ) as raised:
        build_robot(of_joints(hinge("a", name="twice"), hinge("b", name="twice")))
    assert "\n" not in str(raised.value)
