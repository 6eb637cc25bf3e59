"""Tests of agent and cell in different processes, from the command line."""

from __future__ import annotations

import json

import pytest

from tests.cli.conftest import CommandLine
from tests.state_hashes import kept
from tests.support.quick_children import QUICK_AGENTS

HASH = kept()["lesson"]["state_hash"]
"""State hash after kitter has worked the lesson's cell, in any process."""


@QUICK_AGENTS
@pytest.mark.slow
def test_kitter_in_lockstep_has_state_of_in_process_run(cellwright: CommandLine) -> None:
    ran = cellwright("run", "lesson", "--over", "socket", "--lockstep", "--json", "--no-picture")
    result = json.loads(ran.out)
    assert (ran.status, result["outcome"], result["score"]["total"]) == (0, "done", 8.0)
    assert result["state_hash"] == HASH


@QUICK_AGENTS
@pytest.mark.slow
def test_agent_over_socket_prints_output_and_outcome(cellwright: CommandLine, agents: str) -> None:
    ran = cellwright("run", "lesson", "--over", "socket", "--lockstep", "--agent", f"{agents}:Ends", "--no-picture")
    assert ran.status == 0
    assert "something that the agent prints\n" in ran.out
    assert "outcome     done\n" in ran.out


@QUICK_AGENTS
@pytest.mark.slow
def test_agent_that_crashes_in_own_process_is_reported(cellwright: CommandLine, agents: str) -> None:
    ran = cellwright("run", "lesson", "--over", "socket", "--lockstep", "--agent", f"{agents}:Crashes", "--no-picture")
    assert ran.status == 1
    assert ran.err.endswith("ValueError: no idea\n")
    assert "outcome     the agent crashed\n" in ran.out


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--connect", "localhost"], "give a host and a port, such as 127.0.0.1:11399"),
        (["--connect", "localhost:0"], "give a host and a port"),
        (["--connect", "127.0.0.1:1"], "no server answers at 127.0.0.1:1: "),
        (["lesson", "--connect", "127.0.0.1:1"], "TRIAL is for the process that serves the cell"),
        (["--connect", "127.0.0.1:1", "--seed", "3"], "--seed is for the process that serves the cell"),
        (["lesson", "--over", "pigeon"], "--over pigeon: give socket, ros1 or ros2"),
        (["lesson", "--lockstep"], "--lockstep requires --over"),
        (["lesson", "--over", "socket", "--agent", "missing"], "unknown agent 'missing'"),
        ([], "no trial given"),
    ],
)
def test_invalid_input_prints_one_line(arguments: list[str], reason: str, cellwright: CommandLine) -> None:
    ran = cellwright("run", *arguments)
    assert (ran.status, ran.out) == (2, "")
    assert reason in ran.err
    assert ran.err.count("\n") == 1
