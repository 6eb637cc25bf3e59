"""Tests of `cellwright eval --ray`: bad input is refused, and nothing is started."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.conftest import CommandLine
from tests.support.ports import free_port


@pytest.mark.slow
def test_unreachable_cluster_is_refused(tiny: CommandLine) -> None:
    address = f"127.0.0.1:{free_port()}"
    ran = tiny("eval", "tiny.yaml", "--agent", "programs.py:Deliver", "--ray", address)
    assert ran.status == 2
    assert ran.err == f"error: --ray {address}: cannot be reached: Connection refused; start Ray there\n"
    assert not list(Path("evaluation").glob("logs/tiny*"))


def test_program_outside_of_current_folder_is_refused(tiny: CommandLine) -> None:
    program = Path("programs.py").resolve()
    ran = tiny("eval", "tiny.yaml", "--agent", f"{program}:Deliver", "--ray", "auto")
    assert ran.status == 2
    assert ran.err.startswith(f"error: --ray: {program}: nodes get the current folder only")


def test_too_many_jobs_are_refused(tiny: CommandLine) -> None:
    ran = tiny("eval", "tiny.yaml", "--agent", "programs.py:Deliver", "--ray", "auto", "--jobs", "0")
    assert (ran.status, ran.out) == (2, "")
    assert ran.err == "error: --jobs 0: give a number from 1 to 1024\n"


@pytest.mark.slow
def test_tasks_run_on_a_cluster_until_their_interval_is_narrow(cellwright: CommandLine) -> None:
    width = ("--until-width", "0.7", "--min", "2", "--max", "3")
    ran = cellwright("eval", "pick_from_bin", "--agent", "kitter", "--ray", "local", *width, "--json")
    found = json.loads(ran.out)
    # Wilson's interval of 2 of 2 is 0.66 wide
    assert (ran.status, found["runs"], found["passed"]) == (0, 2, 2)
    assert [each["success"] for each in found["results"]] == [True, True]
