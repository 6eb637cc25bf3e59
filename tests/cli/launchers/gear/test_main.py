"""Tests of the launcher's entry point."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.processes import Process
from tests.support.waiting import TIMEOUT, wait_until


@pytest.mark.slow
def test_module_runs_launcher() -> None:
    ran = subprocess.run(
        [sys.executable, "-m", "cellwright.cli.launchers.gear", "-n", "foo: 1"],
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert ran.returncode == 1
    assert ran.stderr.startswith("Error: <text>:1: foo: ")


@pytest.mark.skipif(sys.platform == "win32", reason="a Ctrl-C cannot be sent to one process there")
def test_ctrl_c_during_import_prints_nothing(tmp_path: Path) -> None:
    # it sleeps for longer than the bound of the wait: only the signal can have ended it in time
    (tmp_path / "numpy.py").write_text("print('loading', flush=True)\nimport time\ntime.sleep(100_000)\n")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])}
    process = Process([sys.executable, "-m", "cellwright.cli.launchers.gear"], environment, tmp_path)
    try:
        process.wait_for("^loading$")
        status = process.interrupt()
    finally:
        process.kill()
    assert process.err == ""
    assert status == -signal.SIGINT


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="a Ctrl-C cannot be sent to one process there")
def test_ctrl_c_before_cell_exists_ends_launcher(tmp_path: Path) -> None:
    """It waits for the rest of a configuration that never comes, until it is interrupted."""
    from fcntl import ioctl
    from termios import FIONREAD

    command = [sys.executable, "-m", "cellwright.cli.launchers.gear", "-f", "/dev/stdin"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, cwd=tmp_path) as process:
        assert process.stdin is not None
        assert process.stderr is not None
        process.stdin.write(b"#")
        process.stdin.flush()
        pipe = process.stdin.fileno()
        wait_until(lambda: ioctl(pipe, FIONREAD, bytes(4)) == bytes(4), "reading of the configuration")
        process.send_signal(signal.SIGINT)
        assert process.wait(TIMEOUT) == 130
        assert process.stderr.read() == b""
