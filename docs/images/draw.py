"""Draws docs/images/cell.png: the lesson's cell, the arm lifting its second rod. To be run from the project's root."""

import subprocess
import sys

MOMENT, CAMERA = "9.85", "-1.75,-0.3,1.55:0.4,0.95,0.86:53"

command = [sys.executable, "-m", "cellwright", "run", "lesson", "--agent", "lesson", "--until", "10", "--no-picture"]
subprocess.run([*command, "--snapshot", f"{MOMENT}:docs/images/cell.png", f"--camera={CAMERA}"], check=False)  # noqa: S603
