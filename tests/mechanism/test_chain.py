"""Chains in the engine."""

import math
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.robot.model import Inertial, Joint, JointType, Limits, Link, RobotModel, link_poses
from cellwright.config.ur10 import UR10
from cellwright.mechanism.chain import add_chain, give_mass, inertia_along_link, range_of
from cellwright.util.pose import Pose

PLACE = Pose.from_rpy((0.4, -0.2, 0.7), (0.3, -0.5, 1.1))


def built(robot: RobotModel, **options: Any) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    spec.compiler.degree = False

    def fill(body: Any, _link: Link) -> None:
        give_mass(body, 1.0, (0.0, 0.0, 0.0), (0.1, 0.1, 0.1))

    add_chain(spec.worldbody, robot, fill, **options)
    return spec.compile()


def poses_in(model: mujoco.MjModel, positions: Mapping[str, float]) -> dict[str, Pose]:
    data = mujoco.MjData(model)
    for name, position in positions.items():
        data.joint(name).qpos[0] = position
    mujoco.mj_kinematics(model, data)
    found = {}
    for number in range(1, model.nbody):
        body = data.body(number)
        found[body.name] = Pose(tuple(body.xpos.tolist()), tuple(body.xquat.tolist()))
    return found


def assert_same(one: Pose, other: Pose) -> None:
    assert one.position == pytest.approx(other.position, abs=1e-12)
    assert abs(np.dot(one.quaternion, other.quaternion)) == pytest.approx(1.0, abs=1e-12)


@given(st.tuples(*[st.floats(-2.0, 2.0)] * 7))
def test_bodies_stand_where_the_description_says(values: tuple[float, ...]) -> None:
    positions = dict(zip((joint.name for joint in UR10.driven), values, strict=True))
    expected = link_poses(UR10, positions, PLACE)
    found = poses_in(built(UR10, pose=PLACE), positions)
    assert found.keys() == expected.keys()
    for link, pose in expected.items():
        assert_same(found[link], pose)


def test_chain_that_hangs_by_another_link_moves_the_same_way() -> None:
    positions = {joint.name: 0.1 * number for number, joint in enumerate(UR10.driven, 1)}
    expected = link_poses(UR10, positions)
    found = poses_in(built(UR10, first="forearm_link", pose=expected["forearm_link"]), positions)
    for link, pose in expected.items():
        assert_same(found[link], pose)


def test_names_of_bodies_are_the_callers() -> None:
    model = built(UR10, body_of=lambda link: f"left {link}")
    assert model.body("left forearm_link").id > 0


def test_inertia_is_turned_into_the_frame_of_the_link() -> None:
    turned = Inertial(1.0, Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, math.pi / 2)), (1.0, 2.0, 2.5, 0.0, 0.0, 0.0))
    assert inertia_along_link(turned) == pytest.approx((2.0, 1.0, 2.5, 0.0, 0.0, 0.0))


def test_range_of_a_joint_without_limits_is_none_and_of_equal_ones_not_empty() -> None:
    assert range_of(Joint("free", JointType.CONTINUOUS, "a", "b")) == (False, (0.0, 0.0))
    limited, (lower, upper) = range_of(Joint("stuck", JointType.REVOLUTE, "a", "b", limits=Limits(0.5, 0.5)))
    assert limited
    assert lower < 0.5 < upper
