"""Recorder: it leaves the run unchanged, and the recording reproduces the run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.config.trial.gear2017 import load_trial
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.recording.format import format as names
from cellwright.recording.format.format import RecordingHeader
from cellwright.recording.format.reader import RecordingFile, recorded_frames
from cellwright.recording.format.recorder import Recorder
from cellwright.rendering.scene import Scene
from cellwright.rendering.scene.engine import SceneCapture
from cellwright.rendering.scene.scene import decode_scene, encode_scene
from cellwright.util.errors import CellwrightError
from tests.cell.devices.workers import FakeWorker
from tests.support.cells import INITIAL, WHOLE, publish, run, start, way

HEADER = RecordingHeader("cell", "whole", {"seed": 1})
AHEAD = (0.2, *INITIAL[1:])


def worked(cell: Cell, seconds: float = 2.5) -> None:
    """Work a cell for a time, including refused commands."""
    start(cell)
    publish(cell, "arm/command", way(AHEAD))
    with pytest.raises(CellwrightError):
        publish(cell, "arm/command", way(AHEAD, names=("no_joint",) * 7))
    run(cell, seconds)
    with pytest.raises(CellwrightError):
        cell.bus.call("/ariac/no_such", TriggerRequest())


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Return the recording of a run, and the state hash at its end."""
    path = tmp_path_factory.mktemp("recordings") / "run.mcap"
    cell, shown = Cell(WHOLE), {"score": 0}
    recorder = Recorder(cell, path, HEADER, attachments={"sources/a.yaml": b"a: 1\n"}, panel=lambda: shown)
    recorder.event({"kind": "note", "text": "begun"})
    worked(cell, 1.2)
    shown["score"] = 2
    run(cell, 1.3)
    recorder.end({"outcome": "until"})
    recorder.end({"outcome": "again"})
    assert recorder.is_whole
    assert recorder.paths == [path]
    assert all("/recorder" not in each.subscribers for each in cell.bus.topics())
    return path, cell.state_hash()


@pytest.mark.slow
def test_recorder_does_not_change_run(recorded: tuple[Path, str]) -> None:
    cell = Cell(WHOLE)
    worked(cell)
    assert cell.state_hash() == recorded[1]


def test_recorded_commands_reproduce_run(recorded: tuple[Path, str]) -> None:
    cell = Cell(WHOLE)
    with RecordingFile(recorded[0]) as recording:
        commands = list(recording.commands())
        hashes = [value for _, value in recording.values(names.STATE_HASH)]
    assert [(each.tick, each.kind.value, each.name) for each in commands] == [
        (0, "call", "/ariac/start_competition"),
        (1, "publish", "/ariac/arm/command"),
        (1, "publish", "/ariac/arm/command"),
    ]
    for command in commands:
        cell.simulation.step_until(cell.simulation.clock.time_of(command.tick))
        command.carry_out(cell.bus)
    cell.simulation.step_until(cell.simulation.clock.time_of(hashes[-1]["tick"]))
    assert cell.state_hash() == hashes[-1]["hash"] == recorded[1]


def test_recording_has_all_published_messages(recorded: tuple[Path, str]) -> None:
    cell = Cell(WHOLE)
    heard: list[tuple[str, int]] = []
    for info in cell.bus.topics():
        cell.bus.subscribe(info.name, lambda _, name=info.name: heard.append((name, cell.simulation.now)))  # type: ignore[misc]
    worked(cell)
    with RecordingFile(recorded[0]) as recording:
        assert [each[:2] for each in recording.messages() if each.topic not in names.OWN_TOPICS] == heard
        for each in cell.bus.topics():
            topic = recording.topics[each.name]
            assert (topic.type, topic.direction, topic.latch) == (each.type, each.direction.value, each.latch)
        score = recording.decode(next(recording.messages(["/ariac/current_score"])))
        assert score.data == 0.0


def test_recorded_scene_and_frames_equal_those_of_cell(recorded: tuple[Path, str]) -> None:
    cell = Cell(WHOLE)
    taker = SceneCapture.of(cell)
    with RecordingFile(recorded[0]) as recording:
        assert recording.scene == encode_scene(taker.scene)
        assert decode_scene(recording.scene).name == "whole"
        found = list(recorded_frames(recording))
        assert [each.time for each in found[:3]] == [0, 40_000_000, 80_000_000]
        assert len(found) == 63 + 1  # and one at the end
        for number in (0, 1, 30, 62):
            alone = next(recorded_frames(recording, start=found[number].time))
            assert alone.time == found[number].time
            assert np.array_equal(alone.poses, found[number].poses)
        middle = list(recorded_frames(recording, start=1_500_000_000, until=1_700_000_000))
        assert [each.time for each in middle] == [1_520_000_000 + n * 40_000_000 for n in range(5)]
        assert not any(recorded_frames(recording, until=0))
    worked(cell)
    cell.simulation.refresh()
    last = taker.frame(cell.simulation.data, cell.simulation.now)
    assert np.array_equal(last.poses, found[-1].poses)
    assert np.array_equal(last.shown, found[-1].shown)


def test_recording_keeps_panel_events_and_end(recorded: tuple[Path, str]) -> None:
    with RecordingFile(recorded[0]) as recording:
        assert recording.header == HEADER
        assert recording.sources == {"a.yaml": b"a: 1\n"}
        assert [value for _, value in recording.values(names.PANEL)] == [{"score": 0}, {"score": 2}]
        assert list(recording.values(names.EVENT)) == [(0, {"kind": "note", "text": "begun"})]
        assert recording.end == {"outcome": "until"}


def test_reset_starts_new_recording_file(tmp_path: Path) -> None:
    cell = Cell(WHOLE)
    recorder = Recorder(cell, tmp_path / "run.mcap", HEADER)
    run(cell, 0.1)
    first = cell.state_hash()
    cell.reset()
    run(cell, 0.05)
    recorder.end({"outcome": "until"})
    cell.reset()
    assert recorder.paths == [tmp_path / "run.mcap", tmp_path / "run_2.mcap"]
    ends: list[Any] = []
    for path in recorder.paths:
        with RecordingFile(path) as recording:
            ends.append((recording.end, recording.end_time, recording.counts["/clock"]))
            hashes = [value["hash"] for _, value in recording.values(names.STATE_HASH)]
            assert (hashes[-1] == first) is (path.stem == "run")
            assert any(recorded_frames(recording))
    assert ends == [({"outcome": "reset"}, 100_000_000, 50), ({"outcome": "until"}, 50_000_000, 25)]


def test_pictures_are_recorded_only_while_a_client_subscribes(tmp_path: Path) -> None:
    camera = "{type: rgb_camera, pose: {}, width: 16, height: 8, latency: 0, rate: 20}"
    cell = Cell(load_trial(text=f"cellwright: {{sensors: {{eye: {camera}, other: {camera}}}}}").trial)
    workers: list[FakeWorker] = []

    def start(scene: Scene) -> FakeWorker:
        workers.append(FakeWorker(scene))
        return workers[-1]

    cell.render_service._start = start
    recorder = Recorder(cell, tmp_path / "run.mcap", HEADER)
    run(cell, 0.11)
    assert not workers
    listening = cell.bus.subscribe("/ariac/eye/image_raw", lambda _: None)
    run(cell, 0.1)
    listening.cancel()
    run(cell, 0.1)
    recorder.end({})
    assert workers[0].count == 2
    with RecordingFile(tmp_path / "run.mcap") as recording:
        kept = [len(list(recording.messages([f"/ariac/eye/{name}"]))) for name in ("image_raw", "camera_info")]
    assert kept == [2, 6]  # the matrix costs nothing
