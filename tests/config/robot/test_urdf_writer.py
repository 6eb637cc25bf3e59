import math
from pathlib import Path

import pytest

from cellwright.config.models.model import ModelShape
from cellwright.config.robot.description import description
from cellwright.config.robot.model import JointType, RobotModel, link_poses
from cellwright.config.robot.robots import bundled, load_robot
from cellwright.config.robot.urdf import read_urdf
from cellwright.config.robot.urdf_writer import write_urdf
from tests.config.robot.mjcf_robots import menagerie, quiet, rotation, with_small_meshes, write

EVERY_KIND = (
    '<worldbody><body name="base"><body name="a"><joint name="turn" pos="1 2 3" axis="1 1 0" range="-1 2" '
    'actuatorfrcrange="-3 3"/><joint name="spin"/><geom type="box" size=".1 .2 .3" rgba="1 0 0 1"/>'
    '<body name="b"><joint name="slide" type="slide" ref="1"/><geom type="capsule" size=".1 .2"/>'
    '<geom type="cylinder" size=".1 .2" group="3"/></body><body><joint type="ball"/><geom size=".1"/></body>'
    '</body></body></worldbody><equality><joint joint1="slide" joint2="turn" polycoef="0 2 0 0 0"/></equality>'
)


def again(robot: RobotModel, folder: Path) -> RobotModel:
    path = folder / "again.urdf"
    path.write_text(write_urdf(robot), encoding="utf-8")
    return read_urdf(path, warn=lambda _line: None)


def parts(robot: RobotModel, *, seen: bool) -> list[tuple[str, ModelShape]]:
    """Return the shapes for one purpose, without what the other purpose alone has."""
    return [
        (link.name, ModelShape(shape.kind, shape.size, shape.pose, shape.colour if seen else None, mesh=shape.mesh))
        for link in robot.links.values()
        for shape in link.shapes
        if (shape.is_seen if seen else shape.is_touched)
    ]


def assert_same(robot: RobotModel, found: RobotModel) -> None:
    assert (found.name, found.root, found.written) == (robot.name, robot.root, robot.written)
    assert [(link.name, link.inertial and link.inertial.mass) for link in found.links.values()] == [
        (link.name, link.inertial and link.inertial.mass) for link in robot.links.values()
    ]
    for one, other in zip(robot.joints, found.joints, strict=True):
        assert (one.name, one.type, one.parent, one.child) == (other.name, other.type, other.parent, other.child)
        assert (one.limits, one.mimic) == (other.limits, other.mimic)
        assert math.dist(one.axis, other.axis) < 1e-12
    positions = {joint.name: 0.4 for joint in robot.driven if joint.mimic is None}
    poses, poses_again = link_poses(robot, positions), link_poses(found, positions)
    for name, pose in poses.items():
        assert math.dist(pose.position, poses_again[name].position) < 1e-9
        assert abs(rotation(pose) - rotation(poses_again[name])).max() < 1e-9


def test_robot_of_every_kind_of_joint_and_shape_is_read_again(tmp_path: Path) -> None:
    robot = quiet(write(tmp_path, EVERY_KIND)).model
    found = again(robot, tmp_path)
    assert_same(robot, found)
    assert {joint.type for joint in found.joints} >= {JointType.SPHERICAL, JointType.PRISMATIC, JointType.CONTINUOUS}
    for seen in (True, False):
        assert [(name, shape.kind, shape.size) for name, shape in parts(found, seen=seen)] == [
            (name, shape.kind, shape.size) for name, shape in parts(robot, seen=seen)
        ]


def test_arm_from_mjcf_is_read_again_with_its_meshes(tmp_path: Path) -> None:
    robot = quiet(with_small_meshes(menagerie("universal_robots_ur5e/ur5e.xml"), tmp_path)).model
    found = again(robot, tmp_path)
    assert_same(robot, found)
    assert {(name, shape.mesh) for name, shape in parts(found, seen=True)} == {
        (name, shape.mesh and shape.mesh.resolve()) for name, shape in parts(robot, seen=True)
    }


@pytest.mark.parametrize("name", bundled())
def test_bundled_robots_are_read_again(name: str, tmp_path: Path) -> None:
    robot = load_robot(name, lambda _line: None).robot
    path = tmp_path / "again.urdf"
    path.write_text(write_urdf(robot), encoding="utf-8")
    assert_same(robot, read_urdf(path, warn=lambda _line: None))


def test_text_for_ros_has_no_quaternions_and_no_capsules(tmp_path: Path) -> None:
    path = write(tmp_path, EVERY_KIND)
    robot = quiet(path).model
    text = description(write_urdf(robot), robot, path)
    assert "quat" not in text
    assert "capsule" not in text
    assert "inf" not in text
    again_path = tmp_path / "again.urdf"
    again_path.write_text(text, encoding="utf-8")
    assert list(read_urdf(again_path, warn=lambda _line: None).links) == list(robot.links)
