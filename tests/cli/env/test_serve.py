"""Command `cellwright env serve`: what it refuses, and its end."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from tests.cli.conftest import CommandLine
from tests.support.processes import Process

READY = r"^serving pick_from_bin at ws://127\.0\.0\.1:\d+$"


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (["pick_from_bim"], "error: unknown trial 'pick_from_bim'; did you mean pick_from_bin"),
        (["lesson"], "error: trial lesson: there is no task; add a section `task` to its file\n"),
        (["pick_from_bin", "--rate", "30"], "error: rate: "),
        (["pick_from_bin", "--control", "deltas"], "error: control: must be absolute or delta (got 'deltas'); did you"),
        (["pick_from_bin", "--cameras", "overhed"], "error: unknown colour camera 'overhed'; did you mean overhead"),
        (["pick_from_bin", "--port", "70000"], "error: --port 70000: give a port from 0 to 65535\n"),
        (["pick_from_bin", "--host", "no-such-host.invalid"], "error: no-such-host.invalid:0: cannot listen there"),
    ],
)
def test_bad_input_starts_nothing(cellwright: CommandLine, arguments: list[str], error: str) -> None:
    ran = cellwright("env", "serve", *arguments)
    assert ran.status == 2
    assert ran.err.startswith(error)
    assert ran.out == ""


@pytest.mark.slow
def test_it_serves_until_ctrl_c(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "cellwright", "env", "serve", "pick_from_bin"]
    process = Process(command, os.environ, tmp_path)
    process.wait_for(READY)
    assert process.interrupt() == 0
    assert process.err == ""


@pytest.mark.slow
def test_it_ends_with_its_standard_input(tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "cellwright",
        "env",
        "serve",
        "pick_from_bin",
        "--exit-with-stdin",
        "--host",
        "0.0.0.0",
    ]
    process = Process(command, os.environ, tmp_path)  # its input is empty
    assert process.finish() == 0
    assert process.out.startswith("serving pick_from_bin at ws://0.0.0.0:")
    assert (
        "0.0.0.0: open to the network; every program that reaches this machine can use the environment" in process.err
    )
