"""The score of a run that ends 2 ms after its kit, wherever a video or a recording of it shows one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import cellwright
from cellwright.cli.replay import actions
from cellwright.clients.client import Client
from cellwright.recording.plots.reading.plot_data import load_plot_data
from cellwright.recording.replay.exported import write_mcap
from cellwright.rendering.video_options import VideoOptions
from cellwright.running.run import Session
from cellwright.running.run.result import cell_result
from cellwright.viewer import filming
from tests.support.cells import KITTING

POINTS = 6.0


class Delivers:
    """Returns as soon as the service of the AGV has answered."""

    def run(self, client: Client) -> None:
        client.start_competition()
        client.sleep(1.1)
        client.control_agv(1, "order_0_kit_0")


class Captions:
    """Stand-in for the drawing of a video: it keeps the times and captions of the frames."""

    def __init__(self, options: VideoOptions, *_: Any, **__: Any) -> None:
        self.file, self.error, self.dropped, self.taken = options.file, "", 0, 0
        self.options, self.choice = options, ""
        self.made: dict[str, float | str] = {}
        self.shown: list[tuple[int, str]] = []
        made.append(self)

    def take(self, frame: Any, _camera: Any, caption: str = "", **_: Any) -> bool:
        self.shown.append((frame.time, caption))
        return True

    def close(self) -> None:
        pass


made: list[Captions] = []


@pytest.fixture
def recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Record and film the run; the recording's path."""
    made.clear()
    monkeypatch.setattr(filming, "Video", Captions)
    monkeypatch.setattr(actions, "Video", Captions)
    path = tmp_path / "run.mcap"
    with Session(cellwright.Cell(KITTING), record=[path, tmp_path / "run.mp4"]) as session:
        assert cell_result(session.run(Delivers())).score.total == POINTS
    with cellwright.open_recording(path) as run:
        kit = next(time for time, event in run.events() if event["kind"] == "kit")
        assert run.end - kit < 0.05  # so no later sample has it
    return path


def test_plot_of_run_that_ends_with_its_kit_shows_its_points(recorded: Path) -> None:
    with cellwright.open_recording(recorded) as run:
        found = load_plot_data(run.recording)
    assert found.score is not None
    assert (found.score.points[0], found.score.points[-1]) == (0.0, POINTS)
    assert "6 of 6 points" in found.note
    assert found.states["competition"][-1].label == "done"


def test_last_frame_of_video_shows_points_of_run_that_ends_with_its_kit(recorded: Path) -> None:
    (video,) = made
    with cellwright.open_recording(recorded) as run:
        assert video.shown[-1][0] == run.recording.end_time
    assert video.shown[-1][1].endswith("6 points")
    assert video.shown[-2][1].endswith("0 points")


def test_last_frame_of_replayed_video_shows_points_of_run_that_ends_with_its_kit(recorded: Path) -> None:
    options = VideoOptions(recorded.with_suffix(".replayed.mp4"))
    with cellwright.open_recording(recorded) as run:
        actions.film_recording(run.recording, options, start=None, until=None, warn=print, on_progress=None)
    assert made[-1].shown[-1][1].endswith("6 points")


def test_panel_of_recording_shows_points_from_kit_on(recorded: Path) -> None:
    with cellwright.open_recording(recorded) as run:
        kit = next(time for time, event in run.recording.values("/cellwright/event") if event["kind"] == "kit")
        first = next(time for time, panel in run.recording.values("/cellwright/panel") if panel["score"]["total"])
    assert first == kit


def test_topic_in_recording_and_export_has_points_of_run_that_ends_with_its_kit(recorded: Path) -> None:
    exported = recorded.with_name("exported.mcap")
    with cellwright.open_recording(recorded) as run:
        _, points = run.arrays("/ariac/current_score", "data")
        assert points[-1] == POINTS
        write_mcap(run.recording, exported)
        assert run.score == POINTS
    from mcap.reader import make_reader

    with exported.open("rb") as file:
        *_, (_, _, newest) = make_reader(file).iter_messages(["/ariac/current_score"])
    assert newest.data == b"\x00\x01\x00\x00\x00\x00\xc0\x40"  # CDR: 6 as a float of 32 bits
