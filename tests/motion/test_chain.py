import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.config.robot.model import Joint, JointType, Limits, Link, Mimic, RobotModel, link_poses
from cellwright.config.ur10 import WRIST_3_T_TOOL
from cellwright.motion.chain import Chain, ChainArm, ChainJoint, chain_of
from cellwright.motion.solver import TURN_WEIGHT
from cellwright.util.errors import UnknownNameError, UsageError
from cellwright.util.pose import Pose
from tests.motion.arms import arm, robot, within

UR5 = robot("ur5")
UR5_CHAIN = chain_of(UR5, "tool0")
POSTURES = within(UR5_CHAIN, 6.0)


def on_rail() -> RobotModel:
    """Return a robot with a rail, an arm of two joints, and a finger beside its tip."""
    limits = Limits(-1.0, 1.0, velocity=0.5)
    joints = (
        Joint("rail", JointType.PRISMATIC, "world", "base", Pose((0.0, 0.0, 1.0)), (0.0, 1.0, 0.0), limits),
        Joint("pan", JointType.CONTINUOUS, "base", "post", Pose((0.0, 0.0, 0.2)), (0.0, 0.0, 1.0), limits),
        Joint("bend", JointType.REVOLUTE, "post", "hand", Pose((0.5, 0.0, 0.0)), (0.0, 1.0, 0.0), limits),
        Joint("mount", JointType.FIXED, "hand", "cup", Pose((0.1, 0.0, 0.0))),
        Joint("finger", JointType.PRISMATIC, "hand", "tip", Pose((0.2, 0.0, 0.0)), (1.0, 0.0, 0.0), limits),
        Joint("other", JointType.PRISMATIC, "hand", "tip2", mimic=Mimic("finger")),
    )
    names = ["world", *(joint.child for joint in joints)]
    return RobotModel("robot", "world", {name: Link(name) for name in names}, joints)


@given(POSTURES)
def test_links_are_those_of_the_description(q: tuple[float, ...]) -> None:
    expected = link_poses(UR5, {joint.name: value for joint, value in zip(UR5_CHAIN.joints, q, strict=True)})
    found = UR5_CHAIN.link_poses(q)
    assert list(found) == list(expected)
    for name, pose in expected.items():
        apart = pose.relative(found[name])
        assert math.hypot(*apart.position, *apart.quaternion[1:]) < 1e-12
    assert UR5_CHAIN.tool(q) == found["tool0"]


@given(POSTURES)
@settings(max_examples=30)
def test_jacobian_is_derivative_of_the_tool(q: tuple[float, ...]) -> None:
    step = 1e-6
    jacobian = UR5_CHAIN.jacobian(q)
    for number in range(6):
        before, after = (
            UR5_CHAIN.tool([*q[:number], q[number] + sign * step / 2, *q[number + 1 :]]) for sign in (-1, 1)
        )
        assert np.subtract(after.position, before.position) / step == pytest.approx(jacobian[:3, number], abs=1e-7)
        turned = Pose(quaternion=after.quaternion) @ Pose(quaternion=before.quaternion).inverse()
        assert np.multiply(turned.quaternion[1:], 2 / step) == pytest.approx(jacobian[3:, number], abs=1e-7)


def test_margin_vanishes_where_arm_is_stretched() -> None:
    assert UR5_CHAIN.margin((0.1, -1.0, 0.0, 0.4, 1.0, 0.3)).singular < 1e-9  # elbow
    assert UR5_CHAIN.margin((0.1, -1.0, 1.0, 0.4, 0.0, 0.3)).singular < 1e-9  # wrists 1 and 3 in line
    assert UR5_CHAIN.margin((0.1, -1.2, 1.6, -2.0, -1.57, 0.3)).singular == pytest.approx(0.131, abs=1e-3)


def test_margin_of_single_joints() -> None:
    slide = ChainJoint("slide", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), is_prismatic=True, lower=-1.0, upper=2.0)
    turn = ChainJoint("turn", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    assert Chain((slide,), Pose()).margin((1.5,)) == pytest.approx((1.0, 0.5))
    assert Chain((slide,), Pose()).margin((2.25,)).limit == -0.25
    assert Chain((turn,), Pose()).margin((9.0,)) == pytest.approx((TURN_WEIGHT, math.inf))


def test_chain_behind_a_rail_is_the_arm_alone() -> None:
    chain = chain_of(on_rail(), "cup", base="base", tip_T_tool=Pose((0.0, 0.0, 0.3)))
    assert [(joint.name, joint.lower, joint.upper, joint.speed) for joint in chain.joints] == [
        ("pan", -math.inf, math.inf, 0.5),
        ("bend", -1.0, 1.0, 0.5),
    ]
    assert chain.base_T_tool.position == pytest.approx((0.6, 0.0, 0.5))
    assert {name: link.joints for name, link in chain.links.items()} == {
        "base": 0, "post": 1, "hand": 2, "cup": 2, "tip": 2, "tip2": 2,
    }  # fmt: skip
    assert chain_of(on_rail(), "cup").joints[0].is_prismatic


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_tool_is_within_reach(rail: float, pan: float, bend: float) -> None:
    chain = chain_of(on_rail(), "cup")
    assert math.dist(chain.tool((rail, pan, bend)).position, chain.joints[0].point) <= chain.reach


@pytest.mark.parametrize(
    ("tip", "base", "text"),
    [("base", "cup", "behind base"), ("cup", "hand", "no joint moves"), ("tip2", None, "mimics finger")],
)
def test_bad_chain_is_refused(tip: str, base: str | None, text: str) -> None:
    with pytest.raises(UsageError, match=text):
        chain_of(on_rail(), tip, base=base)


def test_joint_that_no_program_drives_is_refused() -> None:
    ball = Joint("ball", JointType.SPHERICAL, "a", "b")
    with pytest.raises(UsageError, match="joint ball: each joint of an arm must be driven on its own"):
        chain_of(RobotModel("r", "a", {"a": Link("a"), "b": Link("b")}, (ball,)), "b")


def test_unknown_link_is_refused_by_name() -> None:
    with pytest.raises(UnknownNameError, match="tool0"):
        chain_of(UR5, "tool")


def test_arm_has_the_data_of_its_chain() -> None:
    chain, home = arm("ur10")
    made = ChainArm(chain, home)
    assert made.joints[0] == "shoulder_pan_joint"
    assert made.speed == (2.16, 2.16, 3.15, 3.2, 3.2, 3.2)
    assert made.upper == tuple(-each for each in made.lower)
    flange = made.links(home)["wrist_3_link"] @ WRIST_3_T_TOOL["tool0"]
    assert flange.position == pytest.approx(chain.tool(home).position)
    with pytest.raises(UsageError, match=r"6 positions \(got 2\)"):
        ChainArm(chain, (0.0, 1.0))
