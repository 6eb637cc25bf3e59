"""Pairs of links that need no check: always near, never near, and contacts that random postures miss."""

import pytest

from cellwright.engine.link_collisions import SAMPLES, Reason, unchecked_pairs


def robot(*joints: str, **links: str) -> str:
    """Return a URDF whose links have these shapes."""
    shapes = "".join(
        f'<link name="{name}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
        f"</inertial>{f'<collision>{shape}</collision>' if shape else ''}</link>"
        for name, shape in links.items()
    )
    return f'<robot name="r">{shapes}{"".join(joints)}</robot>'


def joint(parent: str, child: str, place: str, axis: str = "0 0 1", *, kind: str = "revolute", end: float = 3.0) -> str:
    return (
        f'<joint name="{parent}-{child}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{place}"/><axis xyz="{axis}"/>'
        f'<limit lower="{-end}" upper="{end}" effort="1" velocity="1"/></joint>'
    )


def box(size: str, place: str = "0 0 0") -> str:
    return f'<origin xyz="{place}"/><geometry><box size="{size}"/></geometry>'


def test_links_that_overlap_at_their_joint_are_adjacent() -> None:
    urdf = robot(joint("a", "b", "0 0 1"), a=box("0.1 0.1 2"), b=box("0.1 0.1 2", "0 0 1"))
    assert unchecked_pairs(urdf) == {("a", "b"): Reason.ADJACENT}


def test_joined_links_that_touch_in_some_postures_are_checked() -> None:
    folding = robot(joint("a", "b", "0.2 0 0"), a=box("1 0.1 0.1", "-0.5 0 0"), b=box("1 0.1 0.1", "0.6 0 0"))
    assert unchecked_pairs(folding) == {}


def test_links_that_never_come_near_are_not_checked() -> None:
    chain = [joint("a", "b", "1 0 0"), joint("b", "c", "1 0 0", "1 0 0")]
    urdf = robot(*chain, a=box("0.1 0.1 0.1"), b="", c=box("0.1 0.1 0.1", "0.5 0 0"))
    assert unchecked_pairs(urdf) == {("a", "c"): Reason.NEVER}


def test_links_that_always_overlap_without_a_joint_between_them_are_not_checked() -> None:
    chain = [joint("a", "b", "0 0 0"), joint("b", "c", "0 0 0", "1 0 0")]
    assert unchecked_pairs(robot(*chain, a=box("1 1 1"), b="", c=box("0.1 0.1 0.1"))) == {("a", "c"): Reason.ALWAYS}


def test_links_fixed_to_each_other_are_adjacent() -> None:
    urdf = robot(joint("a", "b", "2 0 0", kind="fixed"), a=box("0.1 0.1 0.1"), b=box("0.1 0.1 0.1"))
    assert unchecked_pairs(urdf) == {("a", "b"): Reason.ADJACENT}


def test_contact_in_a_share_of_a_ten_thousandth_of_all_postures_is_found() -> None:
    ball = '<geometry><sphere radius="0.02"/></geometry>'
    slides = [
        joint("a", "b", "0 0 0", "1 0 0", kind="prismatic", end=1.0),
        joint("b", "c", "0 0 0", "0 1 0", kind="prismatic", end=1.0),
        joint("c", "d", "0 0 0", "0 0 1", kind="prismatic", end=1.0),
    ]
    share = 4 / 3 * 3.1416 * 0.045**3 / 2**3
    assert share * SAMPLES < 0.1, "random postures do not find it"
    assert unchecked_pairs(robot(*slides, a=ball, b="", c="", d=ball)) == {}


def test_same_urdf_gives_same_pairs() -> None:
    chain = [joint("a", "b", "0.3 0 0"), joint("b", "c", "0.3 0 0", "0 1 0"), joint("c", "d", "0.3 0 0", "1 0 0")]
    shapes = {name: box("0.1 0.1 0.1", "0.1 0 0") for name in "abcd"}
    first, second = (unchecked_pairs(robot(*chain, **shapes)) for _ in range(2))
    assert list(first.items()) == list(second.items())


def test_unreadable_urdf_is_refused() -> None:
    with pytest.raises(ValueError, match="joint"):
        unchecked_pairs(robot(joint("a", "nowhere", "0 0 0"), a=box("1 1 1")))
