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

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.conversions import joint_state
from cellwright.middleware.wire.frames import Decoder, Frame, FrameKind, advance, hello, read_time
from tests.cli.conftest import CommandLine
from tests.running.test_serving import hear
from tests.support.waiting import TIMEOUT
from tests.support.warm import WarmProcess, warm_start

COMMAND = [sys.executable, "-m", "cellwright", "teleop", "tandem", "--port", "0", "--json"]


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["tandme"], "unknown robot 'tandme'; did you mean tandem"),
        (["no/vr_configs.yml"], "no/vr_configs.yml: there is no such file"),
        (["tandem", "--rate", "99"], "--rate 99: give a rate from 100 to 10000 Hz"),
        (["tandem", "--rate", "1/0"], "--rate 1/0: give a rate"),
        (["tandem", "--speed", "2"], "--speed 2 requires --sim-time"),
        (["tandem", "--watchdog", "0"], "watchdog must be a finite number above 0 (got 0)"),
        (["tandem", "--max-age", "nan"], "max age must be a finite number above 0 (got nan)"),
        (["tandem", "--max-speed", "fast"], "--max-speed fast: give a speed above 0"),
        (["tandem", "--max-speed", "no_*=1", "--port", "0"], "unknown joint 'no_*'"),
        (["tandem", "--start-guard-then", "blend"], "requires --start-guard (for example --start-guard 0.8)"),
        (["tandem", "--port", "70000"], "port must be from 0 to 65535"),
        (["tandem", "--record", "run.txt"], "--record run.txt: give a file such as run.mcap"),
        (["tandem", "--check", "--record", "run.mcap"], "--check cannot be combined with --record"),
        (["tandem", "--until", "-1"], "--until -1: give a time"),
    ],
)
def test_invalid_input_prints_one_line_and_exits_with_2(
    arguments: list[str], reason: str, cellwright: CommandLine
) -> None:
    ran = cellwright("teleop", *arguments)
    assert ran.status == 2
    assert ran.out == ""
    assert reason in ran.err
    assert ran.err.count("\n") == 1


def test_summary_lists_commands_and_pace(cellwright: CommandLine) -> None:
    ran = cellwright("teleop", "tandem", "--sim-time", "--speed", "max", "--until", "0.25", "--port", "0", "-v")
    assert ran.status == 0
    assert "as fast as possible" in ran.out
    assert "commands    0 taken, 0 refused, 0 ignored" in ran.out
    assert "simulated   0.2 s" in ran.out
    assert "state hash" in ran.out


def test_node_started_disabled_prints_it(cellwright: CommandLine) -> None:
    ran = cellwright("teleop", "tandem", "--start-disabled", "--sim-time", "--until", "0.01", "--port", "0")
    assert ran.out.splitlines()[0].endswith(", real time, commands disabled until enabled with /io_teleop/set_enabled")


def test_same_run_has_same_state_hash(cellwright: CommandLine) -> None:
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
def test_ctrl_c_during_motion_ends_node_with_summary() -> None:
    with running() as (process, connection, decoder):
        message = TYPES.to_cdr(joint_state(["no joint"], [1.0], time=0))
        connection.sendall(Frame(FrameKind.PUBLISH, 1, "/io_teleop/joint_cmd", payload=message).encode())
        assert [frame.kind for frame in hear(connection, decoder)] == [FrameKind.DONE]
        connection.sendall(Frame(FrameKind.PUBLISH, 2, "/io_teleop/joint_cmd", payload=b"rubbish").encode())
        assert [frame.kind for frame in hear(connection, decoder)] == [FrameKind.REFUSED]
        process.send_signal(signal.SIGINT)
        assert [frame.kind for frame in hear(connection, decoder)] == [FrameKind.ENDED]
        out, err = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 0
    assert "Traceback" not in err
    assert "'no joint' is not a joint of this robot" in err
    summary = json.loads(out)
    assert summary["outcome"] == "stopped"
    assert summary["commands"] == {"taken": 0, "refused": 1, "ignored": 1}
    assert summary["refused"] == {"/io_teleop/joint_cmd from /me": 1}
    assert summary["unknown_names"] == ["no joint"]
    assert 0.0 < summary["pace"]["factor"] <= 1.0 + 1e-9  # a slow machine falls behind, none runs ahead


@pytest.mark.slow
def test_agent_connected_to_robot_node_is_refused(cellwright: CommandLine) -> None:
    with running("--lockstep") as (_, connection, _):
        host, port = connection.getpeername()
        ran = cellwright("run", "--connect", f"{host}:{port}")
    assert ran.status == 2
    assert ran.err == f"error: --connect {host}:{port}: serves tandem, a robot's node; give the address of a cell\n"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no such signals there")
def test_lockstep_time_advances_only_on_request() -> None:
    with running("--lockstep") as (process, connection, decoder):
        connection.sendall(advance(1, 500_000_000, each_tick=False).encode())
        (answer,) = hear(connection, decoder)
        assert read_time(answer) == 500_000_000
        process.send_signal(signal.SIGTERM)
        out, _ = process.communicate(timeout=TIMEOUT)
    summary = json.loads(out)
    assert (process.returncode, summary["steps"], summary["pace"]) == (0, 120, None)
