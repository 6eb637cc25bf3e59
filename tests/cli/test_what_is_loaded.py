"""What looking on needs is loaded when somebody looks on, and a run without starts as fast as ever."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

HEAVY = ("OpenGL", "av", "glfw", "matplotlib", "rospy", "viser", "websockets")

_PROGRAM = """
import json, sys
from cellwright.cli.main import main
status = main(sys.argv[2:])
print(json.dumps([status, sorted({name.partition(".")[0] for name in sys.modules} & set(json.loads(sys.argv[1])))]))
"""


def test_a_run_that_is_recorded_loads_nothing_of_looking_on(tmp_path: Path) -> None:
    asked = json.dumps([*HEAVY, "mcap"])  # which is loaded, so that this test looks in the right place
    run = ["run", "lesson", "--agent", "none", "--until", "0.01", "--no-picture", "--record", "run.mcap"]
    done = subprocess.run(
        [sys.executable, "-c", _PROGRAM, asked, *run],
        env={**os.environ, "MUJOCO_GL": "disable"},  # else the engine itself loads glfw where it is installed
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
        cwd=tmp_path,
    )
    assert json.loads(done.stdout.splitlines()[-1]) == [0, ["mcap"]]
