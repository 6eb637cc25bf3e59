"""Runs of trials with a task: they end at its success, and say so."""

from __future__ import annotations

import json
from contextlib import closing
from pathlib import Path

import pytest

import cellwright
from cellwright import Outcome, RunOptions, Session
from cellwright.cli.main import DONE, NOT_DONE, exit_status_of
from cellwright.clients.client.client import Client
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.rebuild import rebuild
from cellwright.recording.replay.verify import Answer, VerificationResult, recorded_steps, verify
from cellwright.running.run import RunResult, cell_result
from cellwright.running.run.session import Program
from cellwright.util.pose import Pose
from tests.cell.tasks.cells import BASE, trial

ON_TRAY = "{on_tray: {part: gear_part, tray: tray1}}"


class Puts(Program):
    """Puts a gear on the tray at a time, behind the cell's back."""

    def __init__(self, time: float) -> None:
        self.time = time

    def work(self, session: Session) -> tuple[Outcome, str]:
        cell = session.node
        cell.simulation.step_until(round(self.time * 1e9))
        cell.parts.place(cell.parts.part("bin1|gear_part_2"), cell.trays[1].world_T_tray @ Pose())
        session.loop.run()
        return Outcome(session.state.outcome_by_now()), ""


class Waits:
    """Waits for the end."""

    def run(self, client: Client) -> None:
        """Wait."""
        client.sleep(100.0)


def run(session: Session, program: object) -> RunResult:
    return cell_result(session.run(program))  # type: ignore[arg-type]


def verified(path: Path, **changed: object) -> VerificationResult:
    """Return the verification of a recording, with other values in its result."""
    with RecordingFile(path) as recording, rebuild(recording) as rebuilt:
        return verify(rebuilt, recorded_steps(recording), result={**(recording.end or {}), **changed})


def test_run_ends_at_success() -> None:
    result = run(Session(trial(ON_TRAY)), Puts(1.0))
    assert (result.outcome, result.success) == (Outcome.DONE, True)
    assert result.succeeded_at == result.simulated
    assert 1.0 < result.simulated < 1.1
    assert exit_status_of(result, has_agent=True, min_score=None) == DONE


def test_conditions_must_hold_in_a_run_too() -> None:
    result = run(Session(trial(ON_TRAY, "  hold_for: 0.5\n")), Puts(1.0))
    assert result.success
    assert 1.5 < result.simulated < 1.6


def test_run_without_success_is_not_done() -> None:
    session = Session(trial(ON_TRAY), options=RunOptions(until=0.5))
    result = run(session, Waits())
    assert (result.outcome, result.success, result.succeeded_at) == (Outcome.UNTIL, False, None)
    assert exit_status_of(result, has_agent=True, min_score=None) == NOT_DONE
    assert exit_status_of(result, has_agent=False, min_score=None) == NOT_DONE


def test_time_limit_ends_a_task_without_order() -> None:
    described = cellwright.load_trial(
        text="{cell: {bins: {bin1: {at: [-0.35, 0.0]}}, arms: {arm: {mount: {kind: rail, at: [0.3, 0, 0.9]}}}},"
        " parts: [{type: gear_part, in: bin1}], time_limit: 0.3,"
        " task: {sentence: Lift it., success: {held: {part: gear_part, lifted: 0.1}}}}"
    )
    result = run(Session(described), Waits())
    assert (result.outcome, result.success) == (Outcome.TIME_LIMIT, False)


class Ends:
    """Ends the competition at once."""

    def run(self, client: Client) -> None:
        """End it, and wait."""
        client.sleep(0.1)
        client.end_competition()
        client.sleep(1.0)


def test_competition_that_ends_before_success_has_failed() -> None:
    result = run(Session(trial(ON_TRAY)), Ends())
    assert (result.outcome, result.success, result.points) == (Outcome.TASK_FAILED, False, 0.0)
    assert exit_status_of(result, has_agent=True, min_score=None) == NOT_DONE


def test_task_is_worth_one_point_in_evaluations() -> None:
    result = run(Session(trial(ON_TRAY)), Puts(0.1))
    assert (result.score.total, result.points) == (0.0, 1.0)


def test_trial_without_task_has_no_success() -> None:
    result = cellwright.run_trial("lesson", None, options=RunOptions(until=0.1))
    assert (result.success, result.succeeded_at) == (None, None)
    assert "success" not in result.recorded()


def test_run_that_goes_on_after_success_keeps_it() -> None:
    session = Session(trial(ON_TRAY), options=RunOptions(until=1.5, ends_when_done=False))
    result = run(session, Puts(1.0))
    assert result.simulated == 1.5
    assert result.success
    assert result.succeeded_at is not None
    assert result.succeeded_at < 1.1


def test_second_run_of_a_session_begins_without_success() -> None:
    with Session(trial(ON_TRAY), options=RunOptions(until=1.5)) as session:
        assert run(session, Puts(1.0)).success
        assert run(session, Waits()).success is False


@pytest.mark.slow
def test_recording_verifies_the_success_of_its_commands(tmp_path: Path) -> None:
    path, log = tmp_path / "run.mcap", tmp_path / "run.jsonl"
    with Session("pick_from_bin", seed=1, record=[path, log]) as session, closing(session.node.simulation):
        result = cell_result(session.run("kitter"))
    assert result.success
    found = verified(path)
    assert found.answer is Answer.EQUAL
    assert (found.success, found.recorded_success) == (True, True)
    end = json.loads(log.read_text().splitlines()[-1])
    assert (end["success"], end["succeeded_at"]) == (True, result.succeeded_at)


def test_other_success_in_a_recording_is_found_out(tmp_path: Path) -> None:
    path, file = tmp_path / "run.mcap", tmp_path / "trial.yaml"
    file.write_text(f"{BASE}task: {{sentence: Do it., success: {ON_TRAY}}}\n")
    assert not run(Session(file, record=path, options=RunOptions(until=0.2)), Waits()).success
    assert verified(path).answer is Answer.EQUAL
    found = verified(path, success=True)
    assert found.answer is Answer.DIFFERENT
    assert (found.success, found.recorded_success, found.has_other_success) == (False, True, True)


def test_client_reads_the_sentence() -> None:
    with Session(trial(ON_TRAY)) as session:
        assert Client(session.transport("/client")).sentence == "Do it."
    with Session("lesson") as session:
        assert Client(session.transport("/client")).sentence == ""
