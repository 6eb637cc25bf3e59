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


def test_the_qinglong_s_own_node(scripts: Path) -> None:
    assert of(scripts / "openloong_controller_node.py") == [
        "teleop",
        configuration(scripts, "OpenLoong"),
        "--ros1",
        "--node=openloong_controller_node",
        "--port=0",
    ]


def test_the_general_node_sets_joints_to_their_targets(scripts: Path) -> None:
    found = of(scripts / "general_sim_robot_control_node.py", "--robot_name", "Marvin")
    assert found[1] == configuration(scripts, "Marvin")
    assert found[2:] == ["--ros1", "--node=sim_robot_controller_node", "--port=0", "--motion=teleport"]


def test_a_copy_of_a_script_is_a_node_of_its_own(scripts: Path) -> None:
    assert "--node=marvin_node" in of(scripts / "marvin_node.py", "--robot_name=Marvin")


def test_other_options_come_last_so_that_they_count(scripts: Path) -> None:
    script = scripts / "general_sim_robot_control_node.py"
    assert of(script, "--motion", "servo", "--init_debug")[-3:] == ["--init-debug", "--motion", "servo"]


def test_arguments_of_roslaunch_are_dropped(scripts: Path) -> None:
    found = of(scripts / "openloong_controller_node.py", "__name:=robot", "__log:=/tmp/x.log", "_rate:=3")
    assert found[2:] == ["--ros1", "--node=robot", "--port=0"]


def test_names_that_cannot_be_changed_are_reported(scripts: Path) -> None:
    said: list[str] = []
    command(str(scripts / "openloong_controller_node.py"), ["/io_teleop/joint_cmd:=/mine"], said.append)
    assert said == ["/io_teleop/joint_cmd:=/mine: remapping ignored; names of topics and services are absolute"]


def test_a_file_anywhere(scripts: Path, tmp_path: Path) -> None:
    urdf = tmp_path / "arm.urdf"
    urdf.write_text("<robot/>")
    assert of(scripts / "x.py", "--robot_name", str(urdf))[1] == str(urdf)
    assert of(scripts / "x.py", "--robot_name", "Marvin/vr_configs.yml")[1] == configuration(scripts, "Marvin")


def test_after_catkin_make_install(scripts: Path, tmp_path: Path) -> None:
    installed = tmp_path / "install" / "share" / "io_teleop_robot_control_node"
    installed.mkdir(parents=True)
    (scripts.parent / "io_teleop_robot_descriptions").rename(installed / "io_teleop_robot_descriptions")
    script = tmp_path / "install" / "lib" / "io_teleop_robot_control_node" / "openloong_controller_node.py"
    expected = installed / "io_teleop_robot_descriptions" / "OpenLoong" / "vr_configs.yml"
    assert of(script)[1] == str(expected)


def test_without_a_folder_the_bundled_robot_is_taken(tmp_path: Path) -> None:
    assert of(tmp_path / "a" / "b" / "openloong_controller_node.py")[1] == "qinglong"


def test_an_unknown_robot(scripts: Path) -> None:
    with pytest.raises(UnknownNameError, match=r"robot 'Marvn'.*Marvin"):
        of(scripts / "x.py", "--robot_name", "Marvn")
