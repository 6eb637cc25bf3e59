"""A policy works a cell from the command line: over a wire, in two processes, and again from its recording."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.conftest import CommandLine
from tests.support.policy_servers import openpi, websocket_server
from tests.support.quick_children import QUICK_AGENTS

UNTIL = ("--until", "0.6", "--no-picture", "--json")


def lift(observation: dict[str, Any]) -> object:
    """Answer with four targets that move the rail by 1 mm each."""
    state = np.asarray(observation["state"], np.float64)
    return {"actions": state + np.outer(np.arange(1, 5), np.eye(8)[0]) * 0.001, "policy_timing": {"infer_ms": 33.0}}


@pytest.fixture
def server() -> Iterator[str]:
    with websocket_server(openpi(lift)) as address:
        yield address


def result(ran: Any) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(ran.out)
    return document


def test_recording_replays_without_the_server_and_verifies(
    server: str, cellwright: CommandLine, tmp_path: Path
) -> None:
    options = ("--latency", "measured:server", "--chunk", "2", "--record", "run.mcap", *UNTIL)
    first = result(cellwright("run", "lesson", "--policy", server, *options))
    assert (first["outcome"], first["agent"]) == (
        "until",
        f"policy --policy {server} --latency measured:server --chunk 2",
    )
    again = result(cellwright("run", "lesson", "--policy", "run.mcap", *UNTIL))
    assert again["state_hash"] == first["state_hash"]
    verified = cellwright("replay", "run.mcap", "--verify", "--json")
    assert (verified.status, json.loads(verified.out)["policy_requests"]) == (0, 6)


@QUICK_AGENTS
def test_policy_in_a_process_of_its_own_gives_the_same_run(server: str, cellwright: CommandLine) -> None:
    options = ("--policy", server, "--latency", "uniform:20ms..80ms", "--seed", "3", *UNTIL)
    one = result(cellwright("run", "lesson", *options))
    two = result(cellwright("run", "lesson", *options, "--over", "socket", "--lockstep"))
    assert one["state_hash"] == two["state_hash"]


@QUICK_AGENTS
@pytest.mark.parametrize("over", [(), ("--over", "socket", "--lockstep")])
def test_server_that_is_not_there_is_infrastructure(over: tuple[str, ...], cellwright: CommandLine) -> None:
    ran = cellwright("run", "lesson", "--policy", "ws://127.0.0.1:1", *over, *UNTIL)
    assert (ran.status, result(ran)["outcome"]) == (1, "infrastructure")
    assert "ws://127.0.0.1:1: cannot be reached" in ran.err


def test_fault_of_the_map_is_reported_before_anything_starts(
    server: str, cellwright: CommandLine, tmp_path: Path
) -> None:
    (tmp_path / "map.yaml").write_text("observation:\n  image: {camera: wrist}\nactions: [{channels: [elbow]}]\n")
    ran = cellwright("run", "lesson", "--policy", server, "--policy-map", "map.yaml", "--no-picture")
    assert (ran.status, ran.out) == (2, "")
    assert "map.yaml:2: observation.image.camera: unknown camera 'wrist'" in ran.err
    assert "map.yaml:3: actions[0].channels[0]: unknown channel 'elbow'; did you mean elbow_joint" in ran.err


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["lesson", "--policy", "ws://h:1", "--over", "socket"], "time must stand still while a policy answers"),
        (["lesson", "--policy", "none.mcap"], "none.mcap"),
        (["lesson", "--policy", "ws://h:1", "--latency", "soon"], "--latency soon: unknown source"),
        (["lesson", "--agent", "policy"], "--agent policy requires --policy"),
    ],
)
def test_invalid_input_prints_one_line(arguments: list[str], reason: str, cellwright: CommandLine) -> None:
    ran = cellwright("run", *arguments)
    assert (ran.status, ran.out) == (2, "")
    assert reason in ran.err
    assert ran.err.count("\n") == 1


def test_recording_of_another_agent_holds_no_episode(cellwright: CommandLine) -> None:
    cellwright("run", "lesson", "--agent", "none", "--record", "none.mcap", "--until", "0.1", "--no-picture")
    ran = cellwright("run", "lesson", "--policy", "none.mcap")
    assert (ran.status, ran.out) == (2, "")
    assert "none.mcap: holds no episode of a policy" in ran.err
