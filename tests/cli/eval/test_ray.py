"""Tests of `cellwright eval --ray`: bad input is refused, and nothing is started."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from cellwright.running.evaluation.results.results_file import read_results
from tests.cli.conftest import CommandLine
from tests.support.ports import free_port

RAIL = """
import numpy as np

class Rail:
    def infer(self, observation):
        state = np.asarray(observation["state"], float)
        return state + np.outer(np.arange(1, 5), np.eye(len(state))[0]) * 0.01
"""
"""A policy that moves the first channel, the rail."""


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


@pytest.mark.slow
def test_policy_has_the_results_of_one_machine_on_a_cluster_at_each_latency(cellwright: CommandLine) -> None:
    Path("rail.py").write_text(RAIL)
    Path("times.txt").write_text("60\n")
    words = ["eval", "pick_from_bin", "--policy", "rail.py:Rail", "--sweep", "time_limit=1", "--seeds", "2", "--vary"]
    words += ["--latency", "10ms", "--latency", "file:times.txt"]
    found = []
    for folder, more in (("here", ()), ("there", ("--ray", "local"))):
        ran = cellwright(*words, "--out", folder, *more)
        assert ran.status == 1, ran.err  # the rail alone picks nothing
        found.append(sorted(read_results(Path(folder)).values(), key=lambda each: (each.trial, each.seed)))
    here, there = ([replace(each, wall=0.0) for each in results] for results in found)
    assert here == there
    assert {each.outcome for each in there} == {"time_limit"}
    assert {each.overrides["latency_ms"] for each in there} == {"10", "file:times.txt"}
    assert len({each.state_hash for each in there}) == 4
