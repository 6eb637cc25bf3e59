"""Joints: types, axes, limits as in PyBullet, and mimic joints."""

import math
from pathlib import Path

import pytest

from cellwright.config.robot.model import Joint, JointType, Limits, Mimic
from tests.config.robot.test_urdf import LIMIT, joint, read, read_errors, robot

INF = math.inf


def read_one(folder: Path, inside: str, kind: str = "revolute") -> tuple[Joint, list[str]]:
    found, warnings = read(folder, robot(joint("j", "a", "b", inside, kind), links="ab"))
    return found.joints[0], [warning.removeprefix("robot.urdf:") for warning in warnings]


@pytest.mark.parametrize(
    ("written", "kind", "limits"),
    [
        ('lower="-1" upper="2" effort="3" velocity="4"', "revolute", Limits(-1.0, 2.0, 3.0, 4.0)),
        ('lower="-1" upper="2" effort="3" velocity="4"', "prismatic", Limits(-1.0, 2.0, 3.0, 4.0)),
        ('lower="-1" upper="2" effort="3" velocity="4"', "continuous", Limits(-INF, INF, 3.0, 4.0)),
        ('lower="1" upper="-1" effort="3" velocity="4"', "revolute", Limits(-INF, INF, 3.0, 4.0)),
        ('lower="0" upper="0" effort="3" velocity="4"', "revolute", Limits(0.0, 0.0, 3.0, 4.0)),
        ('effort="3" velocity="4"', "revolute", Limits(-INF, INF, 3.0, 4.0)),
        ('upper="1" effort="3" velocity="4"', "revolute", Limits(0.0, 1.0, 3.0, 4.0)),
        ('lower="-inf" upper="1e16" effort="1e20" velocity="inf"', "revolute", Limits(-INF, INF, INF, INF)),
        ('lower="-1" upper="2" effort="0" velocity="0"', "revolute", Limits(-1.0, 2.0, INF, INF)),
        ('lower="-1" upper="2" effort="-3" velocity="-4"', "revolute", Limits(-1.0, 2.0, 3.0, 4.0)),
    ],
)
def test_joint_limits_are_as_in_pybullet(tmp_path: Path, written: str, kind: str, limits: Limits) -> None:
    assert read_one(tmp_path, f"<limit {written}/>", kind)[0].limits == limits


def test_missing_efforts_and_velocities_give_one_warning_each(tmp_path: Path) -> None:
    joints = [joint(f"j{child}", "a", child, '<limit lower="0" upper="1"/>') for child in "bcdef"]
    _, warnings = read(tmp_path, robot(*joints, links="abcdef"))
    assert warnings == [
        f"robot.urdf:1: 5 joints have no {kind} limit, or 0 (jb, jc, jd, and 2 more); treated as unlimited"
        for kind in ("velocity", "effort")
    ]


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_revolute_or_prismatic_joint_without_limit_is_refused(tmp_path: Path, kind: str) -> None:
    expected = f'robot.urdf:4: joint[j]: a {kind} joint requires <limit lower="…" upper="…" effort="…" velocity="…"/>'
    assert read_errors(tmp_path, robot(joint("j", "a", "b", "", kind), links="ab")) == [expected]


def test_joint_axis_becomes_unit_vector(tmp_path: Path) -> None:
    read_joint, warnings = read_one(tmp_path, f'<axis xyz="0 3 4"/>{LIMIT}')
    assert (read_joint.axis, warnings) == ((0.0, 0.6, 0.8), [])
    assert read_one(tmp_path, LIMIT)[0].axis == (1.0, 0.0, 0.0)
    assert read_one(tmp_path, '<axis xyz="0 0 1"/>', "spherical")[0].axis == (0.0, 0.0, 0.0)
    assert read_one(tmp_path, '<axis xyz="0 0 1"/>', "fixed")[0].axis == (0.0, 0.0, 0.0)
    assert read_one(tmp_path, '<axis xyz="0 0 2"/>', "planar")[0].axis == (0.0, 0.0, 1.0)


def test_prismatic_axis_length_is_ignored_with_warning(tmp_path: Path) -> None:
    slide, warnings = read_one(tmp_path, f'<axis xyz="0 0 2"/>{LIMIT}', "prismatic")
    assert slide.axis == (0.0, 0.0, 1.0)
    assert warnings == [
        (
            "5: joint[j].axis: the axis must be a unit vector (got length 2); only its direction is used "
            "(PyBullet scales the motion by the length)"
        )
    ]


def test_floating_joint_becomes_fixed_with_warning(tmp_path: Path) -> None:
    held, warnings = read_one(tmp_path, "", "floating")
    assert held.type is JointType.FIXED
    assert warnings == ["4: joint[j]: a floating joint inside a robot is treated as fixed, as in PyBullet"]


@pytest.mark.parametrize(
    ("element", "message"),
    [
        ("<joint/>", "4: joint: the joint has no name"),
        (joint("j", "a", "b", kind="revolut"), "4: joint[j]: unknown joint type 'revolut'; did you mean revolute"),
        (
            '<joint name="j"><parent link="a"/><child link="b"/></joint>',
            (
                "4: joint[j]: the joint has no type "
                "(known: fixed, revolute, continuous, prismatic, spherical, planar, floating)"
            ),
        ),
        (
            '<joint name="j" type="fixed"><child link="b"/></joint>',
            '4: joint[j]: the joint requires <parent link="…"/>',
        ),
        (
            '<joint name="j" type="fixed"><parent link="a"/><child/></joint>',
            '4: joint[j].child: the joint requires <child link="…"/>',
        ),
        (joint("j", "a", "b") * 2, "6: joint[j]: duplicate joint name (first at robot.urdf:4); choose another"),
        (
            joint("j", "a", "b", f'<axis xyz="0 0 0"/>{LIMIT}'),
            "5: joint[j].axis: the axis has no direction; write a unit vector such as 0 0 1",
        ),
        (
            joint("j", "a", "b", '<limit lower="nan" upper="1"/>'),
            "5: joint[j].limit: lower must be a finite number (got 'nan')",
        ),
        (
            joint("j", "a", "b", f'<origin xyz="0 inf 0"/>{LIMIT}'),
            "5: joint[j].origin: xyz must be 3 finite numbers with blanks between them (got '0 inf 0')",
        ),
        (
            joint("j", "a", "b", f'<origin xyz="0 1e7 0"/>{LIMIT}'),
            "5: joint[j].origin: coordinates must be within ±1e+06 [m; rad]",
        ),
    ],
)
def test_invalid_joints_are_refused_with_place(tmp_path: Path, element: str, message: str) -> None:
    assert f"robot.urdf:{message}" in read_errors(tmp_path, robot(element, links="ab"))


def follower(name: str, child: str, leader: str, figures: str = "", kind: str = "revolute") -> str:
    wide = '<limit lower="-9" upper="9" effort="3" velocity="4"/>'
    return joint(name, "a", child, f'{wide}<mimic joint="{leader}" {figures}/>', kind)


def test_mimic_chain_is_resolved_to_its_first_joint(tmp_path: Path) -> None:
    text = robot(
        follower("third", "d", "second", 'multiplier="-1" offset="0.5"'),
        joint("first", "a", "b"),
        follower("second", "c", "first", 'multiplier="2" offset="0.1"'),
        links="abcd",
    )
    found, warnings = read(tmp_path, text)
    assert found.joint("second").mimic == Mimic("first", 2.0, 0.1)
    assert found.joint("third").mimic == Mimic("first", -2.0, 0.4)
    assert found.joint("first").mimic is None
    assert warnings == []


@pytest.mark.parametrize(
    ("first", "second", "message"),
    [
        (follower("one", "b", "on"), "", "mimics the unknown joint 'on'; did you mean one"),
        (follower("one", "b", "one"), "", "joints mimic each other in a loop: one"),
        (follower("one", "b", "two"), follower("two", "c", "one"), "joints mimic each other in a loop: one, two"),
        (follower("one", "b", "two"), joint("two", "a", "c", "", "fixed"), "mimics 'two', a fixed joint"),
        (
            follower("one", "b", "two", 'multiplier="1e7"'),
            joint("two", "a", "c"),
            "mimics 'two' with a multiplier or offset beyond 1e+06",
        ),
        (joint("one", "a", "b", f"{LIMIT}<mimic/>"), "", '<mimic> requires joint="…", the joint to follow'),
        (follower("one", "b", "one", 'multiplier="much"'), "", "multiplier must be a finite number (got 'much')"),
    ],
)
def test_invalid_mimics_are_refused_with_reason(tmp_path: Path, first: str, second: str, message: str) -> None:
    problems = read_errors(tmp_path, robot(first, second, links="abc" if second else "ab"))
    assert any(problem.startswith("robot.urdf:") and problem.endswith(message) for problem in problems), problems


def limited(lower: float, upper: float, figures: str = 'multiplier="-1"') -> str:
    """Return a robot whose second joint follows the first one, from 0 to 0.8, with limits of its own."""
    first = joint("j", "a", "b", '<limit lower="0" upper="0.8" effort="3" velocity="4"/>')
    own = f'<limit lower="{lower}" upper="{upper}" effort="3" velocity="4"/>'
    return robot(first, joint("k", "a", "c", f'{own}<mimic joint="j" {figures}/>'), links="abc")


@pytest.mark.parametrize(("lower", "upper"), [(-0.8, 0.0), (-0.799, 0.0), (-1.0, 1.0), (1.0, -1.0)])
def test_follower_with_room_for_its_leader_is_read_silently(tmp_path: Path, lower: float, upper: float) -> None:
    assert read(tmp_path, limited(lower, upper))[1] == []


@pytest.mark.parametrize(
    ("lower", "upper", "effect"),
    [(0.0, 0.8, "it stands still"), (-0.5, 0.0, "it stops at its own limits"), (0.1, 0.2, "it stands still")],
)
def test_follower_that_cannot_follow_is_reported(tmp_path: Path, lower: float, upper: float, effect: str) -> None:
    found, warnings = read(tmp_path, limited(lower, upper))
    message = f"the follower's own limits allow {lower:g} to {upper:g}, and 'j' asks for -0.8 to 0; {effect}"
    assert warnings == [f"robot.urdf:8: joint[k].limit: {message}"]
    assert (found.joint("k").limits.lower, found.joint("k").limits.upper) == (lower, upper)


def test_follower_with_empty_range_follows_its_leader(tmp_path: Path) -> None:
    found, warnings = read(tmp_path, limited(0.0, 0.0, 'multiplier="-1" offset="0.25"'))
    limits = found.joint("k").limits
    assert limits.lower == pytest.approx(-0.55)
    assert (limits.upper, limits.effort) == (0.25, 3.0)
    message = "the follower's own limits allow no motion, and 'j' asks for -0.55 to 0.25"
    assert warnings == [f"robot.urdf:8: joint[k].limit: {message}; it follows without limits of its own"]


def test_follower_with_limits_of_unlimited_leader_is_reported(tmp_path: Path) -> None:
    wheel = joint("j", "a", "b", kind="continuous", inside="")
    text = robot(wheel, joint("k", "a", "c", f'{LIMIT}<mimic joint="j"/>'), links="abc")
    message = "the follower's own limits allow -1 to 2, and 'j' asks for any position; it stops at its own limits"
    assert f"robot.urdf:8: joint[k].limit: {message}" in read(tmp_path, text)[1]


@pytest.mark.parametrize(
    ("axis", "message"),
    [
        ("<axis/>", 'joint[j].axis: <axis> requires xyz, such as <axis xyz="0 0 1"/>'),
        ("<axis>0 0 1</axis>", 'joint[j].axis: <axis> requires xyz, such as <axis xyz="0 0 1"/>'),
        ('<axis xyz=""/>', "joint[j].axis: xyz must be 3 finite numbers with blanks between them (got '')"),
    ],
)
def test_axis_without_numbers_is_refused(tmp_path: Path, axis: str, message: str) -> None:
    assert f"robot.urdf:5: {message}" in read_errors(tmp_path, robot(joint("j", "a", "b", axis + LIMIT), links="ab"))


def test_mimic_of_fixed_joint_is_ignored_with_warning(tmp_path: Path) -> None:
    found, warnings = read(tmp_path, robot(joint("j", "a", "b"), follower("k", "c", "j", kind="fixed"), links="abc"))
    assert found.joint("k").mimic is None
    assert warnings == ["robot.urdf:8: joint[k].mimic: a fixed joint cannot follow another; <mimic> is ignored"]
