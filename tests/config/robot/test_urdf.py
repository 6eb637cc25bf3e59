"""Robots from URDF files: the tree, the indices of joints, and refused files with the place of their errors."""

from pathlib import Path

import pytest

from cellwright.config.robot.model import JointType, RobotModel
from cellwright.config.robot.urdf import MAX_LINKS, MAX_SHAPES, MAX_WARNINGS, read_urdf
from cellwright.util.errors import DescriptionError
from tests.support.urdfdom import complaints_about

LIMIT = '<limit lower="-1" upper="2" effort="3" velocity="4"/>'


def joint(name: str, parent: str, child: str, inside: str = LIMIT, kind: str = "revolute") -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">\n{ends}{inside}</joint>\n'


def robot(*elements: str, links: str = "") -> str:
    return '<robot name="r">\n' + "".join(f'<link name="{name}"/>\n' for name in links) + "".join(elements) + "</robot>"


def read(folder: Path, text: str) -> tuple[RobotModel, list[str]]:
    """Return the robot, and the warnings without the path of the file; ROS's own parser accepts what is published."""
    path = folder / "robot.urdf"
    path.write_text(text)
    warnings: list[str] = []
    found = read_urdf(path, warn=warnings.append)
    assert complaints_about(found, path) == []
    return found, [warning.replace(f"{folder}/", "") for warning in warnings if "no shapes in the file" not in warning]


def read_errors(folder: Path, text: str) -> list[str]:
    """Return the errors, without the path of the file."""
    path = folder / "robot.urdf"
    path.write_text(text)
    with pytest.raises(DescriptionError) as raised:
        read_urdf(path, warn=lambda _: None)
    return [str(problem).replace(f"{folder}/", "") for problem in raised.value.problems]


def test_joints_are_counted_parents_first_and_siblings_in_file_order(tmp_path: Path) -> None:
    text = robot(
        joint("c_d", "c", "d"), joint("a_b", "a", "b"), joint("a_c", "a", "c"), joint("b_e", "b", "e"), links="edcba"
    )
    found, warnings = read(tmp_path, text)
    assert [each.name for each in found.joints] == ["a_b", "b_e", "a_c", "c_d"]
    assert found.written == ("c_d", "a_b", "a_c", "b_e")
    assert (found.root, found.name, list(found.links)) == ("a", "r", list("edcba"))
    assert found.link_indices == {"a": -1, "b": 0, "e": 1, "c": 2, "d": 3}
    assert warnings == []


def test_robot_without_visuals_is_drawn_by_collision_shapes(tmp_path: Path) -> None:
    box = '<geometry><box size="1 1 1"/></geometry>'
    links = f'<link name="a"><collision>{box}</collision></link><link name="b"/>'
    found, warnings = read(tmp_path, robot(links, joint("j", "a", "b")))
    assert [(shape.is_touched, shape.is_seen) for shape in found.links["a"].shapes] == [(True, True)]
    assert (found.links["b"].shapes, warnings) == ((), [])
    links += f'<link name="c"><visual>{box}</visual></link>'
    found, _ = read(tmp_path, robot(links, joint("j", "a", "b"), joint("k", "a", "c")))
    assert [(shape.is_touched, shape.is_seen) for shape in found.links["a"].shapes] == [(True, False)]


def test_robot_of_one_link_without_name_is_read(tmp_path: Path) -> None:
    found, _ = read(tmp_path, '<robot><link name="box"/></robot>')
    assert (found.name, found.root, found.joints) == ("robot", "box", ())


def test_foreign_elements_are_ignored_and_misspelt_ones_reported(tmp_path: Path) -> None:
    others = '<gazebo/><transmission name="t"><joint name="j"/></transmission><jont name="x"/>'
    found, warnings = read(tmp_path, robot(others, joint("j", "a", "b"), links="ab"))
    assert len(found.joints) == 1
    assert warnings == ["robot.urdf:4: jont[x]: unknown element <jont>, ignored; did you mean joint"]


def test_warnings_beyond_maximum_are_counted(tmp_path: Path) -> None:
    boxes = '<visual><geometry><box size="0 0 0"/></geometry></visual>\n' * 100
    _, warnings = read(tmp_path, robot("<jont/>\n" * 100, f'<link name="a">{boxes}</link>'))
    assert warnings[0] == "robot.urdf:2: jont: unknown element <jont>, ignored; did you mean joint (100 times)"
    assert len(warnings) == MAX_WARNINGS + 1
    assert warnings[-1] == "robot.urdf: 81 more warnings are not listed"


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (robot(links=""), "robot.urdf:1: the robot has no links"),
        (
            robot(links="ab"),
            "robot.urdf:3: link[b]: a robot must have one root link (got 2: a, b); connect the others by joints",
        ),
        (robot("<link/>", links="a"), "robot.urdf:3: link: the link has no name"),
        (robot(links="aa"), "robot.urdf:3: link[a]: duplicate link name (first at robot.urdf:2); choose another"),
        (
            robot(joint("j", "a", "b"), joint("k", "c", "b"), links="abc"),
            "robot.urdf:7: joint[k]: 'b' is already the child of joint 'j'; a link can have only one parent",
        ),
        (
            robot(joint("j", "a", "b"), joint("k", "b", "a"), links="ab"),
            "robot.urdf:1: no root link: every link is the child of another, in a loop",
        ),
        (
            robot(joint("j", "a", "b"), joint("k", "b", "a"), links="abc"),
            "robot.urdf:5: joint[j]: joints form a loop: j, k",
        ),
        (
            robot('<link name="base_link"/>', joint("j", "base_lnk", "a"), links="a"),
            "robot.urdf:4: joint[j].parent: unknown link 'base_lnk'; did you mean base_link",
        ),
        ("<sdf/>", "robot.urdf:1: the root element of a URDF must be <robot> (got <sdf>, an SDF file)"),
        ("<mujoco/>", "robot.urdf:1: the root element of a URDF must be <robot> (got <mujoco>, an MJCF file)"),
        ("<html/>", "robot.urdf:1: the root element of a URDF must be <robot> (got <html>)"),
    ],
)  # fmt: skip
def test_links_that_form_no_tree_are_refused(tmp_path: Path, text: str, problem: str) -> None:
    assert problem in read_errors(tmp_path, text)


def test_all_urdf_errors_are_listed_at_once(tmp_path: Path) -> None:
    problems = read_errors(tmp_path, robot(joint("j", "x", "b", "<limit upper='nan'/>"), "<joint/>", links="b"))
    assert len(problems) == 3
    assert [problem.split(": ")[0] for problem in problems] == ["robot.urdf:4", "robot.urdf:4", "robot.urdf:5"]


@pytest.mark.parametrize(
    ("elements", "message"),
    [
        ("<link/>" * (MAX_LINKS + 1), f"too many links (got {MAX_LINKS + 1}, at most {MAX_LINKS})"),
        ("<joint/>" * (MAX_LINKS + 1), f"too many joints (got {MAX_LINKS + 1}, at most {MAX_LINKS})"),
        (
            f"<link>{'<visual/>' * (MAX_SHAPES + 1)}</link>",
            f"too many shapes (got {MAX_SHAPES + 1}, at most {MAX_SHAPES})",
        ),
    ],
)
def test_excessive_counts_are_refused(tmp_path: Path, elements: str, message: str) -> None:
    assert read_errors(tmp_path, robot(elements)) == [f"robot.urdf: {message}"]


def test_chain_of_maximum_length_is_read(tmp_path: Path) -> None:
    links = "".join(f'<link name="l{number}"/>' for number in range(MAX_LINKS))
    joints = "".join(joint(f"j{k}", f"l{k}", f"l{k + 1}", kind="fixed") for k in reversed(range(MAX_LINKS - 1)))
    found, _ = read(tmp_path, robot(links, joints))
    assert [each.name for each in found.joints] == [f"j{k}" for k in range(MAX_LINKS - 1)]
    assert {each.type for each in found.joints} == {JointType.FIXED}
