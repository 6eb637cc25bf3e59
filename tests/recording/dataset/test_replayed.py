"""Tests of replayed actions: those of a success succeed, others do not, and recordings must be those of the set."""

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


def test_recordings_of_other_episodes_are_refused(good: Path, recordings: list[Path], tmp_path: Path) -> None:
    with pytest.raises(
        UsageError, match=r"good: has 2 episodes \(got 1 recordings\); give that of each, in their order"
    ):
        list(replay_actions(good, recordings[:1]))
    other = copied(good, tmp_path / "other")
    change_table(other / DATA, changed("observation.state", 0, 0.5))
    with pytest.raises(
        UsageError, match=r"kitter\.mcap: does not begin as episode 0 of .*; give the recordings in their"
    ):
        list(replay_actions(other, recordings))
    with Session("tandem", record=tmp_path / "robot.mcap", options=RunOptions(until=0.1)) as session:
        session.client("/operator").sleep(0.1)
    with pytest.raises(UsageError, match=r"robot\.mcap: is of a robot's node; replay sets of cells alone"):
        list(replay_actions(good, [tmp_path / "robot.mcap", recordings[1]]))
