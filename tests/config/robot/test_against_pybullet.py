"""Indices and poses of robots equal PyBullet's: for all files of its package, and for random trees."""

import hashlib
import os
import random
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import mujoco
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import RobotModel, link_poses
from cellwright.config.robot.urdf import read_urdf
from cellwright.robot.model import body_of, build_robot
from cellwright.util.errors import DescriptionError
from cellwright.util.pose import Pose
from tests.config.robot.oracle import Oracle, by_joint_name, differences, pose_distance

pytest.importorskip("pybullet", reason="PyBullet is not installed")
pybullet_data = pytest.importorskip("pybullet_data")

DATA = Path(pybullet_data.getDataPath())
ZERO = [0.0] * 100


@pytest.fixture(scope="module")
def oracle() -> Iterator[Oracle]:
    client = Oracle()
    yield client
    client.close()


def read(path: Path) -> RobotModel:
    return read_urdf(path, warn=lambda _: None)


def engine_differences(robot: RobotModel, posture: list[float]) -> list[str]:
    """Return the bodies that are elsewhere than link frames in a posture; shapes do not affect that."""
    bare = replace(robot, links={name: replace(link, shapes=()) for name, link in robot.links.items()})
    world = build_robot(RobotConfig(bare, "robot", Path("robot.urdf"), Path("robot.urdf")))
    data = mujoco.MjData(world.model)
    positions = by_joint_name(robot, posture)
    for name, value in positions.items():
        data.qpos[world.model.joint(name).qposadr[0]] = value
    mujoco.mj_kinematics(world.model, data)
    found = []
    for link, pose in link_poses(robot, positions).items():
        body = data.body(body_of(link))
        error = pose_distance(pose, Pose(tuple(body.xpos), tuple(body.xquat)))
        if error > 1e-9:
            found.append(f"{link}: {error:g} away")
    return found


REFUSED_BY_BOTH = {"torus_deform.urdf"}  # cloth: no links
REFUSED_BY_PYBULLET = {"kuka_iiwa/model_for_sdf.urdf", "toys/concave_box.urdf"}  # meshes elsewhere; an unknown shape
KNOWN_DIFFERENCES = {
    # xacro substitutions, which PyBullet reads as the number 0
    "husky/husky.urdf": ["imu_link: 0.999997 away", "imu_link: 0.999997 away"]
}


def is_chosen(path: Path) -> bool:
    """Return all files but most of a thousand similar single bodies; those, too, if the environment says so."""
    is_one_of_many = "random_urdfs" in path.parts and int(path.stem) % 25 != 0
    return not is_one_of_many or "CELLWRIGHT_ALL_URDFS" in os.environ


@pytest.mark.slow
def test_urdf_files_of_pybullet_read_as_pybullet_reads_them(oracle: Oracle) -> None:
    rng = random.Random(7)
    found = {}
    paths = [path for path in sorted(DATA.rglob("*.urdf")) if is_chosen(path)]
    assert len(paths) > 100
    for path in paths:
        name = path.relative_to(DATA).as_posix()
        postures = [ZERO, [rng.uniform(-2.0, 2.0) for _ in ZERO]]
        reference = oracle.ask(path, postures)
        if "error" in reference:
            assert name in REFUSED_BY_BOTH | REFUSED_BY_PYBULLET
            if name in REFUSED_BY_BOTH:
                with pytest.raises(DescriptionError):
                    read(path)
            else:
                assert read(path).links
            continue
        robot = read(path)
        found[name] = differences(robot, reference, postures)
        if "random_urdfs" not in name:  # those are single bodies
            assert engine_differences(robot, postures[1]) == [], name
    assert {name: each for name, each in found.items() if each} == KNOWN_DIFFERENCES


KINDS = ("fixed", "revolute", "continuous", "prismatic", "spherical", "planar")
number = st.floats(-1.0, 1.0, width=32)
triple = st.tuples(number, number, number)


def text(numbers: tuple[float, ...]) -> str:
    return " ".join(map(repr, numbers))


@st.composite
def urdfs(draw: st.DrawFn) -> str:
    """Return a URDF file with up to 30 links, its elements in any order."""
    count = draw(st.integers(1, 30))
    deep = draw(st.booleans())  # chains, or bushes
    names = draw(st.permutations([f"link {number}" for number in range(count)]))
    elements = []
    for index, name in enumerate(names):
        link = ET.Element("link", name=name)
        kind = draw(st.sampled_from(KINDS))
        # PyBullet places planar joints wrongly if the centre of mass is elsewhere
        if kind != "planar" and draw(st.booleans()):
            inertial = ET.SubElement(link, "inertial")
            ET.SubElement(inertial, "origin", xyz=text(draw(triple)), rpy=text(draw(triple)))
            ET.SubElement(inertial, "mass", value=repr(draw(st.floats(0.01, 10))))
            ET.SubElement(inertial, "inertia", ixx="1", iyy="1", izz="1", ixy="0", ixz="0", iyz="0")
        elements.append(link)
        if index == 0:
            continue
        joint = ET.Element("joint", name=f"joint {index}", type=kind)
        parent = draw(st.integers(max(0, index - 2) if deep else 0, index - 1))
        ET.SubElement(joint, "child", link=name)
        ET.SubElement(joint, "parent", link=names[parent])
        if draw(st.booleans()):
            ET.SubElement(joint, "origin", xyz=text(draw(triple)), rpy=text(tuple(4 * x for x in draw(triple))))
        axis = draw(st.sampled_from([(1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.6, 0.0, 0.8)]) | triple)
        # PyBullet scales the travel of a sliding joint by the length of its axis
        if max(map(abs, axis)) > 0.1 and (kind != "prismatic" or abs(sum(x * x for x in axis) - 1) < 1e-9):
            ET.SubElement(joint, "axis", xyz=text(axis))
        lower, upper = draw(st.tuples(number, number))
        ET.SubElement(joint, "limit", lower=repr(lower), upper=repr(upper), effort="5", velocity="2")
        elements.append(joint)
    lines = [ET.tostring(element, encoding="unicode") for element in draw(st.permutations(elements))]
    return "\n".join(['<robot name="made up">', *lines, "</robot>"])  # PyBullet breaks lines of 1024 characters


@settings(
    max_examples=50,
    phases=(Phase.reuse, Phase.explicit, Phase.generate),
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(urdf=urdfs(), posture=st.lists(st.floats(-3.0, 3.0), min_size=29, max_size=29))
def test_random_urdfs_read_as_pybullet_reads_them(
    oracle: Oracle, tmp_path: Path, urdf: str, posture: list[float]
) -> None:
    path = tmp_path / f"robot_{hashlib.sha256(urdf.encode()).hexdigest()}.urdf"
    path.write_text(urdf)
    robot = read(path)
    reference = oracle.ask(path, [ZERO, posture])
    assert differences(robot, reference, [ZERO, posture]) == []
    assert engine_differences(robot, posture) == []
