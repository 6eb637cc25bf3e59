"""Tests of replayed actions: those of a success succeed, others do not, and recordings must be those of the set."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from cellwright import RunOptions, Session
from cellwright.recording.dataset.export import export_recordings
from cellwright.recording.dataset.replayed import ReplayedEpisode, replay_actions
from cellwright.util.errors import UsageError
from tests.recording.dataset.damage import Change, put
from tests.recording.dataset.made import RATE, actions_around, kitted, steered
from tests.recording.dataset.sets import DATA, change_table, copied

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("recordings")
    return [
        kitted(folder / "kitter.mcap", varied=True),
        steered(folder / "short.mcap", actions_around(np.zeros(8, np.float32), 3), 3 / RATE),
    ]


@pytest.fixture(scope="module")
def good(recordings: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sets") / "good"
    export_recordings(recordings, folder)
    return folder


def test_success_succeeds_again_and_failure_fails_again(good: Path, recordings: list[Path]) -> None:
    assert [*replay_actions(good, recordings)] == [
        ReplayedEpisode(0, "kitter.mcap", True, True),
        ReplayedEpisode(1, "short.mcap", False, False),
    ]


def changed(column: str, place: int, value: float) -> Change:
    """Give each row of a column this value at one place."""
    return put(column, lambda rows: [[*row[:place], value, *row[place + 1 :]] for row in rows])


def test_actions_that_do_not_succeed_are_seen(good: Path, recordings: list[Path], tmp_path: Path) -> None:
    folder = copied(good, tmp_path / "still")
    change_table(folder / DATA, changed("action", 7, 0.0))  # the suction
    found = [(each.was_success, each.is_success) for each in replay_actions(folder, recordings)]
    assert found == [(True, False), (False, False)]


def test_recordings_are_found_in_any_order_and_under_any_name(
    good: Path, recordings: list[Path], tmp_path: Path
) -> None:
    renamed = shutil.copy(recordings[0], tmp_path / "other.mcap")
    assert [*replay_actions(good, [recordings[1], renamed])] == [
        ReplayedEpisode(0, "other.mcap", True, True),
        ReplayedEpisode(1, "short.mcap", False, False),
    ]


def test_recording_of_no_episode_is_refused_by_its_name(good: Path, recordings: list[Path], tmp_path: Path) -> None:
    other = steered(tmp_path / "short.mcap", actions_around(np.zeros(8, np.float32), 2), 2 / RATE)
    with pytest.raises(UsageError, match=r"/short\.mcap: is the recording of no episode of .*good \(got SHA-256 "):
        next(replay_actions(good, [*recordings, other]))


def test_recording_that_is_missing_is_named(good: Path, recordings: list[Path]) -> None:
    with pytest.raises(UsageError, match=r"good: the recording of episode 1 is missing \(it is short\.mcap, SHA-256 "):
        next(replay_actions(good, recordings[:1]))


def test_run_that_begins_otherwise_here_is_refused(good: Path, recordings: list[Path], tmp_path: Path) -> None:
    other = copied(good, tmp_path / "other")
    change_table(other / DATA, changed("observation.state", 0, 0.5))
    with pytest.raises(UsageError, match=r"kitter\.mcap: its run begins otherwise here than in episode 0 of .*other; "):
        next(replay_actions(other, recordings))


def test_set_of_a_robot_is_refused(tmp_path: Path) -> None:
    path, folder = tmp_path / "robot.mcap", tmp_path / "set"
    with Session("tandem", record=path, options=RunOptions(until=0.1)) as session:
        session.client("/operator").sleep(0.1)
    export_recordings([path], folder, sentence="Lift it.")
    with pytest.raises(UsageError, match=r"set: next\.success: column is missing; replay sets of cells alone"):
        next(replay_actions(folder, [path]))
