"""Export of a recording, read by the readers of MCAP and of ROS 2's messages."""

from __future__ import annotations

import errno
import json
import os
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

import cellwright
from cellwright.cell.cell import Cell
from cellwright.recording.format.format import FRAME, METADATA, RecordedTopic, RecordingHeader
from cellwright.recording.format.mcap_file import McapFile
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.format.recorder import Recorder
from cellwright.recording.replay.exported import write_mcap
from cellwright.util.errors import RecordingError, UsageError
from tests.recording.format.files import TALK, text
from tests.recording.replay.made import record, short_work
from tests.support.cells import WHOLE, run

SECOND = 1_000_000_000
MARKERS, TRANSFORMS = "/cellwright/markers", "/cellwright/tf"
TOOL = "vacuum_gripper_link"

LAYOUT = Path(__file__).parents[4] / "docs" / "foxglove-layout.json"

Exported = list[tuple[str, int, Any]]


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("exported") / "run.mcap", short_work)


def export(path: Path, out: Path, start: int | None = None, until: int | None = None) -> list[str]:
    """Export a file; return what is missing."""
    with RecordingFile(path) as recording:
        return write_mcap(recording, out, start=start, until=until)


def read(path: Path) -> Exported:
    """Return topic, time [ns] and message of everything in a file, found by its index."""
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        assert reader.get_summary() is not None
        found = [
            (each.channel.topic, each.message.log_time, each.decoded_message) for each in reader.iter_decoded_messages()
        ]
    assert [time for _, time, _ in found] == sorted(time for _, time, _ in found)
    return found


@pytest.fixture(scope="module")
def exported(path: Path, tmp_path_factory: pytest.TempPathFactory) -> Exported:
    out = tmp_path_factory.mktemp("exported") / "out.mcap"
    assert export(path, out) == []
    return read(out)


@pytest.mark.slow
def test_export_has_all_messages_of_recording(path: Path, exported: Exported) -> None:
    counts = Counter(topic for topic, _, _ in exported)
    with RecordingFile(path) as recording:
        expected = {name: count for name, count in recording.counts.items() if name != FRAME}
    assert {name: count for name, count in counts.items() if name not in (MARKERS, TRANSFORMS)} == expected
    assert counts[MARKERS] == 1
    joints = [(time, list(message.position)) for topic, time, message in exported if topic == "/ariac/joint_states"]
    with cellwright.open_recording(path) as opened:
        again = [
            (round(each.time * 1e9), each.message.position.tolist()) for each in opened.messages("/ariac/joint_states")
        ]
    assert joints == again


def test_every_marker_has_frame_and_every_body_has_marker(path: Path, exported: Exported) -> None:
    (markers,) = (message.markers for topic, _, message in exported if topic == MARKERS)
    first = next(message.transforms for topic, _, message in exported if topic == TRANSFORMS)
    frames = {each.child_frame_id for each in first} | {"world"}
    assert {each.header.frame_id for each in markers} <= frames
    assert all(each.frame_locked for each in markers)
    with cellwright.open_recording(path) as opened:
        scene = opened.scene
    assert frames == {"world", *(f"cellwright/{name}" for name in scene.bodies[1:])}
    seen = {scene.bodies[shape.body] for shape in scene.shapes if shape.layer in (1, 2)}
    assert {each.ns for each in markers} == seen


def test_transforms_of_tool_equal_recorded_path(path: Path, exported: Exported) -> None:
    found = {}
    for topic, _, message in exported:
        for each in message.transforms if topic == TRANSFORMS else ():
            if each.child_frame_id == f"cellwright/{TOOL}":
                place, stamp = each.transform.translation, each.header.stamp
                found[stamp.sec * SECOND + stamp.nanosec] = (place.x, place.y, place.z)
    with cellwright.open_recording(path) as opened:
        times, poses = opened.path(TOOL)
    places = {round(time * 1e9): pose[:3].tolist() for time, pose in zip(times.tolist(), poses, strict=True)}
    moved = {time for time in places if time in found}
    assert len(moved) > 20
    assert all(found[time] == pytest.approx(places[time]) for time in moved)
    assert len({tuple(each) for each in found.values()}) == len({tuple(each) for each in places.values()})


@pytest.mark.slow
def test_foxglove_layout_names_existing_topics(exported: Exported) -> None:
    panels = json.loads(LAYOUT.read_text(encoding="utf-8"))["configById"]
    (markers,) = panels["3D!cell"]["topics"]
    assert markers == MARKERS
    newest = {topic: message for topic, _, message in exported}
    score, *joints = [path for name in ("Plot!score", "Plot!joints") for path in panels[name]["paths"]]
    assert score["value"] == "/ariac/current_score.data"
    assert newest["/ariac/current_score"].data == 0.0
    names = newest["/ariac/joint_states"].name
    for number, joint in enumerate(joints):
        assert joint["value"] == f"/ariac/joint_states.position[{number}]"
        assert names[number].startswith(joint["label"].replace(" ", "_"))


@pytest.mark.slow
def test_export_of_time_range_begins_with_latched_state(path: Path, tmp_path: Path, exported: Exported) -> None:
    assert export(path, tmp_path / "part.mcap", start=2 * SECOND, until=int(2.5 * SECOND)) == []
    part = read(tmp_path / "part.mcap")
    assert (part[0][1], part[-1][1]) == (2 * SECOND, int(2.5 * SECOND))
    at_begin = {topic for topic, time, _ in part if time == 2 * SECOND}
    assert {MARKERS, TRANSFORMS, "/tf_static", "/ariac/orders"} <= at_begin
    assert not any(topic == "/ariac/orders" and time == 2 * SECOND for topic, time, _ in exported)
    first = next(message.transforms for topic, _, message in part if topic == TRANSFORMS)
    whole = next(message.transforms for topic, _, message in exported if topic == TRANSFORMS)
    assert [each.child_frame_id for each in first] == [each.child_frame_id for each in whole]
    assert {each.header.stamp.sec for each in first} == {2}
    inside = Counter(topic for topic, time, _ in exported if 2 * SECOND < time <= 2.5 * SECOND and topic != TRANSFORMS)
    assert Counter(topic for topic, time, _ in part if time > 2 * SECOND and topic != TRANSFORMS) == inside


@pytest.mark.slow
def test_transforms_after_reset_of_state_have_time_that_goes_on(tmp_path: Path) -> None:
    cell = Cell(WHOLE)
    recorder = Recorder(cell, tmp_path / "run.mcap", RecordingHeader("cell", "whole"))
    run(cell, 0.5)
    cell.reset(keeps_clock=True)
    run(cell, 0.2)
    recorder.end({})
    export(recorder.paths[1], tmp_path / "out.mcap")
    found = [(time, message) for topic, time, message in read(tmp_path / "out.mcap") if topic == TRANSFORMS]
    assert found
    for time, message in found:
        stamps = {each.header.stamp.sec * SECOND + each.header.stamp.nanosec for each in message.transforms}
        assert max(stamps) == time + SECOND // 2


def test_export_of_truncated_recording_has_index(path: Path, tmp_path: Path) -> None:
    data = path.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) // 2])
    assert export(tmp_path / "cut.mcap", tmp_path / "out.mcap") == []
    with RecordingFile(tmp_path / "cut.mcap") as recording:
        assert not recording.is_complete
        counts = recording.counts
    found = Counter(topic for topic, _, _ in read(tmp_path / "out.mcap"))
    assert found["/ariac/joint_states"] == counts["/ariac/joint_states"] > 20


def test_export_is_refused_as_recording(path: Path, tmp_path: Path) -> None:
    export(path, tmp_path / "out.mcap")
    with pytest.raises(RecordingError, match=r"out\.mcap: not a recording, but an export for other tools"):
        RecordingFile(tmp_path / "out.mcap")


def test_invalid_export_is_refused_and_changes_no_file(path: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no messages in this time range"):
        export(path, tmp_path / "out.mcap", start=100 * SECOND)
    before = path.read_bytes()
    with pytest.raises(UsageError, match="is the recording itself"):
        export(path, path)
    with pytest.raises(UsageError, match=r"none.out\.mcap: cannot be written: No such file"):
        export(path, tmp_path / "none" / "out.mcap")
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == []


def test_full_disk_is_refused_and_leaves_no_file(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def write(_file: int, _data: bytes) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "write", write)
    with pytest.raises(UsageError, match=r"/out\.mcap: cannot be written any more: No space left on device$"):
        export(path, tmp_path / "out.mcap")
    assert list(tmp_path.iterdir()) == []


def test_missing_scene_is_reported(tmp_path: Path) -> None:
    header = RecordingHeader("cell", "small")
    with McapFile(tmp_path / "a.mcap") as file:
        file.describe(METADATA, header.metadata())
        channel = file.channel(TALK)
        file.add(channel, 5, text("a word"))
    (line,) = export(tmp_path / "a.mcap", tmp_path / "out.mcap")
    assert line.startswith("scene is left out: ")
    assert [(topic, time, message.data) for topic, time, message in read(tmp_path / "out.mcap")] == [
        ("/talk", 5, "a word")
    ]


def test_unknown_type_is_reported(tmp_path: Path) -> None:
    with McapFile(tmp_path / "a.mcap") as file:
        file.describe(METADATA, RecordingHeader("cell", "small").metadata())
        file.add(file.channel(TALK), 5, text("a word"))
    with RecordingFile(tmp_path / "a.mcap") as recording:
        recording.topics["/else"] = RecordedTopic("/else", "other_msgs/Word")
        lines = write_mcap(recording, tmp_path / "out.mcap")
    assert any(line.startswith("/else is left out: ") for line in lines)
