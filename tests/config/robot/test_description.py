"""Published text of a URDF: ROS's own parser accepts it, and reads the robot that was read here."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings

from cellwright.config.models.model import ModelShape
from cellwright.config.robot.description import description, in_first_version
from cellwright.config.robot.model import Joint, JointType, Link, RobotModel, link_poses
from cellwright.config.robot.robots import bundled, find_robot, load_robot
from cellwright.config.robot.urdf import read_urdf
from cellwright.config.robot.urdf_file import read_text
from cellwright.config.robot.urdf_writer import write_urdf
from cellwright.util.errors import DescriptionError
from cellwright.util.pose import Pose
from tests.config.robot import small_robot, test_against_pybullet, test_urdf_damage, torso_robot
from tests.config.robot.oracle import pose_distance
from tests.support.urdfdom import complaints

DOCS = Path(__file__).parents[3] / "docs"
LINKS = '<link name="a"/><link name="b"/>'
BOX = '<geometry><box size="1 1 1"/></geometry>'


def ignore(_line: str) -> None:
    pass


def published(path: Path) -> str:
    return description(read_text(path), read_urdf(path, warn=ignore), path)


def joint(inside: str = "", kind: str = "revolute", limit: str = 'lower="-1" upper="1" effort="1" velocity="1"') -> str:
    return f'<joint name="j" type="{kind}"><parent link="a"/><child link="b"/>{inside}<limit {limit}/></joint>'


def robot(*elements: str, attributes: str = 'name="r"') -> str:
    return f"<robot {attributes}>{''.join(elements)}</robot>"


def link(inside: str) -> str:
    return f'<link name="a">{inside}</link>'


TOLERATED = {
    "robot without name": robot(LINKS, joint(), attributes=""),
    "version 1.2": robot(LINKS, joint(), attributes='name="r" version="1.2"'),
    "version 1": robot(LINKS, joint(), attributes='name="r" version="1"'),
    "limit without effort": robot(LINKS, joint(limit='lower="0" upper="1" velocity="1"')),
    "limit without velocity": robot(LINKS, joint(limit='lower="0" upper="1" effort="1"')),
    "continuous with empty limit": robot(LINKS, joint(kind="continuous", limit="")),
    "infinite limits": robot(LINKS, joint(limit='lower="-inf" upper="1e999" effort="inf" velocity="Infinity"')),
    "limit with stray dot": robot(LINKS, joint(limit='lower="-1.57." upper="1" effort="1" velocity="1"')),
    "spherical joint": robot(LINKS, joint(kind="spherical")),
    "fixed joint with broken axis and limit": robot(LINKS, joint('<axis xyz=""/>', "fixed", 'lower="x"')),
    "quaternion": robot(LINKS, joint('<origin xyz="1 2 3" quat_xyzw="0 0 0.6 0.8"/>')),
    "commas": robot(LINKS, joint('<origin xyz="0.5, 0.25, 0.125" rpy="1,2,3"/>')),
    "four numbers": robot(LINKS, joint('<origin xyz="1 2 3 4"/>')),
    "other digits": robot(LINKS, joint('<origin xyz="\u0661 2 3"/>')),
    "empty dynamics": robot(LINKS, joint('<dynamics/><safety_controller/><calibration rising="x"/>')),
    "broken dynamics": robot(LINKS, joint('<dynamics damping="x"/><safety_controller k_velocity=""/>')),
    "blanks around names": robot(LINKS, joint().replace('"j"', '" j "').replace('"b"', '" b"')),
    "blanks around type": robot(LINKS, joint().replace('"revolute"', '" revolute "')),
    "capsule": robot(link('<visual><origin xyz="0 0 1" rpy="1 0 0"/><geometry><capsule radius="1" length="2"/>'
                          '</geometry><material name="m"><color rgba="1 0 0 1"/></material></visual>')),
    "unknown shape": robot(link("<visual><geometry><plane/></geometry></visual><collision/>")),
    "unknown shape before a known one": robot(link('<visual><geometry><foo/><box size="1 1 1"/></geometry></visual>')),
    "shape of size 0": robot(link('<visual><geometry><box size="0 1 1"/></geometry></visual>')),
    "one factor for a mesh": robot(link('<visual><geometry><mesh filename="a.dae" scale="2"/></geometry></visual>')),
    "mass alone": robot(link('<inertial><mass value="1"/></inertial>')),
    "part of an inertia": robot(link('<inertial><mass value="1"/><inertia ixx="1"/></inertial>')),
    "mass with comma": robot(link('<inertial><origin xyz="0, 0, 1"/><mass value="1"/><inertia ixx="1"/></inertial>')),
    "repeated material": robot('<material name="m"><color rgba="1 1 1 1"/></material>' * 2, link("")),
    "material without name": robot('<material><color rgba="1 1 1 1"/></material>', link("")),
    "material without colour": robot('<material name="m"/>', link("")),
    "colour above 1": robot(link(f'<visual>{BOX}<material name="m"><color rgba="255 0 0 1"/></material></visual>')),
    "colour without name": robot(link(f'<visual>{BOX}<material><color rgba="1, 0, 0, 1"/></material></visual>')),
    "undeclared prefix": robot(LINKS, joint(), "<drake:joint/>"),
    "comment with dashes": robot("<!-- a -- b --->", LINKS, joint()),
    "control byte": robot("\x1a", LINKS, joint()),
    "document of other programs": robot(LINKS, joint(), '<gazebo reference="a"><mu> 1 </mu>&amp;</gazebo>'),
}  # fmt: skip


@pytest.mark.urdfdom
@pytest.mark.parametrize("text", TOLERATED.values(), ids=TOLERATED)
def test_ros_parser_accepts_what_the_reader_tolerates(tmp_path: Path, text: str) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    assert complaints(published(path)) == []


@pytest.mark.urdfdom
def test_ros_parser_accepts_bundled_robots_and_examples(tmp_path: Path) -> None:
    paths = [load_robot(name, ignore).urdf_path for name in bundled()]
    paths += [path for path in (DOCS / "examples").rglob("*.urdf") if "flange" not in path.name]
    for number, text in enumerate((small_robot.urdf(), torso_robot.urdf(), test_urdf_damage.WHOLE)):
        paths.append(tmp_path / f"robot{number}.urdf")
        paths[-1].write_text(text)
    assert len(paths) >= 6
    for path in paths:
        assert complaints(published(path)) == [], path


@pytest.mark.urdfdom
@pytest.mark.slow
def test_ros_parser_accepts_robots_of_pybullet() -> None:
    data = Path(pytest.importorskip("pybullet_data").getDataPath())
    paths = [path for path in sorted(data.rglob("*.urdf")) if test_against_pybullet.is_chosen(path)]
    assert len(paths) > 100
    for path in paths:
        if path.name not in test_against_pybullet.REFUSED_BY_BOTH:
            assert complaints(published(path)) == [], path


def equal_as_read(robot: RobotModel, again: RobotModel) -> list[str]:
    """Return the differences in joints and places between a robot and its published text, read again."""
    found = []
    for one, other in zip(robot.joints, again.joints, strict=True):
        kind = JointType.FIXED if one.type is JointType.SPHERICAL else one.type
        same = replace(one, origin=other.origin, axis=other.axis, type=other.type)
        if (
            other.type is not kind
            or same != other
            or math.dist(one.axis, other.axis) > 1e-9 * one.is_driven + 2 * (one.type is JointType.SPHERICAL)
        ):
            found.append(one.name)
    positions = {joint.name: 0.5 for joint in robot.driven}
    places, places_again = link_poses(robot, positions), link_poses(again, positions)
    return found + [name for name, pose in places.items() if pose_distance(pose, places_again[name]) > 1e-7]


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(text=test_urdf_damage.damaged())
def test_published_text_describes_the_robot_that_was_read(tmp_path: Path, text: str) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(text, "utf-8")
    try:
        robot = read_urdf(path, warn=ignore)
    except DescriptionError:
        return
    text = description(read_text(path), robot, path)
    path.write_text(text, "utf-8")
    assert equal_as_read(robot, read_urdf(path, warn=ignore)) == []


@pytest.mark.urdfdom
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(text=test_urdf_damage.damaged())
def test_ros_parser_accepts_damaged_robots_that_the_reader_accepts(tmp_path: Path, text: str) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(text, "utf-8")
    try:
        found = published(path)
    except DescriptionError:
        return
    assert complaints(found) == []


def test_content_of_other_programs_stays_in_published_text(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(robot(LINKS, joint(), '<gazebo reference="a"><mu> 1 </mu>&amp;</gazebo>'))
    assert '<gazebo reference="a"><mu> 1 </mu>&amp;</gazebo>' in published(path)


def test_quaternion_becomes_roll_pitch_yaw(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(robot(LINKS, joint('<origin xyz="1 2 3" quat_xyzw="0 0 0.6 0.8"/>')))
    again = tmp_path / "again.urdf"
    again.write_text(published(path))
    assert "quat" not in again.read_text()
    found = read_urdf(again, warn=ignore).joint("j").origin
    assert found.position == (1.0, 2.0, 3.0)
    assert found.rpy == pytest.approx((0.0, 0.0, 2 * math.atan2(0.6, 0.8)))


def test_capsule_becomes_cylinder_between_spheres_of_same_extent(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(robot(link('<collision><origin xyz="0 0 1"/><geometry><capsule radius="0.5" length="2"/></geometry>'
                               "</collision>")))  # fmt: skip
    again = tmp_path / "again.urdf"
    again.write_text(published(path))
    shapes = read_urdf(again, warn=ignore).links["a"].shapes
    assert sorted((shape.kind, shape.pose.position[2]) for shape in shapes) == [
        ("cylinder", 1.0), ("sphere", 0.0), ("sphere", 2.0),
    ]  # fmt: skip


def test_urdf_in_first_version_has_the_same_poses_and_no_newer_forms(tmp_path: Path) -> None:
    slanted = Pose.from_rpy((1.0, 2.0, 3.0), (0.3, math.pi / 2 - 1e-6, -0.4))
    links = {name: Link(name, shapes=(ModelShape("capsule", (0.1, 0.4, 0.0), slanted),)) for name in ("a", "b")}
    robot = RobotModel("r", "a", links, (Joint("j", JointType.FIXED, "a", "b", slanted),))
    root = ET.fromstring(write_urdf(robot))
    in_first_version(root)
    text = ET.tostring(root, encoding="unicode")
    assert not any(word in text for word in ("quat", "capsule", "version"))
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    assert complaints(text) == []
    found = read_urdf(path, warn=lambda _line: None)
    assert pose_distance(link_poses(found, {})["b"], slanted) < 1e-9
    assert [shape.kind for shape in found.links["a"].shapes if shape.is_touched] == ["cylinder", "sphere", "sphere"]


def test_text_that_is_no_longer_xml_is_refused(tmp_path: Path) -> None:
    model = load_robot(find_robot("tandem"), ignore).robot
    with pytest.raises(DescriptionError, match=r"robot\.urdf:1: invalid XML"):
        description("<robot", model, tmp_path / "robot.urdf")
