"""Robot files by name or path, and validity of the bundled ones."""

from pathlib import Path

import pytest

from cellwright.config.check import check
from cellwright.config.robot.robots import bundled, find_robot, is_robot_file, is_urdf, load_robot
from cellwright.running.run.robots import urdf_text
from cellwright.util.errors import CellwrightError, DescriptionError, UnknownNameError
from tests.config.robot import mjcf_robots
from tests.config.robot.small_robot import urdf, write


def ignore_warning(_line: str) -> None:
    pass


@pytest.mark.slow
@pytest.mark.parametrize("name", bundled())
def test_bundled_robots_load_without_warnings(name: str) -> None:
    report = check([find_robot(name)])
    assert report.lines() == ["ok"]
    assert load_robot(name, ignore_warning).arms


def test_bundled_name_wins_over_folder_and_misspelling_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "qinglong" in bundled()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "qinglong").mkdir()
    assert find_robot("qinglong").parent.parent.name == "catalogue"
    with pytest.raises(UnknownNameError, match="unknown robot 'qinlong'; did you mean qinglong"):
        find_robot("qinlong")


def test_robot_is_found_by_file_or_folder(tmp_path: Path) -> None:
    path = write(tmp_path)
    assert find_robot(path) == find_robot(str(tmp_path)) == path
    assert load_robot(tmp_path, ignore_warning) == load_robot(path, ignore_warning)


def test_plain_urdf_has_joints_and_no_groups(tmp_path: Path) -> None:
    path = tmp_path / "some.robot"
    path.write_text(urdf())
    config = load_robot(path, ignore_warning)
    assert (config.name, config.path, config.urdf_path) == ("small", path, path)
    assert (config.arms, config.home, config.command_links) == ((), {}, ())
    assert len(config.robot.joints) == 14
    path.rename(tmp_path / "robot.urdf")
    assert find_robot(tmp_path) == tmp_path / "robot.urdf"


def test_folder_without_single_robot_file_is_refused(tmp_path: Path) -> None:
    empty = tmp_path / "empty"
    empty.mkdir()
    for name in ("a.urdf", "b.urdf"):
        (tmp_path / name).write_text(urdf())
    with pytest.raises(DescriptionError, match=r"no vr_configs\.yml, and more than one URDF; name one of a.urdf, b"):
        find_robot(tmp_path)
    with pytest.raises(DescriptionError, match=r"no vr_configs\.yml, and no URDF in this folder"):
        find_robot(empty)


@pytest.mark.parametrize("name", ["no.yml", "./qinglong", "folder/robot", "a" * 5000, "a\0b", ""])
def test_missing_robot_files_are_refused(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(CellwrightError):
        find_robot(name)


@pytest.mark.parametrize(
    ("name", "text", "robot", "plain"),
    [
        ("a.urdf", "", True, True),
        ("a.xacro", "", True, True),
        ("a", "\n <?xml version='1.0'?>", True, True),
        ("a", "\ufeff<robot/>", True, True),
        ("a.yml", "urdf_path: b\narms: []\n", True, False),
        ("a.yml", "urdf_pth: b\narms: []\ngrippers: []", True, False),
        ("a.yml", "urdf_path: b\narmz: []\ngripper: []", True, False),
        ("vr_configs.yml", "", True, False),
        ("vr_configs.yml", "a: [", True, False),
        ("a.yml", "a: [", False, False),
        ("a.yml", "orders: {}\noptions: {}\n", False, False),
        ("a.yml", "", False, False),
        ("a.yml", "<robot>", False, False),
    ],
)
def test_robot_files_are_recognised_by_suffix_and_content(
    name: str, text: str, robot: bool, plain: bool, tmp_path: Path
) -> None:
    path = tmp_path / name
    path.write_text(text)
    assert (is_robot_file(path), is_urdf(path)) == (robot, plain)


XACRO = """<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:arg name="side" default="left"/><link name="$(arg side)_$(arg tool)"/></robot>"""


def test_xacro_arguments_of_configuration_are_used_and_replaced(tmp_path: Path) -> None:
    (tmp_path / "arm.xacro").write_text(XACRO)
    path = tmp_path / "vr_configs.yml"
    path.write_text("urdf_path: arm.xacro\nxacro_arguments: {tool: true, side: 1.50}\n")
    found = load_robot(path, print)
    assert (found.robot.root, found.xacro_arguments) == ("1.5_true", {"tool": "true", "side": "1.5"})
    again = load_robot(path, print, {"side": "right"})
    assert (again.robot.root, again.xacro_arguments) == ("right_true", {"tool": "true", "side": "right"})
    assert load_robot(tmp_path / "arm.xacro", print, {"tool": "cup"}).xacro_arguments == {"tool": "cup"}


def test_published_text_of_xacro_has_the_arguments(tmp_path: Path) -> None:
    (tmp_path / "arm.xacro").write_text(XACRO)
    assert '<link name="left_cup" />' in urdf_text(load_robot(tmp_path / "arm.xacro", print, {"tool": "cup"}))


def test_configuration_without_indentation_is_one_error(tmp_path: Path) -> None:
    path = tmp_path / "vr_configs.yml"
    path.write_text("urdf_path: a.urdf\nbase_pose:\nposition: [0, 0, 1]\norientation: [0, 0, 0, 1]\n")
    with pytest.raises(DescriptionError) as raised:
        load_robot(path, print)
    message = (
        "base_pose: the section is empty, and 'position' below it is no section; indent the entries of each section"
    )
    assert str(raised.value) == f"{path}:2: {message}"


LIFTED = (
    '<worldbody><body name="base" pos="0 0 0.4"><body name="arm"><joint name="turn" pos="1 0 0"/><geom size="0.1"/>'
    '<site name="tip"/></body></body></worldbody>'
)


def test_plain_mjcf_stands_where_its_file_puts_it(tmp_path: Path) -> None:
    path = mjcf_robots.write(tmp_path, LIFTED)
    path.write_text(f"<!-- an arm -->\n{path.read_text()}")
    config = load_robot(path, ignore_warning)
    assert is_robot_file(path)
    assert (config.name, config.urdf_path, config.base_pose.position) == ("arm", path, (0.0, 0.0, 0.4))
    assert list(config.robot.links) == ["base", "arm", "tip"]
    assert '<joint name="turn" type="continuous">' in urdf_text(config)
    with pytest.raises(DescriptionError, match="an MJCF file takes no arguments"):
        load_robot(path, ignore_warning, {"tool": "cup"})


def test_configuration_may_name_an_mjcf_file(tmp_path: Path) -> None:
    mjcf_robots.write(tmp_path, LIFTED)
    path = tmp_path / "vr_configs.yml"
    path.write_text("urdf_path: arm.xml\narms: [{joint_index: [turn], ee_index: tip, rest_j_pos: [0.5]}]\n")
    config = load_robot(tmp_path, ignore_warning)
    assert (config.arms[0].tip, config.home) == ("tip", {"turn": 0.5})
    assert config.base_pose.position == (0.0, 0.0, 0.0)
