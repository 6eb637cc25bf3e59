"""Runs that begin with another seed, variation or posture: as in a new cell, in the one that exists."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cellwright
from cellwright.cell.cell import Cell
from cellwright.cell.start import Start
from cellwright.cell.variation import Bounds, vary
from cellwright.clients.client import Client
from cellwright.config.trial.trial import Trial
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.rebuild import rebuild
from cellwright.recording.replay.verify import Answer, recorded_steps, verify
from cellwright.running.run import Session
from cellwright.util.errors import UnknownNameError, UsageError
from tests.cell.devices.test_clones import HOARDED, hoard
from tests.support.cells import BARE, WHOLE
from tests.support.scenario import MIDDLE, TRIAL, listen_to_all, play

LESSON = cellwright.load_trial("lesson")
POSTURE = {"elbow_joint": 1.9, "linear_arm_actuator_joint": 0.4}


def worked(cell: Cell) -> tuple[str, list[str]]:
    """Return state hash and messages after a part of the scenario."""
    heard = listen_to_all(cell)
    play(cell, MIDDLE)
    return cell.state_hash(), [repr(each) for each in heard]


@pytest.mark.parametrize("seed", [1, np.int64(5)])
def test_reset_with_seed_equals_new_cell(seed: int) -> None:
    cell = play(Cell(TRIAL), MIDDLE)
    cell.reset(seed=seed)
    assert cell.seed == seed
    assert worked(cell) == worked(Cell(TRIAL, seed=int(seed)))


def test_reset_with_variation_and_joints_equals_new_cell() -> None:
    cell = play(Cell(TRIAL), MIDDLE)
    cell.reset(seed=7, variation=True, joints=POSTURE)
    posture = {**TRIAL.initial_joint_states, **POSTURE}
    built = Cell(replace(vary(TRIAL, 7), initial_joint_states=posture), seed=7)
    assert cell.trial == built.trial
    assert worked(cell) == worked(built)


def test_reset_keeps_what_is_not_given_until_taken_back() -> None:
    cell = Cell(LESSON)
    cell.reset(seed=3, variation=Bounds(shift=0.001), joints=POSTURE)
    cell.reset(seed=4)
    assert cell.start == Start(4, Bounds(shift=0.001), POSTURE)
    varied = cell.state_hash()
    cell.reset()
    assert cell.state_hash() == varied
    cell.reset(seed=0, variation=False, joints={})
    assert cell.trial == LESSON
    assert cell.state_hash() == Cell(LESSON, seed=0).state_hash()


def test_grown_run_is_followed_by_another_start_and_restored() -> None:
    cell = Cell(HOARDED, competition=False)
    for number in range(4):
        hoard(cell, number)
    grown, taken = cell.state_hash(), cell.snapshot()
    assert cell.simulation.model is not cell.simulation.first_model
    cell.reset(seed=2, variation=True)
    built = Cell(vary(HOARDED, 2), seed=2, competition=False)
    for each in (cell, built):
        for number in range(4):
            hoard(each, number)
    assert cell.state_hash() == built.state_hash()
    cell.restore(taken)
    assert cell.state_hash() == grown
    other = Cell(HOARDED, competition=False)
    for number in range(5):
        hoard(other, number)
    hoard(cell, 4)
    assert cell.state_hash() == other.state_hash()


@pytest.mark.parametrize(
    ("start", "words"),
    [
        ({"seed": -1}, "seed must not be below 0"),
        ({"seed": 1.5}, "seed must be a whole number"),
        ({"joints": {"elbow_joint": float("nan")}}, "within the joint's limits"),
        ({"joints": {"elbow_joint": 7.0}}, "within the joint's limits"),
        ({"joints": {"linear_arm_actuator_joint": 2.2}}, "±2.1"),
        ({"joints": {"elbow_joint": "up"}}, "must be a number"),
        ({"joints": {"elbow": 1.0}}, "unknown arm joint 'elbow'"),
    ],
)
def test_impossible_start_is_refused_and_run_goes_on(start: dict[str, Any], words: str) -> None:
    cell = Cell(WHOLE)
    cell.simulation.step_until(20_000_000)
    before = cell.state_hash()
    with pytest.raises((UsageError, UnknownNameError), match=words):
        cell.reset(**start)
    assert (cell.state_hash(), cell.start) == (before, Start(0))


def test_joints_without_arm_and_variation_of_variation_are_refused() -> None:
    with pytest.raises(UsageError, match="has no arm"):
        Cell(BARE).reset(joints=POSTURE)
    with pytest.raises(UsageError, match="is a variation already, of seed 7"):
        Cell(vary(LESSON, 7)).reset(variation=True)


def test_reset_within_tick_is_refused() -> None:
    cell = Cell(BARE)
    cell.bus.subscribe("/clock", lambda _message: cell.reset(seed=1))
    with pytest.raises(UsageError, match="call them after the step"):
        cell.step()


def test_client_forgets_last_run_in_reset() -> None:
    cell = Cell(LESSON)
    client = Client.in_process(cell)
    client.start_competition()
    assert client.wait_for_order(1.0) is not None
    rate = client.rate(10.0)
    client.sleep(0.5)
    cell.reset(seed=1)
    assert (client.orders, client.competition_state, client.joint_positions, client.time) == ([], "", {}, 0.0)
    rate.sleep()
    assert client.time == pytest.approx(0.1)
    assert client.competition_state == "init"
    assert client.wait_for_order(0.1) is None


def test_session_reset_begins_run_of_its_own_with_client() -> None:
    hashes = []
    with Session("lesson") as session:
        client = session.client()
        assert isinstance(client, Client)
        client.start_competition()
        client.sleep(0.2)
        for seed in (5, 6):
            session.reset(seed=seed, variation=True, joints=POSTURE)
            client.sleep(0.1)
            hashes.append(session.node.state_hash())
        assert session.number == 3
        assert session.result_by_now().simulated == 0.1
        assert client.competition_state == "init"
    for seed, found in zip((5, 6), hashes, strict=True):
        cell = Cell(replace(vary(LESSON, seed), initial_joint_states=POSTURE), seed=seed)
        cell.simulation.step_until(100_000_000)
        assert cell.state_hash() == found


def test_recordings_of_runs_with_other_starts_are_verified(tmp_path: Path) -> None:
    with Session("lesson", record=tmp_path / "run.mcap") as session:
        client = session.client()
        client.sleep(0.1)
        session.reset(seed=3, variation=Bounds(shift=0.002), joints=POSTURE)
        client.sleep(0.1)
        expected = session.node.state_hash()
    with RecordingFile(tmp_path / "run_2.mcap") as recording, rebuild(recording) as rebuilt:
        assert isinstance(rebuilt.served, Cell)
        assert verify(rebuilt, list(recorded_steps(recording))).answer is Answer.EQUAL
        assert rebuilt.served.state_hash() == expected


def test_robot_has_no_seed_to_start_with() -> None:
    with Session("tandem") as session, pytest.raises(UsageError, match="only a cell starts with"):
        session.reset(seed=1)


def test_start_of_session_that_is_not_open_is_refused() -> None:
    with pytest.raises(UsageError, match="not open"):
        Session("lesson").reset(seed=1)


def test_trial_of_start_without_changes_is_the_written_one() -> None:
    trial: Trial = WHOLE
    assert Start(3).of(trial) is trial
