"""ROS's own parser of URDF, the program `check_urdf`: what it says of a text."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path

from cellwright.config.robot.description import description
from cellwright.config.robot.model import RobotModel
from cellwright.config.robot.urdf_file import read_text
from tests.support.waiting import TIMEOUT


def lacking() -> str | None:
    """Return the reason why tests with the parser cannot run here; None if they can."""
    return None if shutil.which("check_urdf") else "no check_urdf: scripts/install-ros1 installs it"


def complaints(text: str) -> list[str]:
    """Return the errors that the parser finds in a URDF; none if it accepts it."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "robot.urdf"
        file.write_text(text, encoding="utf-8")
        done = subprocess.run(["check_urdf", file], capture_output=True, text=True, timeout=TIMEOUT, check=False)
    lines = [*done.stderr.splitlines(), *done.stdout.splitlines()]
    found = [line for line in lines if line.lstrip().startswith("Error")]
    is_accepted = done.returncode == 0 and "Successfully Parsed XML" in done.stdout
    return found or ([] if is_accepted else [f"check_urdf ended with {done.returncode}", *lines])


def complaints_about(robot: RobotModel, path: Path) -> list[str]:
    """Return the errors that the parser finds in what is published of a robot; none without the parser."""
    return [] if lacking() else complaints(description(read_text(path), robot, path))
