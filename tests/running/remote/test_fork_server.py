"""Tests of a fork server: its programs behave as those that an interpreter starts, and none depends on another."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

import pytest

from cellwright.running.remote.fork_server import CAN_FORK, ForkedProcess, ForkServer
from cellwright.running.remote.guarded import MARK, GuardedProcess, guarding_server
from tests.support.processes import is_running
from tests.support.waiting import TIMEOUT, wait_until

pytestmark = pytest.mark.skipif(not CAN_FORK, reason="has no fork server there")

PROGRAMS = {
    "says": """
import atexit, os, sys
def main():
    atexit.register(print, "the end")
    print(os.path.basename(os.getcwd()), sys.argv[2:], os.environ.get("WORD"), "HOME" in os.environ, sys.stdin.read())
    print("no", file=sys.stderr)
    sys.exit(3)
""",
    "fails": """
def main():
    raise LookupError("the part is gone")
""",
    "waits": """
import signal
def main():
    print("ready", flush=True)
    signal.pause()
""",
    "signals": """
import signal, threading
def main():
    numbers = (signal.SIGINT, signal.SIGCHLD, signal.SIGTERM)
    print([signal.getsignal(number) for number in numbers], signal.set_wakeup_fd(-1), threading.active_count())
""",
    "files": """
import os
def main():
    print(sorted(os.listdir("/proc/self/fd"), key=int)[:-1])
""",
    "draws": """
import random
import numpy
def main():
    print(random.random(), numpy.random.random())
""",
    "parent": """
import os, subprocess, sys
def main():
    code = "import time; print('child', flush=True); time.sleep(600)"
    child = subprocess.Popen([sys.executable, "-c", code], start_new_session=True)
    print(os.getpid(), child.pid, os.getppid(), flush=True)
    sys.stdin.read()
""",
    "full": """
import errno, os
def fork():
    raise OSError(errno.EAGAIN, "no room")
os.fork = fork
""",
}
"""Programs by the name of their module."""

Serve = Callable[..., ForkServer]


@pytest.fixture
def serve(tmp_path: Path) -> Iterator[Serve]:
    """Return a function that makes a server which has loaded modules of `PROGRAMS`."""
    for name, text in PROGRAMS.items():
        (tmp_path / f"{name}.py").write_text(text)
    servers = []

    def make(*modules: str, guards: bool = False) -> ForkServer:
        environment = {**os.environ, "PYTHONPATH": str(tmp_path), "PYTHONHASHSEED": "0"}
        servers.append((guarding_server if guards else ForkServer)(modules, environment))
        return servers[-1]

    yield make
    for server in servers:
        server.close()


def run(
    server: ForkServer, *command: str, stderr: IO[bytes] | int = subprocess.STDOUT, **words: str
) -> tuple[int, str]:
    """Run a program to its end; return its exit status and what it printed."""
    process = server.popen(command, env=words or os.environ, stderr=stderr)
    process.stdin.close()
    with process.stdout:
        text = process.stdout.read().decode()
    return process.wait(TIMEOUT), text


def lines_of(stream: IO[bytes], lines: list[str]) -> None:
    lines.extend(line.decode() for line in iter(stream.readline, b""))


def test_program_has_its_words_its_environment_and_its_streams(
    serve: Serve, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    server = serve("says")
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    said = "work ['a', 'b c'] hello False \n"
    assert run(server, "says", "a", "b c", WORD="hello") == (3, f"{said}no\nthe end\n")
    with (tmp_path / "log").open("wb") as log:
        assert run(server, "says", stderr=log) == (3, "work [] None True \nthe end\n")
    assert (tmp_path / "log").read_text() == "no\n"


def test_error_is_printed_and_ends_its_program_alone(serve: Serve) -> None:
    server = serve("fails", "waits")
    other = server.popen(["waits"], env=os.environ, stderr=2)
    status, text = run(server, "fails")
    assert status == 1
    assert text.startswith("Traceback")
    assert text.endswith("LookupError: the part is gone\n")
    status, text = run(server, "strange")
    assert (status, text.splitlines()[-1]) == (1, "ModuleNotFoundError: No module named 'strange'")
    assert other.poll() is None
    with pytest.raises(subprocess.TimeoutExpired):
        other.wait(0.0)
    end(other)
    assert other.returncode == -signal.SIGKILL


def end(process: ForkedProcess) -> None:
    process.kill()
    process.wait(TIMEOUT)
    process.stdin.close()
    process.stdout.close()


def test_program_finds_signals_and_files_as_one_that_was_started(serve: Serve) -> None:
    server = serve("signals", "files", "waits")
    before = server.popen(["waits"], env=os.environ, stderr=2)
    handlers = [signal.default_int_handler, signal.SIG_DFL, signal.SIG_DFL]
    assert run(server, "signals") == (0, f"{handlers} -1 1\n")
    assert run(server, "files") == (0, "['0', '1', '2']\n")
    end(before)


def test_signals_reach_a_program(serve: Serve) -> None:
    server = serve("waits")
    for number, send in ((signal.SIGTERM, "terminate"), (signal.SIGKILL, "kill")):
        process = server.popen(["waits"], env=os.environ, stderr=2)
        assert process.stdout.readline() == b"ready\n"
        getattr(process, send)()
        assert process.wait(TIMEOUT) == -number
        getattr(process, send)()  # of no effect
        end(process)


def test_no_program_draws_the_numbers_of_another(serve: Serve) -> None:
    server = serve("draws")
    drawn = [number for _ in range(2) for number in run(server, "draws")[1].split()]
    assert len(set(drawn)) == 4


def test_server_that_has_ended_is_noticed(serve: Serve) -> None:
    server = serve("waits")
    process = server.popen(["waits"], env=os.environ, stderr=2)
    assert process.stdout.readline() == b"ready\n"
    os.kill(parent_of(process.pid), signal.SIGKILL)
    assert process.wait(TIMEOUT) == -signal.SIGKILL  # as far as can be known
    os.kill(process.pid, signal.SIGKILL)
    process.stdin.close()
    process.stdout.close()
    wait_until(lambda: not server.is_running, "end of the server")
    with pytest.raises(ChildProcessError, match="the fork server has ended"):
        server.popen(["waits"], env=os.environ, stderr=2)


def parent_of(process: int) -> int:
    return int(Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[1])


def test_programs_outlive_a_closed_server(serve: Serve) -> None:
    server = serve("waits")
    process = server.popen(["waits"], env=os.environ, stderr=2)
    assert process.stdout.readline() == b"ready\n"
    server.close()
    assert not server.is_running
    assert is_running(process.pid)
    os.kill(process.pid, signal.SIGKILL)
    process.stdin.close()
    process.stdout.close()


def test_machine_without_room_is_an_error_of_the_start(serve: Serve) -> None:
    with pytest.raises(OSError, match="Resource temporarily unavailable") as caught:
        serve("full").popen(["says"], env=os.environ, stderr=2)
    assert caught.value.errno == errno.EAGAIN


def test_module_that_cannot_be_loaded_is_named(serve: Serve, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ChildProcessError):
        serve("strange").popen(["strange"], env=os.environ, stderr=2)
    assert "No module named 'strange'" in capfd.readouterr().err


def guarded(server: ForkServer, lines: list[str]) -> GuardedProcess:
    return GuardedProcess(
        ["parent"],
        relays=True,
        environment=dict(os.environ),
        stderr=2,
        read=lambda output: lines_of(output, lines),
        server=server,
    )


@pytest.mark.parametrize("kills_guard", [False, True])
def test_children_of_a_guarded_program_end_with_it_alone(kills_guard: bool, serve: Serve) -> None:
    server = serve("parent", guards=True)
    said: tuple[list[str], list[str]] = ([], [])
    one, other = (guarded(server, lines) for lines in said)
    try:
        wait_until(lambda: all(len(lines) == 2 for lines in said), "programs and their children")
        (program, child, guard), others = (
            [int(word) for line in lines if not line.startswith("child") for word in line.split()] for lines in said
        )
        marks = [Path(f"/proc/{each}/environ").read_bytes().split(b"\0") for each in (program, child, guard, *others)]
        mine, theirs = (
            {entry for found in each for entry in found if entry.startswith(f"{MARK}=".encode())}
            for each in (marks[:3], marks[3:])
        )
        assert len(mine) == len(theirs) == 1
        assert mine != theirs
        if kills_guard:
            os.kill(guard, signal.SIGKILL)
        one.end(TIMEOUT)
        assert not any(map(is_running, (program, child, guard)))
        assert all(map(is_running, others))
    finally:
        one.end(TIMEOUT)
        other.end(TIMEOUT)
    assert not any(map(is_running, others))


def test_guarded_program_that_fails_ends_its_guard(serve: Serve) -> None:
    server = serve("fails", guards=True)
    lines: list[str] = []
    with open(os.devnull, "wb") as log:
        process = GuardedProcess(
            ["fails"],
            environment=dict(os.environ),
            stderr=log,
            read=lambda output: lines_of(output, lines),
            server=server,
        )
    wait_until(lambda: not process.is_running, "end of the program")
    process.end(TIMEOUT)
    assert process._process.returncode == 1
    assert lines == []
