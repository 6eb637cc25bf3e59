"""Tests of the translation of the vendor's command lines."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.cli.launchers.io_teleop.arguments import command
from cellwright.util.errors import UnknownNameError


@pytest.fixture
def scripts(tmp_path: Path) -> Path:
    """Return the folder of a package's scripts, with two robots."""
    for name in ("OpenLoong", "Marvin"):
        folder = tmp_path / "pkg" / "io_teleop_robot_descriptions" / name
        folder.mkdir(parents=True)
        (folder / "vr_configs.yml").write_text("robot_name: x\n")
    return tmp_path / "pkg" / "scripts"


def of(script: Path, *arguments: str) -> list[str]:
    """Return the translation of a command line that causes no warning."""
    warnings: list[str] = []
    found = command(str(script), arguments, warnings.append)
    assert warnings == []
    return found


def configuration(scripts: Path, robot: str) -> str:
    return str(scripts.parent / "io_teleop_robot_descriptions" / robot / "vr_configs.yml")


def test_qinglong_script_starts_its_node(scripts: Path) -> None:
    assert of(scripts / "openloong_controller_node.py") == [
        "teleop",
        configuration(scripts, "OpenLoong"),
        "--ros1",
        "--node=openloong_controller_node",
        "--port=0",
    ]


def test_general_script_uses_teleport_motion(scripts: Path) -> None:
    found = of(scripts / "general_sim_robot_control_node.py", "--robot_name", "Marvin")
    assert found[1] == configuration(scripts, "Marvin")
    assert found[2:] == ["--ros1", "--node=sim_robot_controller_node", "--port=0", "--motion=teleport"]


def test_copied_script_has_its_own_node_name(scripts: Path) -> None:
    assert "--node=marvin_node" in of(scripts / "marvin_node.py", "--robot_name=Marvin")


def test_other_options_come_last_and_win(scripts: Path) -> None:
    script = scripts / "general_sim_robot_control_node.py"
    assert of(script, "--motion", "servo", "--init_debug")[-3:] == ["--init-debug", "--motion", "servo"]


def test_roslaunch_arguments_set_only_the_node_name(scripts: Path) -> None:
    found = of(scripts / "openloong_controller_node.py", "__name:=robot", "__log:=/tmp/x.log", "_rate:=3")
    assert found[2:] == ["--ros1", "--node=robot", "--port=0"]


def test_remapped_topic_is_ignored_with_warning(scripts: Path) -> None:
    lines: list[str] = []
    command(str(scripts / "openloong_controller_node.py"), ["/io_teleop/joint_cmd:=/mine"], lines.append)
    assert lines == ["/io_teleop/joint_cmd:=/mine: remapping ignored; names of topics and services are absolute"]


def test_robot_given_by_path_is_found(scripts: Path, tmp_path: Path) -> None:
    urdf = tmp_path / "arm.urdf"
    urdf.write_text("<robot/>")
    assert of(scripts / "x.py", "--robot_name", str(urdf))[1] == str(urdf)
    assert of(scripts / "x.py", "--robot_name", "Marvin/vr_configs.yml")[1] == configuration(scripts, "Marvin")


def test_robot_folder_after_catkin_install_is_found(scripts: Path, tmp_path: Path) -> None:
    installed = tmp_path / "install" / "share" / "io_teleop_robot_control_node"
    installed.mkdir(parents=True)
    (scripts.parent / "io_teleop_robot_descriptions").rename(installed / "io_teleop_robot_descriptions")
    script = tmp_path / "install" / "lib" / "io_teleop_robot_control_node" / "openloong_controller_node.py"
    expected = installed / "io_teleop_robot_descriptions" / "OpenLoong" / "vr_configs.yml"
    assert of(script)[1] == str(expected)


def test_robot_without_folder_is_the_bundled_one(tmp_path: Path) -> None:
    assert of(tmp_path / "a" / "b" / "openloong_controller_node.py")[1] == "qinglong"


def test_unknown_robot_is_refused(scripts: Path) -> None:
    with pytest.raises(UnknownNameError, match=r"robot 'Marvn'.*Marvin"):
        of(scripts / "x.py", "--robot_name", "Marvn")
