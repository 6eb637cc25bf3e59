"""Joints and links by index and by name; the two orders of counting."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Items, Leaf, Place, Problems, Scalar
from cellwright.config.robot.group_reader import MAX_LISTED, GroupReader, listed, numbered
from cellwright.config.robot.model import RobotModel
from cellwright.config.robot.robots import load_robot
from tests.config.robot.small_robot import INDICES, urdf

HERE = Place(0, "a.yml", 7)


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> RobotModel:
    path = tmp_path_factory.mktemp("robot") / "robot.urdf"
    path.write_text(urdf())
    return load_robot(path, lambda _line: None).robot


def leaf(value: Scalar) -> Leaf:
    return Leaf(value, HERE, "key")


@pytest.mark.parametrize("order", ["pybullet", "urdf"])
def test_index_and_name_refer_to_same_joint_and_link(order: str, robot: RobotModel) -> None:
    joints = numbered(robot, order)
    problems = Problems()
    references = GroupReader(robot, joints, Reader(problems))
    for index, joint in enumerate(joints):
        if joint.is_driven:
            assert references.joint(leaf(index), may_mimic=True) is joint
            assert references.joint(leaf(joint.name), may_mimic=True) is joint
        assert references.link(leaf(index)) == references.link(leaf(joint.child)) == joint.child
    assert problems.errors == ()


def test_numbered_joints_follow_pybullet_or_urdf_order(robot: RobotModel) -> None:
    assert tuple(joint.name for joint in numbered(robot, "pybullet")) == INDICES
    assert tuple(joint.name for joint in numbered(robot, "urdf")) == robot.written != INDICES


def test_root_link_is_accepted_only_where_allowed(robot: RobotModel) -> None:
    problems = Problems()
    references = GroupReader(robot, robot.joints, Reader(problems))
    assert references.link(leaf(-1), may_be_root=True) == references.link(leaf("base"), may_be_root=True) == "base"
    assert references.link(leaf(-1)) is references.link(leaf("base")) is None
    assert len(problems.errors) == 2


@given(st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=12) | st.dates() | st.binary())
def test_any_value_is_reference_or_one_error_with_place(robot: RobotModel, value: Scalar) -> None:
    for kind in ("joint", "link"):
        problems = Problems()
        found = getattr(GroupReader(robot, robot.joints, Reader(problems)), kind)(leaf(value))
        assert [str(problem).startswith("a.yml:7: key: ") for problem in problems.errors] == [True] * (found is None)


@given(st.lists(st.integers(-2, 15), max_size=6))
def test_joint_list_is_refused_if_empty_repeated_or_not_movable(robot: RobotModel, indices: list[int]) -> None:
    problems = Problems()
    found = GroupReader(robot, robot.joints, Reader(problems)).joints(Items(tuple(map(leaf, indices)), HERE, "key"))
    movable = {index for index, joint in enumerate(robot.joints) if joint.is_driven and joint.mimic is None}
    is_sound = bool(indices) and set(indices) <= movable and len(set(indices)) == len(indices)
    assert (found is not None) == is_sound == (problems.errors == ())


def test_listed_names_are_truncated_with_count() -> None:
    names = [f"joint_{number}" for number in range(100)]
    text = listed(names)
    assert text.startswith("joint_0, joint_1, ")
    assert text.endswith("… 88 more, see `cellwright robot`")
    assert text.count("joint_") == MAX_LISTED
    assert listed([]) == "none"
