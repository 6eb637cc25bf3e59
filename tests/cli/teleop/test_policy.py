"""A policy drives a robot's node from the command line: over a wire, and again from its recording."""

import json
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cellwright.middleware.messages import TYPES
from cellwright.recording.format.commands import Command
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.rebuild import rebuild
from cellwright.recording.replay.verify import Answer, Step, recorded_steps, verify
from tests.cli.conftest import CommandLine
from tests.support.policy_servers import openpi, websocket_server

NODE = ("teleop", "tandem", "--port", "0", "--until", "0.6", "--json")


def lift(observation: dict[str, Any]) -> object:
    """Answer with four targets that move the lift by 10 mm each."""
    state = np.asarray(observation["state"], np.float64)
    steps = np.outer(np.arange(1, 5), np.eye(len(state))[0]) * 0.01
    return {"actions": state + steps, "policy_timing": {"infer_ms": 33.0}}


@pytest.fixture
def server() -> Iterator[str]:
    with websocket_server(openpi(lift)) as address:
        yield address


def test_recording_replays_without_the_server_and_verifies(server: str, cellwright: CommandLine) -> None:
    options = ("--latency", "measured:server", "--chunk", "2", "--record", "run.mcap")
    first = json.loads(cellwright(*NODE, "--policy", server, *options).out)
    assert (first["outcome"], first["policy"]) == ("until", "6 requests, 50 ms from observation to action")
    assert first["commands"]["taken"] > 8
    again = json.loads(cellwright(*NODE, "--policy", "run.mcap").out)
    assert again["state_hash"] == first["state_hash"]
    verified = cellwright("replay", "run.mcap", "--verify", "--json")
    assert (verified.status, json.loads(verified.out)["policy_requests"]) == (0, 6)


def test_drawn_latencies_are_by_the_seed_and_are_recorded(server: str, cellwright: CommandLine) -> None:
    def ran(seed: str) -> str:
        drawn = ("--latency", "uniform:20ms..180ms", "--seed", seed, "--record", f"{seed}.mcap")
        return str(json.loads(cellwright(*NODE, "--policy", server, *drawn).out)["state_hash"])

    first, other = ran("7"), ran("8")
    assert first == ran("7") != other
    assert json.loads(cellwright(*NODE, "--policy", "8.mcap").out)["state_hash"] == other
    assert cellwright("replay", "7.mcap", "--verify").status == 0


def test_target_that_was_edited_in_a_recording_fails_the_verification(server: str, cellwright: CommandLine) -> None:
    assert cellwright(*NODE, "--policy", server, "--latency", "60ms", "--record", "run.mcap").status == 0
    with RecordingFile(Path("run.mcap")) as recording, rebuild(recording) as rebuilt:
        verdict = verify(rebuilt, higher(recorded_steps(recording)))
    assert verdict.answer is Answer.DIFFERENT
    assert verdict.policy.startswith("request 0: lift must go to ")


def higher(steps: Iterable[Step]) -> Iterator[Step]:
    """Yield the steps with a target of the lift that is 2 µm higher."""
    for step in steps:
        if isinstance(step, Command) and step.name == "/io_teleop/joint_cmd":
            message = step.message()
            message.position = message.position.copy()  # what was read is read-only
            message.position[list(message.name).index("lift")] += 2e-6
            step = replace(step, data=TYPES.to_cdr(message))
        yield step


def test_server_that_is_not_there_is_infrastructure(cellwright: CommandLine) -> None:
    ran = cellwright(*NODE, "--policy", "ws://127.0.0.1:1")
    assert (ran.status, json.loads(ran.out)["outcome"]) == (1, "infrastructure")
    assert "ws://127.0.0.1:1: cannot be reached" in ran.err


def test_sentence_is_the_prompt(cellwright: CommandLine) -> None:
    prompts = []

    def infer(observation: dict[str, Any]) -> object:
        prompts.append(observation["prompt"])
        return lift(observation)

    with websocket_server(openpi(infer)) as address:
        assert cellwright(*NODE, "--policy", address, "--sentence", "Lift the torso.").status == 0
    assert set(prompts) == {"Lift the torso."}


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--policy-map", "aloha"], "--policy-map requires --policy"),
        (["--policy", "hold", "--lockstep"], "leave out --lockstep"),
        (["--policy", "hold", "--driver", "x.py:X"], "a real robot does not stand while a policy answers"),
        (["--policy", "hold", "--check"], "--check cannot be combined with"),
        (["--policy", "hold", "--policy-map", "alohha"], "unknown policy map 'alohha'; did you mean aloha"),
        (["--policy", "none.mcap"], "none.mcap"),
        (["--seed", "1"], "--seed requires --policy"),
        (["--policy", "run.mcap", "--seed", "1"], "the recording has its own seed; leave out --seed"),
        (["--policy", "hold", "--seed", "-1"], "--seed -1: "),
    ],
)
def test_options_that_do_not_go_together_are_refused(
    arguments: list[str], reason: str, cellwright: CommandLine
) -> None:
    ran = cellwright("teleop", "tandem", "--port", "0", *arguments)
    assert (ran.status, ran.out) == (2, "")
    assert reason in ran.err


def test_map_that_does_not_fit_the_robot_is_reported_before_anything_starts(
    cellwright: CommandLine, tmp_path: Path
) -> None:
    ran = cellwright(*NODE, "--policy", "hold", "--policy-map", "droid")
    assert (ran.status, ran.out) == (2, "")
    assert "droid.yaml:6: observation.observation/exterior_image_1_left.camera: no camera 1 here" in ran.err
