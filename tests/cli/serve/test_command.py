"""Tests of `cellwright serve`: its output, its refusals, and its end at any moment."""

from __future__ import annotations

import json
import os
import signal
import socket
import sys
from contextlib import closing
from pathlib import Path

import pytest

from cellwright import Cell, Session, load_trial
from cellwright.cli.serve import WorldChange
from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.middleware.wire.frames import Decoder, Frame, FrameKind, advance, hello
from cellwright.running.run import ServerOptions
from tests.cli.conftest import CommandLine
from tests.running.test_serving import ended, hear, serving
from tests.support.processes import Process
from tests.support.waiting import TIMEOUT


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["no.yaml"], "no.yaml: there is no such file"),
        (["lesson", "--speed", "0"], "--speed 0: give a factor above 0"),
        (["lesson", "--speed", ""], "--speed : give a factor above 0"),
        (["lesson", "--port", "70000"], "port must be from 0 to 65535"),
        (["lesson", "--host", "no.such.host.invalid"], "no.such.host.invalid: cannot listen"),
        (["lesson", "--until", "-1"], "--until -1: give a time"),
        (["lesson", "--log", "run.txt"], "--log run.txt: give a file whose name ends in .jsonl"),
        (["lesson", "--picture", "cell.jpg"], "--picture cell.jpg: give a file whose name ends in .png"),
        (["lesson", "--picture", "no/cell.png"], "--picture no/cell.png: there is no folder no"),
        (["lesson", "--camera", "nowhere"], "--camera: unknown view 'nowhere'"),
    ],
)
def test_invalid_input_prints_one_line(arguments: list[str], reason: str, cellwright: CommandLine) -> None:
    ran = cellwright("serve", *arguments)
    assert (ran.status, ran.out) == (2, "")
    assert reason in ran.err
    assert ran.err.count("\n") == 1


def test_served_cell_stops_at_until(cellwright: CommandLine, tmp_path: Path) -> None:
    ran = cellwright(
        "serve", "lesson", "--port", "0", "--speed", "max", "--until", "0.5", "--json", "--log", "run.jsonl"
    )
    result = json.loads(ran.out)
    assert (ran.status, result["simulated"], result["outcome"], result["agent"]) == (0, 0.5, "until", "served")
    assert result["pace"] is None
    assert ran.err.startswith("ready: lesson at 127.0.0.1:")
    assert ran.err.endswith(", as fast as possible\n")
    log = [json.loads(line)["kind"] for line in (tmp_path / "run.jsonl").read_text().splitlines()]
    assert (log[0], log[-1]) == ("run", "result")


@pytest.mark.usefixtures("small_pictures")
def test_picture_is_written_at_the_end(cellwright: CommandLine, tmp_path: Path) -> None:
    options = ["--port", "0", "--speed", "max", "--until", "0.1", "--json"]
    seen = {}
    for view in ("overview", "agv1"):
        ran = cellwright("serve", "lesson", *options, "--picture", f"{view}.png", "--camera", view)
        assert (ran.status, json.loads(ran.out)["pictures"]) == (0, [f"{view}.png"])
        seen[view] = (tmp_path / f"{view}.png").read_bytes()
        assert seen[view].startswith(b"\x89PNG")
    assert seen["overview"] != seen["agv1"]


def test_open_address_prints_warning(cellwright: CommandLine) -> None:
    ran = cellwright("serve", "lesson", "--port", "0", "--speed", "max", "--until", "0.1", "--host", "0.0.0.0")
    assert ran.status == 0
    assert (
        ran.err == "warning: 0.0.0.0: open to the network; every program that reaches this machine can drive the cell\n"
    )


def test_verbose_prints_pace(cellwright: CommandLine) -> None:
    ran = cellwright("serve", "lesson", "--port", "0", "--speed", "4", "--until", "0.2", "--json")
    pace = json.loads(ran.out)["pace"]
    assert 0.0 < pace["factor"] <= 4.0 + 1e-9  # a slow machine falls behind, none runs ahead
    assert pace["worst_lateness"] >= 0.0


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no such signals there")
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], b""),
        (["--lockstep"], hello("/me", "cdr").encode() + advance(1, 10**15, each_tick=False).encode()),
        (["--speed", "max"], hello("/me", "cdr").encode() + Frame(FrameKind.SUBSCRIBE, 5, "/clock").encode()),
    ],
    ids=["at once", "while a client waits", "while a client listens"],
)
def test_ctrl_c_at_any_time_ends_with_result(arguments: list[str], message: bytes, tmp_path: Path) -> None:
    """While it serves; it prints the score, and the status is 0."""
    with serving(tmp_path, "lesson", *arguments) as (process, address), socket.create_connection(address) as client:
        if message:
            client.settimeout(TIMEOUT)
            client.sendall(message)
            assert hear(client, Decoder())
        status, out, _ = ended(process)
    assert status == 0
    assert "outcome     stopped before the competition was done\n" in out


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no such signals there")
@pytest.mark.parametrize(
    ("event", "about"), [("import", "cellwright.running.run.session"), ("open", "lesson.yaml"), ("socket.bind", "")]
)
def test_ctrl_c_during_start_prints_no_traceback(event: str, about: str, tmp_path: Path) -> None:
    """It stops at an event of its start, where the signal interrupts it."""
    command = [sys.executable, "-c", STOPS_AT, event, about, "serve", "lesson", "--port", "0"]
    process = Process(command, os.environ, tmp_path)
    try:
        process.wait_for("^so far$")
        status = process.interrupt()
    finally:
        process.kill()
    assert "Traceback" not in process.said
    assert status in (0, 130, -signal.SIGINT)


STOPS_AT = """
import os, runpy, select, signal, sys

event, about = sys.argv[1:3]
del sys.argv[1:3]

def stop(name, args):
    global event
    if name == event and about in str(args):
        event = ""
        heard, wake = os.pipe()
        os.set_blocking(wake, False)
        signal.set_wakeup_fd(wake)
        print("so far", flush=True)
        select.select([heard], [], [])  # it goes on when a handler has taken note of the signal
        signal.set_wakeup_fd(-1)

sys.addaudithook(stop)
runpy.run_module("cellwright", run_name="__main__", alter_sys=True)
"""


@pytest.mark.slow
def test_served_cell_changes_to_another_trial_on_request(tmp_path: Path) -> None:
    with serving(tmp_path, "lesson", "-d") as (process, address):
        with closing(SocketTransport(address, node="/tester")) as client:
            assert client.ask_server("simulation/LoadWorld", {"uri": "final01"})["world"]["name"] == "final01"
        assert process.stdout is not None
        lines = iter(process.stdout.readline, "")
        ready = next(line for line in lines if line.startswith("ready: "))
        assert ready.startswith(f"ready: final01 at 127.0.0.1:{address[1]},")
        with closing(SocketTransport(address, node="/tester")) as client:
            assert client.welcome["trial"] == "final01"
            assert client.ask_server("simulation/GetCurrentWorld")["world"]["name"] == "final01"
        status, out, _ = ended(process)
    assert (status, "order_0, kit order_0_kit_0: not announced" in out) == (0, True)


@pytest.mark.parametrize("is_stopped", [False, True])
def test_next_world_is_taken_unless_session_was_stopped(is_stopped: bool) -> None:
    """A signal between the request and the change ends all."""
    worlds = WorldChange(lambda trial: Cell(trial, competition=False))
    with Session("lesson", serve=ServerOptions(port=0, worlds=worlds.options())) as session:
        worlds.load(session, load_trial("lesson"))
        if is_stopped:
            session.stop.request("stopped by a signal")
        else:
            while not session.stop.is_requested:
                for poll in session.on_poll:
                    poll()
        assert (worlds.take(session) is None) == is_stopped
        assert worlds.take(session) is None
        assert session.address is not None
        assert worlds.port == session.address[1]
