"""Robots written in xacro: expanded without ROS, with errors that name file and line."""

from pathlib import Path

import pytest

from cellwright.config.robot import urdf_file
from cellwright.config.robot.model import RobotModel
from cellwright.config.robot.urdf import read_urdf
from cellwright.util.errors import DescriptionError
from fuzz.targets import xacro_file as target

ARM = """<robot xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:macro name="arm" params="side y">
    <link name="${side}_arm"/>
    <joint name="${side}" type="revolute"><parent link="base"/><child link="${side}_arm"/>
      <origin xyz="0 ${2*y} 0"/><limit lower="-1" upper="${pi/2}" effort="1" velocity="1"/></joint>
  </xacro:macro>
</robot>
"""
ROBOT = """<?xml version="1.0"?>
<robot name="two" xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:include filename="$(find arms)/urdf/arm.xacro"/>
  <link name="base"/>
  <xacro:arm side="left" y="0.25"/>
  <xacro:arm side="right" y="-0.25"/>
</robot>
"""


def read(folder: Path, text: str) -> RobotModel:
    (folder / "urdf").mkdir(exist_ok=True)
    (folder / "package.xml").write_text("<package><name> arms </name></package>")
    (folder / "urdf" / "arm.xacro").write_text(ARM)
    path = folder / "urdf" / "robot.urdf.xacro"
    path.write_text(text)
    return read_urdf(path, warn=lambda _: None)


def read_errors(folder: Path, text: str) -> str:
    with pytest.raises(DescriptionError) as raised:
        read(folder, text)
    return str(raised.value).replace(f"{folder.resolve()}/", "").removeprefix("urdf/")


def test_macros_expressions_and_packages_are_expanded(tmp_path: Path) -> None:
    robot = read(tmp_path, ROBOT)
    assert [joint.name for joint in robot.joints] == ["left", "right"]
    assert robot.joint("left").origin.position == (0.0, 0.5, 0.0)
    assert robot.joint("right").limits.upper == pytest.approx(1.5707963)
    assert robot.name == "two"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("find arms", "find legs", ":3: xacro: there is no package 'legs' above this file or in ROS_PACKAGE_PATH"),
        ("<xacro:arm side=\"l", "<xacro:leg side=\"l", ":5: xacro: unknown macro name: xacro:leg"),
        (' y="0.25"', "", ": xacro: Undefined parameters [y] (in the macro arm)"),
        ('name="base"', 'name="${1/0}"', ":4: xacro: division by zero when evaluating expression '1/0'"),
        ('name="base"', 'name="$(arg tool)"', ":4: xacro: the argument 'tool' has no value; give one as tool:=VALUE"),
        ('name="base"', 'name="base', ":5: invalid XML (column 3)"),
        ("<robot name", "<!DOCTYPE a><robot name", ":2: document types and entities are not supported; remove them"),
        ('<xacro:arm side="left" y="0.25"/>', "<link/>", ": link: the link has no name"),
    ],
)  # fmt: skip
def test_xacro_errors_name_file_and_line(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert read_errors(tmp_path, ROBOT.replace(old, new)) == f"robot.urdf.xacro{message}"


def test_error_in_included_file_names_that_file(tmp_path: Path) -> None:
    (tmp_path / "urdf").mkdir()
    (tmp_path / "urdf" / "broken.xacro").write_text("<robot>\n<link>\n</robot>")
    assert read_errors(tmp_path, ROBOT.replace("arm.xacro", "broken.xacro")) == "broken.xacro:3: invalid XML (column 3)"


def test_endless_macros_give_one_line_error(tmp_path: Path) -> None:
    text = '<robot xmlns:xacro="x"><xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/></robot>'
    assert "macros call each other without end" in read_errors(tmp_path, text)


def test_macros_in_file_without_xacro_suffix_are_ignored_with_warning(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text('<robot>\n<link name="a"/>\n<xacro:arm/><xacro:include filename="missing"/></robot>')
    warnings: list[str] = []
    assert list(read_urdf(path, warn=warnings.append).links) == ["a"]
    expected = "<xacro:arm> is ignored; xacro is expanded only in files whose name ends in .xacro"
    assert warnings[0] == f"{path}:3: xacro:arm: {expected}"
    path.write_text("<robot><xacro:arm/></robot>")
    with pytest.raises(DescriptionError, match=r"the robot has no links; xacro is expanded only in files"):
        read_urdf(path, warn=warnings.append)


ARGUMENTS = """<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:arg name="side" default="left"/>
  <link name="$(arg side)_$(arg tool)"/>
</robot>
"""


def names(folder: Path, text: str, **arguments: str) -> list[str]:
    path = folder / "robot.xacro"
    path.write_text(text)
    return list(read_urdf(path, warn=lambda _: None, arguments=arguments).links)


def test_arguments_replace_defaults_of_xacro_file(tmp_path: Path) -> None:
    assert names(tmp_path, ARGUMENTS, tool="cup") == ["left_cup"]
    assert names(tmp_path, ARGUMENTS, tool="cup", side="right") == ["right_cup"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "robot.xacro:3: xacro: the argument 'tool' has no value; give one as tool:=VALUE"),
        ({"tool": "cup", "sid": "x"}, "robot.xacro: xacro: there is no argument 'sid'; did you mean side"),
    ],
)
def test_missing_or_unknown_argument_is_named(tmp_path: Path, arguments: dict[str, str], message: str) -> None:
    with pytest.raises(DescriptionError) as raised:
        names(tmp_path, ARGUMENTS, **arguments)
    assert str(raised.value).replace(f"{tmp_path}/", "") == message


def test_arguments_of_plain_urdf_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text('<robot><link name="a"/></robot>')
    with pytest.raises(DescriptionError, match=r"takes no arguments \(got tool:=cup\); only files whose name ends in"):
        read_urdf(path, warn=lambda _: None, arguments={"tool": "cup"})


def test_file_of_macros_alone_is_named_as_such(tmp_path: Path) -> None:
    with pytest.raises(DescriptionError, match=r"only macros \(arm\) and no links; open a file that calls them$"):
        names(tmp_path, ARM)


def test_included_file_may_have_what_xml_forbids(tmp_path: Path) -> None:
    (tmp_path / "more.xacro").write_bytes(b"\xef\xbb\xbf\n<robot><!-- a -- b --><link \x1aname='\xc3\xa4'/></robot>")
    assert names(tmp_path, '<robot xmlns:xacro="x"><xacro:include filename="more.xacro"/></robot>') == ["ä"]


def test_included_git_lfs_pointer_is_named(tmp_path: Path) -> None:
    (tmp_path / "more.xacro").write_text("version https://git-lfs.github.com/spec/v1\n")
    with pytest.raises(DescriptionError, match=r"more\.xacro: a Git LFS pointer, not the file itself"):
        names(tmp_path, '<robot xmlns:xacro="x"><xacro:include filename="more.xacro"/></robot>')


def test_search_with_random_files_leaves_the_bound_of_users() -> None:
    target.attempt(next(target.seeds()))
    assert urdf_file.MAX_EXPANSION_TIME > target.MAX_EXPANSION_TIME
