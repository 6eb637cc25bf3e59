"""The launcher's way in."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

LIMIT = 20.0


def test_the_module_is_the_launcher() -> None:
    ran = subprocess.run(
        [sys.executable, "-m", "cellwright.gear", "-n", "foo: 1"],
        capture_output=True,
        text=True,
        timeout=LIMIT,
        check=False,
    )
    assert ran.returncode == 1
    assert ran.stderr.startswith("Error: <text>:1: foo: ")


@pytest.mark.skipif(sys.platform == "win32", reason="a Ctrl-C cannot be sent to one process there")
def test_ctrl_c_while_it_is_being_loaded_says_nothing(tmp_path: Path) -> None:
    (tmp_path / "numpy.py").write_text("print('loading', flush=True)\nimport time\ntime.sleep(60)\n")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])}
    process = subprocess.Popen(
        [sys.executable, "-m", "cellwright.gear"],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    with process:
        assert process.stdout is not None
        assert process.stdout.readline() == "loading\n"
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=LIMIT)
    assert err == ""
    assert process.returncode == -signal.SIGINT


@pytest.mark.skipif(sys.platform == "win32", reason="a Ctrl-C cannot be sent to one process there")
def test_ctrl_c_before_there_is_a_cell(tmp_path: Path) -> None:
    """It waits for a configuration that never comes, and is interrupted."""
    os.mkfifo(tmp_path / "config.yaml")
    process = subprocess.Popen(
        [sys.executable, "-m", "cellwright.gear", "-f", str(tmp_path / "config.yaml")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    with process, (tmp_path / "config.yaml").open("w"):  # opened here once it is opened there
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=LIMIT)
    assert err == ""
    assert process.returncode == 130
