"""Tests of `cellwright teleop`: its output, its refusals, and its end at any moment."""

from __future__ import annotations

import json
import os
import signal
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from cellwright.middleware.messages import to_cdr
from cellwright.middleware.messages.conversions import joint_state
from cellwright.middleware.wire.frames import Decoder, Frame, FrameKind, advance, hello, read_time
from tests.cli.conftest import CommandLine
from tests.running.test_serving import hear
from tests.waiting import TIMEOUT
from tests.warm import WarmProcess, warm_start

COMMAND = [sys.executable, "-m", "cellwright", "teleop", "tandem", "--port", "0", "--json"]


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["tandme"], "unknown robot 'tandme'; did you mean tandem"),
        (["no/vr_configs.yml"], "no/vr_configs.yml: there is no such file"),
        (["tandem", "--rate", "99"], "--rate 99: give a number of steps a second from 100 to 10000"),
        (["tandem", "--rate", "1/0"], "--rate 1/0: give a number of steps"),
        (["tandem", "--speed", "2"], "--speed 2: time other than the wall clock's has to be told: add --sim-time"),
        (["tandem", "--watchdog", "0"], "watchdog: give a number above 0, not 0"),
        (["tandem", "--max-age", "nan"], "max age: give a number above 0, not nan"),
        (["tandem", "--max-speed", "fast"], "--max-speed fast: give a speed above 0"),
        (["tandem", "--max-speed", "no_*=1", "--port", "0"], "unknown joint 'no_*'"),
        (["tandem", "--start-guard-then", "blend"], "add --start-guard 0.8"),
        (["tandem", "--port", "70000"], "a port is from 0 to 65535"),
        (["tandem", "--record", "run.txt"], "--record run.txt: give a file such as run.mcap"),
        (["tandem", "--check", "--record", "run.mcap"], "--check: leave out --record"),
        (["tandem", "--until", "-1"], "--until -1: give a time"),
    ],
)
def test_bad_input_is_one_line_and_status_2(arguments: list[str], reason: str, cellwright: CommandLine) -> None:
    ran = cellwright("teleop", *arguments)
    assert ran.status == 2
    assert ran.out == ""
    assert reason in ran.err
    assert ran.err.count("\n") == 1


def test_the_summary_for_people(cellwright: CommandLine) -> None:
    ran = cellwright("teleop", "tandem", "--sim-time", "--speed", "max", "--until", "0.25", "--port", "0", "-v")
    assert ran.status == 0
    assert "as fast as it goes" in ran.out
    assert "commands    0 taken, 0 refused, 0 ignored" in ran.out
    assert "simulated   0.2 s" in ran.out
    assert "state hash" in ran.out


def test_a_node_that_takes_no_commands_yet_says_so(cellwright: CommandLine) -> None:
    ran = cellwright("teleop", "tandem", "--start-disabled", "--sim-time", "--until", "0.01", "--port", "0")
    assert ran.out.splitlines()[0].endswith(", real time, commands disabled until enabled with /io_teleop/set_enabled")


def test_the_same_run_has_the_same_hash(cellwright: CommandLine) -> None:
    arguments = ("--sim-time", "--speed", "max", "--until", "0.1", "--rate", "1000", "--port", "0", "--json")
    first, second = (json.loads(cellwright("teleop", "tandem", *arguments).out) for _ in range(2))
    assert first["steps"] == 100
    assert first["state_hash"] == second["state_hash"]


@contextmanager
def running(*arguments: str) -> Iterator[tuple[WarmProcess, socket.socket, Decoder]]:
    """Yield a node in a process of its own, and a client that has its welcome."""
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    process = warm_start().popen([*COMMAND, *arguments], folder=Path.cwd(), environment=environment)
    try:
        assert process.stderr is not None
        ready = process.stderr.readline()
        assert ready.startswith("ready: "), ready + process.communicate(timeout=TIMEOUT)[1]
        host, _, port = ready.split()[3].rstrip(",").rpartition(":")
        with socket.create_connection((host, int(port)), timeout=TIMEOUT) as connection:
            decoder = Decoder()
            connection.sendall(hello("/me", "cdr").encode())
            (welcome,) = hear(connection, decoder)
            assert welcome.json()["topics"]
            yield process, connection, decoder
    finally:
        process.kill()
        process.communicate()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no such signals there")
def test_ctrl_c_in_mid_motion_ends_it_at_once_with_a_summary() -> None:
    with running() as (process, connection, decoder):
        message = to_cdr(joint_state(["no joint"], [1.0], time=0))
        connection.sendall(Frame(FrameKind.PUBLISH, 1, "/io_teleop/joint_cmd", payload=message).encode())
        assert [frame.kind for frame in hear(connection, decoder)] == [FrameKind.DONE]
        connection.sendall(Frame(FrameKind.PUBLISH, 2, "/io_teleop/joint_cmd", payload=b"rubbish").encode())
        assert [frame.kind for frame in hear(connection, decoder)] == [FrameKind.REFUSED]
        process.send_signal(signal.SIGINT)
        assert [frame.kind for frame in hear(connection, decoder)] == [FrameKind.ENDED]
        out, err = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 0
    assert "Traceback" not in err
    assert "'no joint' is no joint of this robot" in err
    summary = json.loads(out)
    assert summary["outcome"] == "stopped"
    assert summary["commands"] == {"taken": 0, "refused": 1, "ignored": 1}
    assert summary["refused"] == {"/io_teleop/joint_cmd from /me": 1}
    assert summary["unknown_names"] == ["no joint"]
    assert 0.0 < summary["pace"]["factor"] <= 1.0 + 1e-9  # a slow machine falls behind, none runs ahead


@pytest.mark.slow
def test_an_agent_of_a_cell_is_refused(cellwright: CommandLine) -> None:
    with running("--lockstep") as (_, connection, _):
        host, port = connection.getpeername()
        ran = cellwright("run", "--connect", f"{host}:{port}")
    assert ran.status == 2
    assert ran.err == f"error: --connect {host}:{port}: no cell is served there, but tandem, a robot's node\n"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no such signals there")
def test_in_lockstep_time_stands_until_it_is_asked_for() -> None:
    with running("--lockstep") as (process, connection, decoder):
        connection.sendall(advance(1, 500_000_000, each_tick=False).encode())
        (answer,) = hear(connection, decoder)
        assert read_time(answer) == 500_000_000
        process.send_signal(signal.SIGTERM)
        out, _ = process.communicate(timeout=TIMEOUT)
    summary = json.loads(out)
    assert (process.returncode, summary["steps"], summary["pace"]) == (0, 120, None)
