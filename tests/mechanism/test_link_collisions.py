"""Pairs of links that need no check: joined ones, always near, never near, and contacts that random postures miss."""

from itertools import pairwise
from pathlib import Path

import pytest

from cellwright.config.models.model import ModelShape
from cellwright.config.robot.model import Joint, JointType, Limits, Link, RobotModel
from cellwright.mechanism.link_collisions import CLEARANCE, SAMPLES, Reason, unchecked_pairs
from cellwright.util.pose import Pose, Vector3

REVOLUTE, PRISMATIC, FIXED = JointType.REVOLUTE, JointType.PRISMATIC, JointType.FIXED
BALL = ModelShape("sphere", (0.02, 0.0, 0.0))


def robot(*joints: Joint, **shapes: ModelShape | None) -> RobotModel:
    """Return a robot whose links have these shapes; the first is its root."""
    links = {name: Link(name, shapes=() if shape is None else (shape,)) for name, shape in shapes.items()}
    return RobotModel("r", next(iter(links)), links, joints)


def joint(
    parent: str,
    child: str,
    place: Vector3,
    axis: Vector3 = (0.0, 0.0, 1.0),
    *,
    kind: JointType = REVOLUTE,
    end: float = 3.0,
) -> Joint:
    return Joint(f"{parent}-{child}", kind, parent, child, Pose(place), axis, Limits(-end, end))


def box(x: float, y: float, z: float, place: Vector3 = (0.0, 0.0, 0.0)) -> ModelShape:
    return ModelShape("box", (x, y, z), Pose(place))


SMALL = box(0.1, 0.1, 0.1)
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def test_links_that_a_joint_joins_are_adjacent() -> None:
    folding = robot(
        joint("a", "b", (0.2, 0.0, 0.0)), a=box(1.0, 0.1, 0.1, (-0.5, 0.0, 0.0)), b=box(1.0, 0.1, 0.1, (0.6, 0.0, 0.0))
    )
    assert unchecked_pairs(folding) == {("a", "b"): Reason.ADJACENT}


def test_links_with_bare_ones_between_are_adjacent_and_others_are_not() -> None:
    chain = [joint("a", "b", X), joint("b", "c", X, kind=FIXED), joint("c", "d", X, X)]
    assert unchecked_pairs(robot(*chain, a=SMALL, b=None, c=SMALL, d=SMALL)) == {
        ("a", "c"): Reason.ADJACENT,
        ("a", "d"): Reason.NEVER,
        ("c", "d"): Reason.ADJACENT,
    }


def test_links_fixed_to_each_other_are_adjacent() -> None:
    assert unchecked_pairs(robot(joint("a", "b", X, kind=FIXED), a=SMALL, b=SMALL)) == {("a", "b"): Reason.ADJACENT}


def test_what_stands_around_a_robot_is_not_adjacent_to_its_first_moving_link() -> None:
    joints = [joint("world", "rod", (0.0, 0.0, 0.0)), joint("world", "wall", (0.6, 0.0, 0.0), kind=FIXED)]
    rod = box(1.0, 0.05, 0.05, (0.5, 0.0, 0.0))
    assert unchecked_pairs(robot(*joints, world=None, rod=rod, wall=SMALL)) == {}
    far = [joints[0], joint("world", "wall", (2.0, 0.0, 0.0), kind=FIXED)]
    assert unchecked_pairs(robot(*far, world=None, rod=rod, wall=SMALL)) == {("rod", "wall"): Reason.NEVER}


def test_links_that_always_overlap_without_a_joint_between_them_are_not_checked() -> None:
    chain = [joint("a", "b", (0.0, 0.0, 0.0)), joint("b", "c", (0.0, 0.0, 0.0), X)]
    assert unchecked_pairs(robot(*chain, a=box(1.0, 1.0, 1.0), b=None, c=SMALL)) == {("a", "c"): Reason.ALWAYS}


@pytest.mark.parametrize(("gap", "found"), [(CLEARANCE - 0.001, None), (CLEARANCE + 0.01, Reason.NEVER)])
def test_pair_that_comes_nearer_than_the_clearance_is_checked(gap: float, found: Reason | None) -> None:
    slides = [
        joint("a", "b", (0.0, 0.0, 0.0), X, kind=PRISMATIC),
        joint("b", "c", (0.0, 0.0, 0.04 + gap), Y, kind=PRISMATIC),
    ]
    assert unchecked_pairs(robot(*slides, a=BALL, b=None, c=BALL)).get(("a", "c")) is found


def test_contact_in_a_share_of_a_ten_thousandth_of_all_postures_is_found() -> None:
    slides = [
        joint(*links, (0.0, 0.0, 0.0), axis, kind=PRISMATIC, end=1.0)
        for links, axis in ((("a", "b"), X), (("b", "c"), Y), (("c", "d"), Z))
    ]
    share = 4 / 3 * 3.1416 * (0.04 + CLEARANCE / 2) ** 3 / 2**3
    assert share * SAMPLES < 0.2, "random postures do not find it"
    assert unchecked_pairs(robot(*slides, a=BALL, b=None, c=None, d=BALL)) == {}


def test_arms_beside_each_other_are_checked_where_both_reach() -> None:
    """Their rods meet only if both point at each other."""
    rod = box(1.0, 0.02, 0.02, (0.5, 0.0, 0.0))
    arms = [joint("world", name, (place, 0.0, 0.0)) for name, place in (("left", 0.0), ("right", 1.9), ("far", 9.0))]
    found = unchecked_pairs(robot(*arms, world=None, left=rod, right=rod, far=rod))
    assert found == {("left", "far"): Reason.NEVER, ("right", "far"): Reason.NEVER}


def test_robot_with_many_joints_is_sampled() -> None:
    names = [f"link{number}" for number in range(30)]
    chain = [joint(one, other, (0.3, 0.0, 0.0)) for one, other in pairwise(names)]
    shapes: dict[str, ModelShape | None] = dict.fromkeys(names)
    assert unchecked_pairs(robot(*chain, **{**shapes, "link0": SMALL, "link29": SMALL})) == {}


def test_same_robot_gives_same_pairs_with_progress_to_the_end() -> None:
    chain = [joint("a", "b", (0.3, 0.0, 0.0)), joint("b", "c", (0.3, 0.0, 0.0), Y), joint("c", "d", (0.3, 0.0, 0.0), X)]
    shapes = {name: box(0.1, 0.1, 0.1, (0.1, 0.0, 0.0)) for name in "abcd"}
    shares: list[float] = []
    first, second = (unchecked_pairs(robot(*chain, **shapes), shares.append) for _ in range(2))
    assert list(first.items()) == list(second.items())
    assert shares[-1] == 1.0
    assert shares[:6] == sorted(shares[:6])


def test_mesh_counts_as_its_hull(tmp_path: Path) -> None:
    path = tmp_path / "corner.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n")
    corner = ModelShape("mesh", (1.0, 1.0, 1.0), mesh=path)
    chain = [joint("a", "b", (0.3, 0.3, 0.2), Z, end=0.1), joint("b", "c", (0.0, 0.0, 0.0), X, end=0.1)]
    assert unchecked_pairs(robot(*chain, a=corner, b=None, c=BALL)) == {("a", "c"): Reason.ALWAYS}
