"""The bundled agent over real ROS 1."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.ros1.ground import Ground
from tests.support.warm import warm_start

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1


def ran(folder: Path, *arguments: str, **more: str) -> dict[str, Any]:
    """Return the result of a run, as JSON."""
    command = [sys.executable, "-m", "cellwright", "run", "lesson", "--json", "--no-picture", *arguments]
    out, err = warm_start().popen(command, folder=folder, environment={**os.environ, **more}).communicate()
    assert "Traceback" not in err
    result: dict[str, Any] = json.loads(out)
    return result


def test_kitter_in_lockstep_over_ros1_leaves_same_state_as_in_process(no_master: Ground, tmp_path: Path) -> None:
    """Three seconds of it: the order, the first way to a bin, and the cameras."""
    here = ran(tmp_path, "--until", "3")
    there = ran(tmp_path, "--until", "3", "--over", "ros1", "--lockstep", **no_master.ros)
    assert there["steps"] == here["steps"] == 1500
    assert there["state_hash"] == here["state_hash"]
    assert there["competition_state"] == "go"


def test_kitter_in_real_time_over_ros1_starts_competition(master: Ground, tmp_path: Path) -> None:
    # Time passes while the program starts, which takes seconds on a busy machine.
    there = ran(tmp_path, "--until", "20", "--over", "ros1", **master.ros)
    assert (there["outcome"], there["competition_state"]) == ("until", "go")
    assert there["refused"] == {}
