"""Simple shapes for links that lost theirs."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.models.model import ModelShape
from cellwright.config.robot.model import Inertial, Joint, JointType, Link
from cellwright.config.robot.urdf_links import DENSITY, NEAR, Use, with_stand_ins
from cellwright.util.pose import Pose, Vector3

BOTH = frozenset(Use)
TOUCHED = ModelShape("box", (1.0, 1.0, 1.0), is_seen=False)
SEEN = ModelShape("sphere", (1.0, 0.0, 0.0), is_touched=False)


def joint_at(position: Vector3, parent: str = "arm", child: str = "hand") -> Joint:
    return Joint(f"{parent} {child}", JointType.FIXED, parent, child, Pose(position))


@given(end=st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda end: math.hypot(*end) > NEAR))
def test_stand_in_limb_spans_joint_to_joint(end: Vector3) -> None:
    (limb,) = with_stand_ins(Link("arm"), [joint_at(end)], BOTH).shapes
    radius, straight, _ = limb.size
    length = math.hypot(*end)
    assert limb.kind == "capsule"
    assert limb.is_seen
    assert limb.is_touched
    # its axis lies on the line between the joints, and it ends near both
    assert limb.pose.rotate((0.0, 0.0, length)) == pytest.approx(end, abs=1e-4)
    assert limb.pose.position == pytest.approx([value / 2 for value in end])
    assert length * 0.5 <= straight <= length
    assert 0.005 <= radius <= max(0.005, 0.3 * length)


def test_stand_in_limb_thickness_follows_from_mass() -> None:
    link = Link("arm", Inertial(math.pi * 0.05**2 * DENSITY * 0.4))
    (limb,) = with_stand_ins(link, [joint_at((0.0, 0.0, 0.4))], BOTH).shapes
    assert limb.size[0] == pytest.approx(0.05)


def test_stand_in_torso_has_limb_for_each_joint_away_from_origin() -> None:
    joints = [joint_at((0.0, y, 0.4), child=f"arm {y}") for y in (-0.2, 0.2)]
    joints += [joint_at((0.0, 0.0, 0.0), child="waist"), joint_at((0.0, 0.0, 0.3), "other", "head")]
    shapes = with_stand_ins(Link("arm"), joints, BOTH).shapes
    assert [shape.pose.position for shape in shapes] == [(0.0, -0.1, 0.2), (0.0, 0.1, 0.2)]


def test_stand_in_of_last_link_lies_around_centre_of_mass() -> None:
    (limb,) = with_stand_ins(Link("hand", Inertial(0.5, Pose((0.0, 0.0, 0.1)))), [joint_at((1.0, 0, 0))], BOTH).shapes
    assert (limb.kind, limb.pose.position) == ("capsule", (0.0, 0.0, 0.1))
    (ball,) = with_stand_ins(Link("hand", Inertial(0.5)), [joint_at((1.0, 0, 0))], BOTH).shapes
    assert ball.kind == "sphere"
    assert ball.size[0] == pytest.approx((0.5 * 3 / (4 * math.pi * DENSITY)) ** (1 / 3))
    (unknown,) = with_stand_ins(Link("hand"), [joint_at((0.1, 0, 0))], BOTH).shapes
    assert unknown.size[0] == pytest.approx(0.016)


@pytest.mark.parametrize(
    ("shapes", "lacking", "uses"),
    [
        ((TOUCHED,), {Use.SEEN}, [("box", True, True)]),  # collision shapes are drawn
        ((SEEN,), {Use.TOUCHED}, [("sphere", True, True)]),  # visual shapes collide
        ((TOUCHED, SEEN), {Use.SEEN}, [("box", False, True), ("sphere", True, False)]),  # nothing is missing
        ((SEEN,), {Use.SEEN}, [("sphere", True, False)]),
        ((), {Use.SEEN}, [("capsule", True, False)]),
        ((), {Use.TOUCHED}, [("capsule", False, True)]),
        ((), set(), []),
    ],
)
def test_existing_shapes_are_used_before_stand_ins(
    shapes: tuple[ModelShape, ...], lacking: set[Use], uses: list[tuple[str, bool, bool]]
) -> None:
    link = with_stand_ins(Link("arm", shapes=shapes), [joint_at((0.0, 0.0, 0.4))], lacking)
    assert [(shape.kind, shape.is_seen, shape.is_touched) for shape in link.shapes] == uses
