"""Tests of the report of a run: kinds of programs, and the lines about failures."""

import os
import sys
from pathlib import Path

import pytest

from tests.support.processes import Process
from tests.support.run_report import kind_of

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("command", "kind"),
    [
        (["/a/.venv/bin/python", "-m", "cellwright", "run", "lesson"], "Python"),
        (["/usr/bin/python3", "client.py"], "Python"),
        (["python", "-m", "cellwright", "serve", "lesson", "--view"], "page"),
        (["python", "-m", "cellwright", "view", "lesson"], "page"),
        (["/usr/bin/rosmaster", "--core"], "ROS 1 master"),
        (["/usr/bin/python3", "/usr/bin/roscore"], "ROS 1 master"),
        (["/a/driver/node", "run-driver"], "browser"),
        (["sh", "-c", "python"], "other program"),
    ],
)
def test_kind_of_command(command: list[str], kind: str) -> None:
    assert kind_of(command) == kind


@pytest.mark.slow
def test_failures_are_last_with_command_to_repeat(tmp_path: Path) -> None:
    (tmp_path / "test_red.py").write_text(
        "import pytest, subprocess\n"
        "@pytest.mark.parametrize('it', ['a b'])\n"
        "def test_fails(it):\n    subprocess.run(['true']); assert it == 'last words'\n"
        "@pytest.fixture\ndef broken():\n    raise ValueError('no cell')\n"
        "def test_errs(broken): pass\n"
        "def test_passes(): pass\n"
    )
    plugins = ["-p", "tests.support.leftovers", "-p", "tests.support.run_report", "-p", "no:cacheprovider"]
    command = [sys.executable, "-m", "pytest", "--rootdir", str(tmp_path), *plugins, "-n", "2", str(tmp_path)]
    ran = Process(command, {**os.environ, "PYTHONPATH": str(ROOT)}, tmp_path)
    assert ran.finish() == 1
    report = ran.out[ran.out.index("2 red, each with the command") :]
    assert (
        "    AssertionError: assert 'a b' == 'last words'\n    .venv/bin/pytest 'test_red.py::test_fails[a b]'"
        in report
    )
    assert "    ValueError: no cell\n    .venv/bin/pytest test_red.py::test_errs\n" in report
    assert "starts by tests, without what those start in turn: 0 Python" in ran.out
    assert "1 other program" in ran.out
