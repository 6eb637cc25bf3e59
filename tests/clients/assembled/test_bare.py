"""The class in an interpreter without packages, as in ROS's Python without Cellwright's dependencies."""

import subprocess
import sys
from pathlib import Path

import cellwright
from cellwright.middleware.ros1.packages.contents import IO_TELEOP, package_files
from tests.support.waiting import TIMEOUT

BARE = """
import sys, types
cellwright = types.ModuleType("cellwright")
cellwright.__path__ = [sys.argv[1]]
sys.modules["cellwright"] = cellwright
from cellwright.robot import AssembledRobot, JointStates
print(AssembledRobot.__name__, *sorted(name for name in ("numpy", "yaml", "mujoco", "rosbags") if name in sys.modules))
"""


def run(program: str, *arguments: str) -> str:
    command = [sys.executable, "-S", "-E", "-c", program, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=TIMEOUT).stdout


def test_assembled_robot_imports_with_standard_library_only() -> None:
    assert run(BARE, str(Path(cellwright.__file__).parent)) == "AssembledRobot\n"


def test_ros_package_module_has_path_of_interpreter(tmp_path: Path) -> None:
    files = package_files(IO_TELEOP, tmp_path)
    for name in ("__init__", "robot_module"):
        path = tmp_path / "io_teleop_robot_utils" / f"{name}.py"
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(files[f"io_teleop_robot_utils/{name}.py"])
    program = "import sys; sys.path.insert(0, sys.argv[1])\n"
    program += "from io_teleop_robot_utils.robot_module import AssembledRobot\nprint(AssembledRobot.python)"
    assert run(program, str(tmp_path)) == f"{sys.executable}\n"
