"""Tests of a served cell from a program in another process."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from cellwright.middleware.wire.frames import Decoder, Frame, FrameKind, advance, hello, read_time
from tests.support.waiting import TIMEOUT
from tests.support.warm import WarmProcess, warm_start

COMMAND = [sys.executable, "-m", "cellwright", "serve"]

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no such signals there")


@contextmanager
def serving(folder: Path, *arguments: str, **more: str) -> Iterator[tuple[WarmProcess, tuple[str, int]]]:
    """Yield a process that serves, and the address in its ready line."""
    environment = {**os.environ, "PYTHONUNBUFFERED": "1", "COLUMNS": "80", **more}
    process = warm_start().popen([*COMMAND, *arguments, "--port", "0"], folder=folder, environment=environment)
    try:
        lines = process.stderr if "--json" in arguments else process.stdout
        assert lines is not None
        ready = lines.readline()
        assert ready.startswith("ready: "), ready + process.communicate(timeout=TIMEOUT)[1]
        host, _, port = ready.split()[3].rstrip(",").rpartition(":")
        yield process, (host, int(port))
    finally:
        process.kill()
        process.communicate()


def hear(connection: socket.socket, decoder: Decoder) -> list[Frame]:
    """Return the next frames; a long one may come in pieces."""
    frames: list[Frame] = []
    while not frames and (data := connection.recv(1 << 20)):
        frames = list(decoder.feed(data))
    return frames


def ended(process: WarmProcess, number: int = signal.SIGINT) -> tuple[int, str, str]:
    """Send a process a signal; return its status and its output."""
    process.send_signal(number)
    out, err = process.communicate()
    assert "Traceback" not in out + err
    return process.wait(), out, err


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_serve_runs_until_signal_and_prints_score(number: int, tmp_path: Path) -> None:
    with (
        serving(tmp_path, "lesson", "-v") as (process, address),
        socket.create_connection(address, timeout=TIMEOUT) as connection,
    ):
        connection.sendall(hello("/me", "cdr").encode())
        decoder = Decoder()
        (welcome,) = hear(connection, decoder)
        assert welcome.json()["trial"] == "lesson"
        status, out, _ = ended(process, number)
        (end,) = hear(connection, decoder)
        assert end.kind is FrameKind.ENDED
    assert status == 0
    assert "score       0 of 12 points" in out
    assert "pace " in out


@pytest.mark.slow
def test_lockstep_time_advances_only_on_request(tmp_path: Path) -> None:
    with serving(tmp_path, "lesson", "--lockstep", "--json") as (process, address):
        with socket.create_connection(address, timeout=TIMEOUT) as connection:
            connection.sendall(hello("/me", "cdr").encode())
            decoder = Decoder()
            (welcome,) = hear(connection, decoder)
            assert welcome.json()["lockstep"]
            connection.sendall(advance(1, 100_000_000, each_tick=False).encode())
            (answer,) = hear(connection, decoder)
            assert read_time(answer) == 100_000_000
            connection.sendall(advance(2, 200_000_000, each_tick=True).encode())
            (answer,) = hear(connection, decoder)
            assert read_time(answer) == 102_000_000
        status, out, _ = ended(process)
    assert status == 0
    result = json.loads(out)
    assert (result["steps"], result["simulated"], result["pace"]) == (51, 0.102, None)


@pytest.mark.slow
@pytest.mark.parametrize("way", ["option", "environment"])
def test_serve_with_exit_on_completion_ends_with_competition(way: str, tmp_path: Path) -> None:
    arguments = ["lesson", "--speed", "max", *(["--exit-on-completion"] if way == "option" else [])]
    more = {"ARIAC_EXIT_ON_COMPLETION": ""} if way == "environment" else {}
    with (
        serving(tmp_path, *arguments, "--json", **more) as (process, address),
        socket.create_connection(address, timeout=TIMEOUT) as connection,
    ):
        connection.sendall(hello("/me", "ros1").encode())
        connection.sendall(Frame(FrameKind.CALL, 1, "/ariac/end_competition", "std_srvs/Trigger").encode())
        out, _ = process.communicate(timeout=TIMEOUT)
    result = json.loads(out)
    assert (process.returncode, result["competition_state"], result["outcome"]) == (0, "done", "done")


@pytest.mark.slow
def test_port_in_use_is_reported_in_one_line(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        ran = subprocess.run(
            [*COMMAND, "lesson", "--port", port],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=TIMEOUT,
            check=False,
        )
    assert ran.returncode == 2
    assert ran.stderr.startswith(f"error: 127.0.0.1:{port}: cannot listen: ")
    assert ran.stderr.count("\n") == 1
