"""A robot's node as it is run from the command line: what it says, and that it ends well."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from cellwright.cli.teleop_node import TeleopOptions, run_node
from cellwright.devices.joint_servos import Motion
from cellwright.link.frames import Decoder, Kind, hello
from tests.teleop.robots import two_arms

ROOT = Path(__file__).parents[2]
PROGRAM = """
import sys
from cellwright.cli.teleop_node import TeleopOptions, run_node
from tests.teleop.robots import two_arms
sys.exit(run_node(lambda warn: two_arms(), TeleopOptions(port=0, as_json=True)))
"""


@contextmanager
def running() -> Iterator[tuple[subprocess.Popen[str], tuple[str, int]]]:
    """A node in a process of its own, and the address at which it is ready."""
    environment = {**os.environ, "PYTHONUNBUFFERED": "1", "PYTHONPATH": f"{ROOT / 'src'}{os.pathsep}{ROOT}"}
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        assert process.stderr is not None
        ready = process.stderr.readline()
        assert ready.startswith("ready: two_arms at 127.0.0.1:"), ready + process.communicate(timeout=10)[1]
        host, _, port = ready.split()[3].rstrip(",").rpartition(":")
        yield process, (host, int(port))
    finally:
        process.kill()
        process.communicate()


@pytest.mark.skipif(sys.platform == "win32", reason="no such signals there")
def test_ctrl_c_ends_it_within_a_second_with_a_summary() -> None:
    with running() as (process, address), socket.create_connection(address, timeout=10) as connection:
        connection.sendall(hello("/me", "cdr").encode())
        (welcome,) = Decoder().feed(connection.recv(1 << 20))
        assert welcome.json()["trial"] == "two_arms"
        begun = time.monotonic()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
        assert time.monotonic() - begun < 1.0
        (end,) = Decoder().feed(connection.recv(1 << 20))
        assert end.kind is Kind.ENDED
    assert process.returncode == 0
    assert "Traceback" not in err
    summary = json.loads(out)
    assert summary["outcome"] == "stopped"
    assert summary["commands"] == {"taken": 0, "refused": 0, "ignored": 0}
    assert summary["pace"]["factor"] == pytest.approx(1.0, abs=0.1)


def test_the_summary_for_people(capsys: pytest.CaptureFixture[str]) -> None:
    wanted = TeleopOptions(motion=Motion.TELEPORT, sim_time=True, speed=None, until=0.25, port=0)
    assert run_node(lambda _warn: two_arms(), wanted) == 0
    out = capsys.readouterr().out
    assert "as fast as it goes" in out
    assert "commands    0 taken, 0 refused, 0 ignored" in out
    assert "simulated   0.2 s" in out


def test_the_same_run_has_the_same_hash(capsys: pytest.CaptureFixture[str]) -> None:
    wanted = TeleopOptions(sim_time=True, speed=None, until=0.1, port=0, as_json=True)
    hashes = set()
    for _ in range(2):
        assert run_node(lambda _warn: two_arms(), wanted) == 0
        hashes.add(json.loads(capsys.readouterr().out)["state_hash"])
    assert len(hashes) == 1
