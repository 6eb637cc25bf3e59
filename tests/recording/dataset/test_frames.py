"""Instants of frames: at whole periods, before the commands of their tick, and only of the recorded run."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path

import pytest

import cellwright
from cellwright import Cell, RunOptions, Session
from cellwright.recording.dataset import frames
from cellwright.recording.dataset.frames import frame_instants, frame_ticks
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.rebuild import Rebuilt
from cellwright.util.errors import RecordingError, UsageError

TICK = Fraction(1, 500)


class Grips:
    """Switches the suction on after 0.1 s."""

    def run(self, client: cellwright.Client) -> None:
        """Switch it on, and wait."""
        client.sleep(0.1)
        client.control_gripper(True)
        client.sleep(100.0)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("frames") / "run.mcap"
    with Session("lesson", record=found, options=RunOptions(until=0.21)) as session:
        session.run(Grips())
    return found


@pytest.mark.parametrize(
    ("rate", "ticks"),
    [(50, [0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110]), (100, [5 * number for number in range(22)])],
)
def test_instants_are_whole_periods_until_the_one_with_the_end(path: Path, rate: int, ticks: list[int]) -> None:
    with RecordingFile(path) as recording:
        assert [served.simulation.clock.tick for served in frame_instants(recording, rate)] == ticks


def test_instant_comes_before_the_commands_of_its_tick(path: Path) -> None:
    found = {}
    with RecordingFile(path) as recording:
        for served in frame_instants(recording, 50):
            assert isinstance(served, Cell)
            found[served.simulation.clock.tick] = served.grippers["arm"].enabled
    assert [found[tick] for tick in (40, 50, 60)] == [False, False, True]


def test_run_that_differs_here_is_refused(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    @contextmanager
    def other(_recording: RecordingFile) -> Iterator[Rebuilt]:
        yield Rebuilt(Cell(cellwright.load_trial("lesson"), servo="precise"))

    monkeypatch.setattr(frames, "rebuild", other)
    with (
        RecordingFile(path) as recording,
        pytest.raises(RecordingError, match=r"run\.mcap: the run differs here at 0\."),
    ):
        list(frame_instants(recording, 20))


def test_recording_that_was_cut_is_refused(path: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    data = path.read_bytes()
    cut.write_bytes(data[: len(data) // 2])
    with RecordingFile(cut) as recording, pytest.raises(RecordingError, match=r"cut\.mcap: ends before its run did"):
        list(frame_instants(recording, 20))


@pytest.mark.parametrize(
    ("rate", "text"),
    [
        (30, r"^hz: a frame must be whole ticks of 2 ms \(got 30 Hz\); take 25 or 50$"),
        (12.5, r"\(got 12\.5 Hz\); take 10 or 20$"),
        (999, r"\(got 999 Hz\); take 500$"),
        (0, r"^hz: must be from 1 to 1000 Hz \(got 0\)$"),
        (float("nan"), r"\(got nan\)$"),
    ],
)
def test_rate_without_whole_ticks_is_refused_with_the_next_ones(rate: int, text: str) -> None:
    with pytest.raises(UsageError, match=text):
        frame_ticks(rate, TICK)


def test_timestep_that_no_whole_rate_suits_is_refused() -> None:
    with pytest.raises(UsageError, match="no whole rate suits it"):
        frame_ticks(20, Fraction(7, 1600))
