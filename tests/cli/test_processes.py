"""Tests of the command as a process of its own, as a shell runs it."""

import os
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from cellwright import open_recording
from cellwright.util.files import read_json_lines
from tests.support.processes import Process
from tests.support.waiting import TIMEOUT
from tests.support.warm import warm_start

COMMAND = [sys.executable, "-m", "cellwright"]


def run(*arguments: str, folder: Path, **more: str) -> subprocess.CompletedProcess[str]:
    """Run a command in an interpreter of its own."""
    environment = {**os.environ, "COLUMNS": "80", "PYTHONIOENCODING": "utf-8", **more}
    return subprocess.run(
        [*COMMAND, *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )


@pytest.mark.slow
def test_exit_status_reaches_shell(tmp_path: Path) -> None:
    until = ("--agent", "none", "--until", "0.1", "--no-picture")
    assert run("run", "lesson", *until, "--min-score", "1", folder=tmp_path).returncode == 1
    refused = run("run", "no.yaml", folder=tmp_path)
    assert (refused.returncode, refused.stdout, refused.stderr) == (2, "", "error: no.yaml: there is no such file\n")


@pytest.mark.slow
def test_same_run_in_two_processes_has_same_state_hash_and_commands(tmp_path: Path) -> None:
    hashes, commands = set(), []
    for seed, more in (("0", ()), ("3", ("--listen", "all"))):  # with these, sets of text have other orders
        options = ("--until", "4", "--no-picture", "--record", f"{seed}.mcap")
        ran = run("run", "lesson", *options, *more, folder=tmp_path, PYTHONHASHSEED=seed)
        hashes.add(next(line for line in ran.stdout.splitlines() if line.startswith("state hash")))
        with open_recording(tmp_path / f"{seed}.mcap") as recording:
            commands.append([*recording.commands()])
    assert len(hashes) == 1
    assert commands[0] == commands[1] != []


@pytest.mark.slow
def test_ascii_terminal_gets_escaped_output(tmp_path: Path) -> None:
    ran = run(
        "run", "lesson", "--until", "0.1", "--agent", "none", "--no-picture", folder=tmp_path, PYTHONIOENCODING="ascii"
    )
    assert ran.returncode == 0
    assert ran.stdout.isascii()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no such signal there")
@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_signal_ends_run_with_score(number: str, tmp_path: Path) -> None:
    process = Process(
        [*COMMAND, "run", "lesson", "--agent", "none", "--until", "1e6", "--speed", "1", "--log", "a.jsonl"],
        os.environ,
        tmp_path,
        warm=warm_start(),
    )
    try:
        process.wait_for("^trial lesson(.*\n)+.*real time")  # it is under way
        process.signal(getattr(signal, number))
        status = process.finish()
    finally:
        process.kill()
    assert status == 1
    assert read_json_lines(tmp_path / "a.jsonl")[-1]["outcome"] == "interrupted"
    assert "outcome     interrupted\n" in process.out
    assert "state hash" in process.out
    assert "Traceback" not in process.err
    assert not (tmp_path / "lesson.png").exists()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no such signal there")
@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM"])
def test_page_without_terminal_stays_until_signal(number: str, tmp_path: Path) -> None:
    process = Process(
        [
            *(*COMMAND, "run", "lesson", "--agent", "none", "--until", "0.1", "--speed", "max", "--no-picture"),
            *("--min-score", "1", "--view", "--view-port", "0"),
        ],
        os.environ,
        tmp_path,
        warm=warm_start(),
    )
    try:
        url = process.wait_for(r"^page: (\S+)$")[1]
        process.wait_for("^state hash(.*\n)+^the page stays open until Ctrl-C$")
        with urllib.request.urlopen(url, timeout=TIMEOUT) as answer:
            assert answer.status == 200
        process.signal(getattr(signal, number))
        assert process.finish() == 1, "the status is the run's"
    finally:
        process.kill()
    assert process.err == ""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no such signal there")
def test_run_under_nohup_survives_closed_terminal(tmp_path: Path) -> None:
    ran = subprocess.run(
        [
            *("sh", "-c", 'trap "" HUP; "$@" & kill -HUP $!; wait $!', "sh", *COMMAND),
            *("run", "lesson", "--agent", "none", "--until", "0.5", "--no-picture"),
        ],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no such shell there")
def test_run_without_reader_of_stdout_continues(tmp_path: Path) -> None:
    run_it = '"$0" -m cellwright run lesson --agent none --until 5 --no-picture --log a.jsonl'
    command = f"exec 3>&1; {{ {run_it}; echo $? >&3; }} | head -n 1"
    ran = subprocess.run(
        ["bash", "-c", command, sys.executable],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert sorted(ran.stdout.split("\n")) == ["", "0", "trial lesson, agent none, seed 0, servo original"]
    assert ran.stderr == ""
    assert read_json_lines(tmp_path / "a.jsonl")[-1]["simulated"] == pytest.approx(5.0)


@pytest.mark.slow
def test_early_closed_pipe_prints_no_traceback(tmp_path: Path) -> None:
    ran = subprocess.run(
        ["sh", "-c", '"$0" -m cellwright check lesson --json | head -n 1', sys.executable],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert ran.stdout == "{\n"
    assert "Traceback" not in ran.stderr
