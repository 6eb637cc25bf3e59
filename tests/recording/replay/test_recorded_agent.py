"""Tests of the agent that sends the commands of a recording again."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

import cellwright
from cellwright.clients.agents.agent import AgentError, find_agent
from cellwright.clients.client.client import Client
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.recorded_agent import RecordedAgent
from cellwright.running.run import Outcome, RunResult, cell_result
from cellwright.util.errors import RecordingError
from tests.running.evaluation.programs import TRIAL


@pytest.fixture
def trial(tmp_path: Path) -> Path:
    file = tmp_path / "tiny.yaml"
    file.write_text(TRIAL)
    return file


class Deliver:
    def run(self, client: Client) -> None:
        client.sleep(0.25)
        client.start_competition()
        client.control_agv(2, "not a kit")
        client.sleep(1.1)
        client.control_agv(1, "order_0_kit_0")


class GiveUp:
    def run(self, client: Client) -> None:
        client.start_competition()
        client.sleep(0.5)


class Send:
    """Gives up with a kit on its way, for whose end a run is waited."""

    def run(self, client: Client) -> None:
        client.start_competition()
        client.control_agv(1, "order_0_kit_0")
        client.control_agv(2, "order_0_kit_1")


class Crash:
    def run(self, client: Client) -> None:
        client.start_competition()
        client.sleep(0.013)
        raise LookupError("no part")


def run(trial: Path, program: Any, *, seed: int = 3, **options: Any) -> RunResult:
    with cellwright.Session(str(trial), seed=seed, **options) as session:
        return cell_result(session.run(program))


@pytest.mark.parametrize("program", [Deliver, GiveUp, Send, Crash])
def test_recorded_commands_reach_the_recorded_state(trial: Path, tmp_path: Path, program: type) -> None:
    file = tmp_path / "run.mcap"
    first = run(trial, program(), record=file)
    again = run(trial, find_agent(f"replay:{file}")())
    assert (again.state_hash, again.steps) == (first.state_hash, first.steps)
    assert again.score.total == first.score.total
    ended = first.outcome if first.outcome is Outcome.DONE else Outcome.GAVE_UP
    assert (again.outcome, again.error) == (ended, "")


def test_recording_of_commands_is_one_again(trial: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "a.mcap", tmp_path / "b.mcap"
    run(trial, Deliver(), record=first)
    run(trial, RecordedAgent(first), record=second)
    commands = []
    for file in (first, second):
        with RecordingFile(file) as recording:
            commands.append([(each.tick, each.kind, each.name, each.data) for each in recording.commands()])
    assert commands[0] == commands[1]
    assert len(commands[0]) == 3


@pytest.mark.slow
def test_recorded_commands_over_a_socket_reach_the_recorded_state(trial: Path, tmp_path: Path) -> None:
    from cellwright.running.remote.hosting import RemoteAgent

    file = tmp_path / "run.mcap"
    first = run(trial, Deliver(), record=file)
    served = cellwright.ServerOptions(port=0, lockstep=True)
    again = run(trial, RemoteAgent(f"replay:{file}"), serve=served)
    assert (again.outcome, again.state_hash) == (Outcome.DONE, first.state_hash)


def test_file_that_is_no_recording_is_refused(tmp_path: Path) -> None:
    with pytest.raises(AgentError, match=r"^replay:.*none\.mcap: cannot be read: No such file"):
        find_agent(f"replay:{tmp_path / 'none.mcap'}")()
    (tmp_path / "no.mcap").write_text("text")
    with pytest.raises(RecordingError, match=r"no\.mcap: "):
        RecordedAgent(tmp_path / "no.mcap")


def test_recording_of_a_robot_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "robot.mcap"
    with cellwright.Session("tandem", record=file) as session:
        session.run(until=0.1)
    with pytest.raises(RecordingError, match=r"robot\.mcap: is of a robot; give the recording of a cell"):
        RecordedAgent(file)


def test_recording_from_a_checkpoint_is_refused(trial: Path, tmp_path: Path) -> None:
    file, start = tmp_path / "run.mcap", tmp_path / "start.npz"
    options = cellwright.RunOptions(checkpoints=[(Fraction(1, 5), start)])
    run(trial, GiveUp(), options=options)
    run(trial, GiveUp(), record=file, options=cellwright.RunOptions(start=start))
    with pytest.raises(RecordingError, match=r"run\.mcap: begins at a checkpoint; record a run from its start"):
        RecordedAgent(file)
