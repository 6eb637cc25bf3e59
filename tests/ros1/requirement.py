"""Requirements of the marker `ros1`: a Python with rospy, the master, and the tools of Debian.

If one is missing, a test is skipped with the reason; in CI it fails, so that a green build includes real ROS 1.
"""

import os
import shutil
import subprocess
from functools import cache
from pathlib import Path

from tests.support.waiting import TIMEOUT

HOW = "scripts/install-ros1 installs it"


@cache
def ros_python() -> str | None:
    """Return the interpreter that has rospy; None if there is none."""
    for path in (os.environ.get("CELLWRIGHT_ROS1_PYTHON"), "/usr/bin/python3"):
        if path and Path(path).exists() and not _lacking(path):
            return path
    return None


@cache
def lacking() -> str | None:
    """Return the reason why tests with ROS 1 cannot run here; None if they can."""
    if ros_python() is None:
        return f"no system Python with rospy: {HOW}"
    tools = ("rosmaster", "roscore", "rostopic", "rosservice", "rosrun", "catkin_make")
    gone = [tool for tool in tools if shutil.which(tool, path=system_path()) is None]
    return f"ROS 1 is here in part only, without {', '.join(gone)}: {HOW}" if gone else None


def system_path() -> str:
    """Return the search path for system programs: its own folders before those of any other Python."""
    own = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
    rosses = sorted(str(path) for path in Path("/opt/ros").glob("*/bin"))
    return ":".join([*rosses, "/usr/bin", os.environ.get("PATH", own)])


def _lacking(python: str) -> bool:
    asked = "import importlib.util, sys; sys.exit(importlib.util.find_spec('rospy') is None)"
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    return subprocess.run([python, "-c", asked], env=environment, timeout=TIMEOUT, check=False).returncode != 0
