"""Catkin workspace: written, updated, and built with the installed tools."""

import subprocess
from pathlib import Path

import pytest

from cellwright.middleware.ros1.host.installation import RosSystem
from cellwright.middleware.ros1.packages.workspace import NEEDED, build, lack, lay_out, missing
from cellwright.util.errors import UsageError
from tests.ros1.fake_system import fake_system
from tests.support.waiting import TIMEOUT

__all__ = ["fake_system"]


def test_lay_out_writes_sources(fake_system: RosSystem, tmp_path: Path) -> None:
    folder = tmp_path / "ws"
    lay_out(fake_system, folder)
    assert sorted(path.name for path in (folder / "src" / "ariac").iterdir()) == [
        "ariac_example",
        "cellwright_msgs",
        "control_msgs",
        "controller_manager_msgs",
        "osrf_gear",
    ]
    robots = folder / "src" / "io_teleop" / "io_teleop_robot_control_node" / "io_teleop_robot_descriptions"
    assert (robots / "OpenLoong" / "vr_configs.yml").is_file()
    top = (folder / "src" / "CMakeLists.txt").read_text()
    assert f'set(PYTHON_EXECUTABLE "{fake_system.python}" CACHE' in top
    assert str(fake_system.share / "catkin" / "cmake" / "toplevel.cmake") in top
    hook = (folder / "src" / "ariac" / "osrf_gear" / "env-hooks" / "50.cellwright.sh").read_text()
    assert f'_cellwright_bin="{folder}/.cellwright/bin"' in hook


def test_env_hook_adds_python_of_ros_to_path_once(fake_system: RosSystem, tmp_path: Path) -> None:
    lay_out(fake_system, tmp_path)
    hook = tmp_path / "src" / "ariac" / "osrf_gear" / "env-hooks" / "50.cellwright.sh"
    ran = subprocess.run(
        ["sh", "-c", f". '{hook}'; . '{hook}'; printf %s \"$PATH\""],
        env={"PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=True,
    )
    assert ran.stdout == f"{tmp_path}/.cellwright/bin:/usr/bin:/bin"


def test_lay_out_keeps_other_files_of_workspace(fake_system: RosSystem, tmp_path: Path) -> None:
    own = tmp_path / "src" / "my_robot" / "package.xml"
    own.parent.mkdir(parents=True)
    own.write_text("mine")
    (tmp_path / "src" / "CMakeLists.txt").symlink_to("/usr/share/catkin/cmake/toplevel.cmake")
    installed = tmp_path / "install" / "setup.bash"
    installed.parent.mkdir()
    installed.write_text("catkin's own")
    lay_out(fake_system, tmp_path)
    lay_out(fake_system, tmp_path)
    assert own.read_text() == "mine"
    assert installed.read_text() == "catkin's own"
    assert not (tmp_path / "src" / "CMakeLists.txt").is_symlink()
    assert not list(tmp_path.rglob("*~"))


def test_install_setup_sources_devel(fake_system: RosSystem, tmp_path: Path) -> None:
    folder = tmp_path / "a workspace"
    lay_out(fake_system, folder)
    (folder / "devel").mkdir()
    (folder / "devel" / "setup.bash").write_text("export SEEN=devel\n")
    command = ["bash", "-c", 'source "$1/install/setup.bash"; printf %s "$SEEN"', "bash", str(folder)]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=True)
    assert ran.stdout == "devel"


def test_missing_packages_are_named_with_install_command(fake_system: RosSystem, tmp_path: Path) -> None:
    absent = missing(fake_system)
    assert set(NEEDED) <= set(absent)
    (fake_system.share / "catkin" / "cmake").mkdir(parents=True)
    (fake_system.share / "catkin" / "cmake" / "catkinConfig.cmake").touch()
    by_architecture = fake_system.prefix / "lib" / "x86_64-linux-gnu" / "cmake" / "roscpp"
    by_architecture.mkdir(parents=True)
    (by_architecture / "roscppConfig.cmake").touch()
    assert set(absent) - set(missing(fake_system)) == {"catkin", "roscpp"}
    with pytest.raises(
        UsageError, match=r"cannot build: actionlib_msgs, .* missing; on Debian, run: apt-get install .*libroscpp-dev"
    ):
        build(fake_system, tmp_path)
    assert lack(["catkin"]).startswith("catkin cannot build: catkin missing; on Debian, run: apt-get install ")


def test_lay_out_to_unwritable_folder_is_refused(fake_system: RosSystem, tmp_path: Path) -> None:
    (tmp_path / "src").touch()
    with pytest.raises(UsageError, match="cannot write a workspace: Not a directory"):
        lay_out(fake_system, tmp_path)
