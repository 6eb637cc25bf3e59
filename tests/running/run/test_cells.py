"""Tests of runs of a cell: their outcomes, what they count, and where they start."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.client.client import Client
from cellwright.config.trial.gear2017 import load_trial
from cellwright.middleware.messages.conversions import joint_trajectory, trajectory_point
from cellwright.rendering.scene import Scene
from cellwright.running.run import GRACE, Outcome, RunOptions, RunResult, run_cell
from cellwright.util.errors import RunEndedError, UnknownNameError, UsageError
from tests.cell.devices.workers import FakeWorker
from tests.support.cells import ARM_ONLY, BARE, JOINTS, KITTING, run

EYE = "cellwright: {sensors: {eye: {type: rgb_camera, pose: {xyz: [2, 0, 1]}, width: 16, height: 12, rate: 10}}}"
"""A trial with a camera, whose pictures come 0.1 s after they were taken."""


class Script:
    """An agent made of one function."""

    def __init__(self, work: Callable[[Client], object]) -> None:
        self._work = work

    def run(self, client: Client) -> None:
        self._work(client)


def work(script: Callable[[Client], object], cell: Cell | None = None, **options: object) -> RunResult:
    return run_cell(cell or Cell(KITTING), Script(script), RunOptions(**options))  # type: ignore[arg-type]


def deliver(client: Client) -> None:
    client.start_competition()
    client.sleep(1.1)
    client.control_agv(1, "order_0_kit_0")


def deliver_and_go_on(client: Client) -> None:
    deliver(client)
    while True:
        client.sleep(0.1)


def test_run_waits_for_kit_on_its_way() -> None:
    result = work(deliver)
    assert (result.outcome, result.competition_state, result.score.total) == (Outcome.DONE, "done", 6.0)
    assert result.simulated == pytest.approx(1.1 + 0.75 + 0.004, abs=0.005)
    assert result.steps == round(result.simulated * 500)
    assert result.error == ""
    assert result.wall > 0.0
    assert result.real_time_factor == pytest.approx(result.simulated / result.wall)


def test_endless_agent_is_ended_after_grace_time() -> None:
    result = work(deliver_and_go_on)
    assert (result.outcome, result.score.total) == (Outcome.DONE, 6.0)
    assert result.simulated == pytest.approx(1.85 + GRACE, abs=0.1)


def test_agent_that_catches_every_exception_is_ended() -> None:
    caught: list[Exception] = []

    def stubborn(client: Client) -> None:
        deliver(client)
        while True:
            try:
                client.sleep(0.1)
            except Exception as error:  # as many robot programs do
                caught.append(error)

    assert work(stubborn).outcome is Outcome.DONE
    assert caught == []


def test_agent_can_clean_up_when_run_is_over() -> None:
    reasons: list[str] = []

    def tidy(client: Client) -> None:
        try:
            deliver_and_go_on(client)
        except RunEndedError as end:
            reasons.append(str(end))
            raise

    assert work(tidy).outcome is Outcome.DONE
    assert reasons == ["the competition is done"]


def test_run_over_time_limit_has_outcome_time_limit() -> None:
    def wait(client: Client) -> None:
        client.start_competition()
        client.sleep(100.0)

    result = work(wait, Cell(replace(KITTING, time_limit=1.0)))
    assert (result.outcome, result.competition_state, result.score.total) == (Outcome.TIME_LIMIT, "done", 0.0)
    assert result.simulated == pytest.approx(1.0 + GRACE, abs=0.01)


def test_agent_that_returns_early_gives_up() -> None:
    result = work(lambda client: client.start_competition())
    assert (result.outcome, result.competition_state) == (Outcome.GAVE_UP, "go")


def test_crashing_agent_is_reported_and_score_stands() -> None:
    def crash(client: Client) -> None:
        deliver(client)
        client.sleep(1.0)
        raise LookupError("the part has gone")

    result = work(crash)
    assert (result.outcome, result.score.total) == (Outcome.CRASHED, 6.0)
    assert result.error.startswith("Traceback")
    assert "in crash" in result.error
    assert result.error.endswith("LookupError: the part has gone\n")


def test_crash_in_callback_of_agent_is_reported() -> None:
    def crash(client: Client) -> None:
        client.subscribe("/ariac/joint_states", lambda message: message.no_such_field)
        client.sleep(1.0)

    result = work(crash, Cell(ARM_ONLY))
    assert result.outcome is Outcome.CRASHED
    assert "no_such_field" in result.error
    assert result.simulated == pytest.approx(0.02)


@pytest.mark.parametrize(
    ("status", "outcome", "error"),
    [
        (None, Outcome.DONE, ""),
        (0, Outcome.DONE, ""),
        (3, Outcome.CRASHED, "the agent exited with 3\n"),
        ("no parts left", Outcome.CRASHED, "the agent exited with 'no parts left'\n"),
    ],
)
def test_exit_of_agent_ends_only_run(status: object, outcome: Outcome, error: str) -> None:
    def leave(client: Client) -> None:
        deliver(client)
        sys.exit(status)  # type: ignore[arg-type]

    result = work(leave)
    assert (result.outcome, result.error) == (outcome, error)


def test_interrupted_run_has_result() -> None:
    def interrupt(client: Client) -> None:
        client.sleep(0.5)
        raise KeyboardInterrupt

    result = work(interrupt)
    assert (result.outcome, result.simulated) == (Outcome.INTERRUPTED, 0.5)


def test_run_stops_at_until() -> None:
    result = work(deliver_and_go_on, until=1.5)
    assert (result.outcome, result.simulated, result.competition_state) == (Outcome.UNTIL, 1.5, "go")
    assert work(deliver_and_go_on, until=10.0).outcome is Outcome.DONE


def test_run_without_agent_or_end_is_refused() -> None:
    with pytest.raises(UsageError, match="a run without an agent needs an end"):
        run_cell(Cell(BARE), None)
    result = run_cell(Cell(BARE), None, RunOptions(until=0.25))
    assert (result.outcome, result.steps, result.competition_state) == (Outcome.UNTIL, 125, "init")


def test_listened_topics_have_message_counts() -> None:
    result = work(
        deliver, listen=["/ariac/orders", "/clock", "/ariac/arm/command"], cell=Cell(replace(KITTING, has_arm=True))
    )
    assert result.heard == {"/ariac/orders": 1, "/clock": result.steps}
    everything = work(deliver, listen=["all"])
    assert everything.heard["/ariac/competition_state"] == 18
    with pytest.raises(UnknownNameError, match="did you mean /ariac/orders"):
        work(deliver, listen=["/ariac/order"])


def test_listeners_and_actions_do_not_change_run() -> None:
    plain = work(deliver)
    looked: list[float] = []
    watched = work(
        deliver,
        listen=["all"],
        at=[
            (Fraction(1, 3), lambda cell: looked.append(cell.simulation.time)),
            (Fraction(0), lambda cell: looked.append(cell.simulation.time)),
        ],
        on_progress=lambda cell: looked.append(cell.simulation.time),
    )
    assert watched.state_hash == plain.state_hash
    assert looked[0] == 0.0
    assert looked[1:6] == [0.1, 0.2, 0.3, 0.334, 0.4]
    assert len(looked) == 2 + 18


def test_cell_can_be_run_again_with_same_result() -> None:
    cell = Cell(KITTING)
    looked: list[float] = []
    first = work(
        deliver,
        cell,
        listen=["all"],
        at=[(Fraction(9), lambda cell: looked.append(cell.simulation.time))],
        on_progress=lambda cell: looked.append(cell.simulation.time),
    )
    count = len(looked)
    second = work(deliver, cell)
    assert (second.state_hash, second.heard) == (first.state_hash, {})
    run(cell, 9.0)
    assert len(looked) == count
    assert not any(topic.subscribers for topic in cell.bus.topics() if topic.publishers)
    assert len(cell.competition.on_effect) == len(Cell(KITTING).competition.on_effect)


def test_paced_run_has_same_state_and_valid_speed() -> None:
    result = work(deliver, until=0.05, speed=1.0)
    assert result.state_hash == work(deliver, until=0.05).state_hash
    with pytest.raises(UsageError, match="speed must be a finite number above 0"):
        work(deliver, speed=0.0)


def test_refusals_are_reported_up_to_last() -> None:
    lines: list[str] = []

    def clumsy(client: Client) -> None:
        for _ in range(5):
            with pytest.raises(Exception, match="has 0 positions"):
                client.publish("/ariac/arm/command", bad)

    bad = joint_trajectory(JOINTS, [trajectory_point(time_from_start=1)])
    work(clumsy, Cell(ARM_ONLY, report=lines.append))
    assert len(lines) == 2
    assert lines[1] == "refused /ariac/arm/command from /agent: 4 more since the last report"


def test_run_continues_from_checkpoint(tmp_path: Path) -> None:
    file = tmp_path / "1.5.npz"

    def watch(client: Client) -> None:
        client.sleep(5.0)

    whole = work(deliver_and_go_on, checkpoints=[(Fraction(3, 2), file)])
    rest = work(watch, start=file)
    assert (rest.outcome, rest.state_hash, rest.score) == (whole.outcome, whole.state_hash, whole.score)
    assert rest.simulated == pytest.approx(whole.simulated - 1.5)
    assert rest.steps == whole.steps - 750


def test_checkpoints_of_run_do_not_apply_to_next_run(tmp_path: Path) -> None:
    cell, file = Cell(KITTING), tmp_path / "file.npz"
    saved = work(deliver, cell, checkpoints=[(Fraction(1), file)])
    file.unlink()
    plain = work(deliver, cell)
    assert not file.exists()
    assert plain.state_hash == work(deliver).state_hash != saved.state_hash


def test_run_from_checkpoint_of_done_competition_ends(tmp_path: Path) -> None:
    file = tmp_path / "late.npz"
    work(deliver_and_go_on, checkpoints=[(Fraction(3), file)])
    looked: list[float] = []

    def watch(client: Client) -> None:
        while True:
            client.sleep(1.0)

    rest = work(watch, start=file, at=[(Fraction(2), lambda cell: looked.append(cell.simulation.time))])
    assert rest.outcome is Outcome.DONE
    assert rest.simulated == pytest.approx(GRACE)
    assert looked == [3.0]  # a time in the past is now


def test_end_of_run_ends_render_process_and_its_pictures_still_come() -> None:
    workers: list[FakeWorker] = []

    def start(scene: Scene) -> FakeWorker:
        workers.append(FakeWorker(scene))
        return workers[-1]

    cell, times = Cell(load_trial(text=EYE).trial), list[float]()
    cell.render_service._start = start
    cell.sensors["eye"].listen(lambda picture: times.append(picture.time_ns / 1e9))
    run_cell(cell, None, RunOptions(until=0.25))
    assert [each.is_closed for each in workers] == [True]
    assert times == [0.1]
    run(cell, 0.1)  # the picture of 0.2 s was asked before
    assert [each.is_closed for each in workers] == [True, False]
    assert times == [0.1, 0.2]
