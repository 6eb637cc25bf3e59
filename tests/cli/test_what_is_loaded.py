"""Tests of loading: the modules of a viewer are loaded for a viewer only, and a run without one starts fast."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.cli.eval.test_merge import WORK, jobs_of, made_up, store
from tests.running.evaluation.programs import PROGRAMS, TRIAL
from tests.support.ports import free_port
from tests.support.waiting import TIMEOUT

HEAVY = ("OpenGL", "av", "glfw", "matplotlib", "rospy", "viser", "websockets")
READERS = (
    "yaml",
    "cellwright.config.layout.basing",
    "cellwright.config.layout.reader",
    "cellwright.config.parsing.yaml_source",
)
"""Readers of a cell's files, which the class of cells needs once it reads one."""
EXTRAS = ("mlflow", "pyarrow", "ray", "wandb")
"""Packages of extras, for evaluations that request them."""

OF_OURS = tuple(
    f"cellwright.{room}"
    for room in (
        "middleware.server",
        "rendering.video",
        "rendering.worker",
        "robot.node",
        "running.remote",
        "viewer.web.page",
    )
)
"""Modules for other processes, videos, pages and robots."""

_PROGRAM = """
import json, sys
from cellwright.cli.main import main
status = main(sys.argv[2:])
print(json.dumps([status, sorted(set(sys.modules) & set(json.loads(sys.argv[1])))]))
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "loaded"), [((), []), (("--record", "run.mcap"), ["mcap"])], ids=["plain", "recorded"]
)
def test_run_loads_no_viewer_modules(options: tuple[str, ...], loaded: list[str], tmp_path: Path) -> None:
    asked = json.dumps([*HEAVY, *OF_OURS, "mcap"])
    run = ["run", "lesson", "--agent", "none", "--until", "0.01", "--no-picture", *options]
    assert _ended(asked, run, tmp_path) == [0, loaded]


def test_evaluation_on_ray_leaves_ray_to_another_process(tmp_path: Path) -> None:
    assert _ended(json.dumps(["ray"]), ["eval", "lesson", "--ray", f"127.0.0.1:{free_port()}"], tmp_path) == [2, []]


def test_command_loads_no_modules_of_other_commands(tmp_path: Path) -> None:
    assert _ended(json.dumps(["mujoco", "numpy"]), ["--version"], tmp_path) == [0, []]


def test_class_of_cells_loads_no_reader_of_files() -> None:
    program = (
        f"import json, sys; from cellwright import Cell; print(json.dumps(sorted({{*sys.modules}} & {set(READERS)})))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=TIMEOUT)
    assert json.loads(done.stdout) == []


@pytest.mark.slow
def test_evaluation_loads_no_packages_of_extras(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("tiny.yaml").write_text(TRIAL, encoding="utf-8")
    Path("other.yaml").write_text(TRIAL + "time_limit: 400\n", encoding="utf-8")
    Path("programs.py").write_text(PROGRAMS, encoding="utf-8")
    store("evaluation", (replace(each, outcome="done", reason="") for each in made_up(jobs_of(1), random.Random(1))))
    assert _ended(json.dumps(EXTRAS), [*WORK], tmp_path) == [0, []]
    assert Path("evaluation", "report.html").exists()


def _ended(asked: str, arguments: list[str], folder: Path) -> Any:
    """Return the exit status of a command, and which of the `asked` modules it has loaded."""
    done = subprocess.run(
        [sys.executable, "-c", _PROGRAM, asked, *arguments],
        env={**os.environ, "MUJOCO_GL": "disable"},  # otherwise the engine itself loads glfw where it is installed
        capture_output=True,
        text=True,
        check=True,
        timeout=TIMEOUT,
        cwd=folder,
    )
    return json.loads(done.stdout.splitlines()[-1])
