"""Reader of truncated and untrusted recordings."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.recording.format import reader
from cellwright.recording.format.reader import RecordingFile
from cellwright.util.errors import RecordingError, UnknownNameError
from tests.recording.format.files import SHOUT, TALK, text, write


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of some chunks."""
    path = tmp_path_factory.mktemp("recordings") / "whole.mcap"
    write(path, 300, pieces=6)
    return path


def test_recording_has_header_topics_counts_and_times(whole: Path) -> None:
    with RecordingFile(whole) as recording:
        assert recording.is_complete
        assert (recording.header.kind, recording.header.name) == ("cell", "small")
        assert recording.header.facts == {"seed": 7}
        assert recording.topics == {"/talk": TALK, "/shout": SHOUT}
        assert recording.counts == {"/talk": 150, "/shout": 150}
        assert (recording.begin, recording.end_time) == (0, 299_000_000)
        assert recording.sources == {"trial.yaml": b"orders: {}\n"}
        assert recording.scene == b"a scene"
        assert recording.start is None
        with pytest.raises(UnknownNameError, match="attachment"):
            recording.attachment("other")


@pytest.mark.slow
@given(first=st.integers(-10, 310), last=st.integers(-10, 310), kept=st.integers(1, 3))
@settings(max_examples=30, deadline=None)
def test_messages_of_topic_in_time_range_are_yielded(whole: Path, first: int, last: int, kept: int) -> None:
    with pytest.MonkeyPatch.context() as patch, RecordingFile(whole) as recording:
        patch.setattr(reader, "_KEPT", kept)
        found = [each.time for each in recording.messages(["/shout"], start=first * 1_000_000, until=last * 1_000_000)]
        assert found == [n * 1_000_000 for n in range(1, 300, 2) if first <= n < last]
        newest = recording.newest("/talk", last * 1_000_000)
        before = [n for n in range(0, 300, 2) if n <= last]
        assert (newest and newest.data) == (text(f"word {before[-1]}") if before else None)


@pytest.mark.slow
@given(cut=st.floats(0, 1))
@settings(max_examples=100, deadline=None)
def test_truncated_recording_has_same_messages_by_topic_as_in_all(
    whole: Path, tmp_path_factory: pytest.TempPathFactory, cut: float
) -> None:
    data = whole.read_bytes()
    path = tmp_path_factory.getbasetemp() / "cut_topics.mcap"
    path.write_bytes(data[: int(len(data) * (1 + 3 * cut) / 4)])
    try:
        recording = RecordingFile(path)
    except RecordingError:
        return
    with recording:
        everything = list(recording.messages())
        for topic in recording.topics:
            of_it = [each for each in everything if each.topic == topic]
            assert list(recording.messages([topic])) == of_it
            assert recording.counts[topic] == len(of_it)
            assert recording.newest(topic, 10**15) == (of_it[-1] if of_it else None)


@pytest.mark.slow
@given(cut=st.floats(0, 1))
@settings(max_examples=60, deadline=None)
def test_truncated_recording_is_read_up_to_cut(
    whole: Path, tmp_path_factory: pytest.TempPathFactory, cut: float
) -> None:
    data = whole.read_bytes()
    path = tmp_path_factory.getbasetemp() / "cut.mcap"
    path.write_bytes(data[: int(cut * (len(data) - 40))])
    try:
        recording = RecordingFile(path)
    except RecordingError:
        assert cut < 0.6, "once the head is there it is a recording"
        return
    with recording:
        assert not recording.is_complete
        found = [each.data for each in recording.messages()]
        assert found == [text(f"word {number}") for number in range(len(found))]
        assert recording.counts.total() >= len(found) - 50
        assert recording.end_time == max(0, len(found) - 1) * 1_000_000


@given(where=st.floats(0, 1), value=st.integers(0, 255), length=st.integers(1, 9))
@settings(max_examples=80, deadline=None)
def test_changed_bytes_are_read_or_refused_in_one_line(
    whole: Path, tmp_path_factory: pytest.TempPathFactory, where: float, value: int, length: int
) -> None:
    data = bytearray(whole.read_bytes())
    begin = int(where * (len(data) - 1))
    data[begin : begin + length] = bytes([value]) * len(data[begin : begin + length])
    path = tmp_path_factory.getbasetemp() / "changed.mcap"
    path.write_bytes(data)
    try:
        with RecordingFile(path) as recording:
            for message in recording.messages():
                recording.decode(message)
            _ = recording.counts, recording.end_time, recording.sources, list(recording.commands()), recording.end
    except RecordingError as error:
        if "\n" in str(error):
            pytest.fail(f"an error of several lines: {error}")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "not an MCAP file"),
        (b"#ROSBAG V2.0\n", "a ROS 1 bag"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "a Git LFS pointer"),
        (b"\x89MCAP0\r\n", "not a recording of Cellwright"),
    ],
)
def test_file_that_is_no_recording_is_refused(tmp_path: Path, content: bytes, reason: str) -> None:
    (tmp_path / "a.mcap").write_bytes(content)
    with pytest.raises(RecordingError, match=reason):
        RecordingFile(tmp_path / "a.mcap")


def test_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="cannot be read: No such file"):
        RecordingFile(tmp_path / "a.mcap")


def test_decode_of_invalid_bytes_is_refused(whole: Path) -> None:
    with RecordingFile(whole) as recording, pytest.raises(RecordingError, match=r"/talk at 0\.000 s"):
        recording.decode(next(recording.messages(["/talk"]))._replace(data=b"\0\1\0\0\xff\xff"))
