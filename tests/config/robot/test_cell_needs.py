"""Facts that a cell's arm needs and its description lacks: each is named with its place and the remedy."""

from dataclasses import replace
from pathlib import Path

import pytest

from cellwright.config.robot.cell_needs import missing_for_cell
from cellwright.config.robot.model import Limits, RobotModel
from cellwright.config.robot.urdf import read_urdf

LINKS = """
<link name="base"/>
<link name="arm"><inertial><mass value="2"/></inertial></link>
<link name="hand"/>
<link name="finger"><inertial><mass value="0.1"/></inertial></link>
"""
COMPLETE = """
<joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/>
<limit lower="-1" upper="1" effort="100" velocity="2"/></joint>
<joint name="flange" type="fixed"><parent link="arm"/><child link="hand"/></joint>
<joint name="grip" type="prismatic"><parent link="hand"/><child link="finger"/>
<limit lower="0" upper="0.1" effort="20" velocity="0.1"/></joint>
"""


def robot(folder: Path, joints: str = COMPLETE, links: str = LINKS) -> RobotModel:
    path = folder / "arm.urdf"
    path.write_text(f'<robot name="r">{links}{joints}</robot>')
    return read_urdf(path, warn=lambda _: None)


def lines(folder: Path, joints: str = COMPLETE, links: str = LINKS) -> list[str]:
    found = missing_for_cell(robot(folder, joints, links), folder / "arm.urdf")
    return [str(problem).removeprefix(f"{folder}/") for problem in found]


def test_complete_description_lacks_nothing(tmp_path: Path) -> None:
    assert lines(tmp_path) == []


@pytest.mark.parametrize(
    ("written", "instead", "expected"),
    [
        (
            'effort="100"',
            'effort="0"',
            (
                'arm.urdf:7: joint[shoulder]: the joint has no effort limit, or 0; write effort="…" in its <limit>, or '
                "`limits: {shoulder: {effort: …}}` in the arm's entry [N m]"
            ),
        ),
        (
            'velocity="0.1"',
            'velocity="inf"',
            (
                'arm.urdf:10: joint[grip]: the joint has no velocity limit, or 0; write velocity="…" in its <limit>, '
                "or `limits: {grip: {velocity: …}}` in the arm's entry [m/s]"
            ),
        ),
        (
            'lower="-1" upper="1"',
            "",
            (
                'arm.urdf:7: joint[shoulder]: the joint has no range; write lower="…" and upper="…" in its <limit>, or '
                "`limits: {shoulder: {lower: …, upper: …}}` in the arm's entry [rad]"
            ),
        ),
    ],
)
def test_missing_limit_is_named_with_place_and_remedy(
    tmp_path: Path, written: str, instead: str, expected: str
) -> None:
    assert lines(tmp_path, COMPLETE.replace(written, instead)) == [expected]


def test_missing_mass_is_named_at_its_link(tmp_path: Path) -> None:
    expected = "arm.urdf:3: link[arm]: what joint 'shoulder' moves has no mass; write <inertial> with its mass [kg]"
    for links in (LINKS.replace('value="2"', 'value="0"'), LINKS.replace('<inertial><mass value="2"/></inertial>', "")):
        assert lines(tmp_path, links=links) == [expected]


def test_mass_of_a_link_that_is_fixed_to_the_moved_one_counts(tmp_path: Path) -> None:
    mass = '<inertial><mass value="2"/></inertial>'
    links = LINKS.replace(mass, "").replace('<link name="hand"/>', f'<link name="hand">{mass}</link>')
    assert lines(tmp_path, links=links) == []


def test_joint_without_end_needs_no_range_and_a_follower_no_limits(tmp_path: Path) -> None:
    joints = COMPLETE.replace("revolute", "continuous").replace('lower="-1" upper="1"', "")
    assert lines(tmp_path, joints) == []
    grip = '<mimic joint="shoulder"/><limit lower="0" upper="0.1" effort="0" velocity="0"/>'
    assert lines(tmp_path, COMPLETE.replace('<limit lower="0" upper="0.1" effort="20" velocity="0.1"/>', grip)) == []


def test_limits_of_the_entry_and_a_choice_of_joints_are_what_counts(tmp_path: Path) -> None:
    without = robot(tmp_path, COMPLETE.replace('effort="100"', "").replace('effort="20"', ""))
    path = tmp_path / "arm.urdf"
    assert [problem.line for problem in missing_for_cell(without, path)] == [7, 10]
    assert [problem.line for problem in missing_for_cell(without, path, {"grip"})] == [10]
    given = tuple(replace(joint, limits=replace(joint.limits, effort=5.0)) for joint in without.joints)
    assert missing_for_cell(replace(without, joints=given), path) == ()


def test_robot_that_is_built_in_code_is_named_by_its_path(tmp_path: Path) -> None:
    found = robot(tmp_path)
    bare = tuple(replace(joint, definition=None, limits=Limits(-1, 1, 5)) for joint in found.joints)
    first = missing_for_cell(replace(found, joints=bare), Path("ur.py"))[0]
    assert str(first).startswith("ur.py: joint[shoulder]: the joint has no velocity limit")
