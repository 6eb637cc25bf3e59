"""MCAP file that grows during a run: other programs read it, and nothing is lost."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from cellwright.recording.format import mcap_file
from cellwright.recording.format.format import RecordedTopic
from cellwright.recording.format.mcap_file import McapFile
from cellwright.recording.format.reader import RecordingFile
from cellwright.util.errors import UnknownNameError, UsageError
from tests.recording.format.files import TALK, text, write

FULL = Path("/dev/full")


def test_mcap_library_reads_messages_with_schemas(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap", 100)
    with (tmp_path / "a.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert reader.get_header().profile == "ros2"
        assert summary.statistics.message_count == 100
        assert summary.statistics.channel_message_counts == {1: 50, 2: 50}
        assert summary.statistics.message_end_time == 99_000_000
        assert len(summary.chunk_indexes) == summary.statistics.chunk_count > 2
        assert [each.name for each in reader.iter_attachments()] == ["scene", "sources/trial.yaml"]
        assert next(iter(reader.iter_metadata())).metadata["kind"] == "cell"
        found = [
            (channel.topic, message.log_time, said.data) for _, channel, message, said in reader.iter_decoded_messages()
        ]
        late = [message.log_time for _, _, message in reader.iter_messages(topics=["/shout"], starting_at=90_000_000)]
    assert found == [(("/talk", "/shout")[n % 2], n * 1_000_000, f"word {n}") for n in range(100)]
    assert late == [n * 1_000_000 for n in range(91, 100, 2)]


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(words=st.lists(st.binary(max_size=40), max_size=60), size=st.integers(1, 400))
def test_messages_read_equal_messages_written(
    tmp_path_factory: pytest.TempPathFactory, words: list[bytes], size: int
) -> None:
    path = tmp_path_factory.mktemp("files") / "a.mcap"
    write(path, 0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mcap_file, "CHUNK", size)
        with McapFile(path) as file:
            file.describe("cellwright", {"format": "1", "kind": "cell", "name": "", "header": "{}"})
            channel = file.channel(TALK)
            for time, word in enumerate(words):
                file.add(channel, time, word)
    with RecordingFile(path) as recording:
        assert [each.data for each in recording.messages()] == words
        assert recording.counts["/talk"] == len(words)


def test_flushed_messages_are_in_unfinished_file(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    write(path, 0)
    file = McapFile(path)
    file.describe("cellwright", {"format": "1", "kind": "cell", "name": "", "header": "{}"})
    file.add(file.channel(TALK), 5, text("here"))
    file.flush()
    with RecordingFile(path) as recording:
        assert not recording.is_complete
        assert [each.data for each in recording.messages()] == [text("here")]
    file.close()
    file.close()
    file.add(1, 6, b"behind the end")
    with RecordingFile(path) as recording:
        assert recording.is_complete


def test_channel_of_unknown_type_is_refused(tmp_path: Path) -> None:
    with McapFile(tmp_path / "a.mcap") as file, pytest.raises(UnknownNameError, match="no_such"):
        file.channel(RecordedTopic("/a", "std_msgs/no_such"))


def test_unwritable_path_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="cannot be written"):
        McapFile(tmp_path / "no" / "a.mcap")


@pytest.mark.skipif(not FULL.exists(), reason="there is no full disk to be had here")
def test_full_disk_is_reported_once_and_stops_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mcap_file, "MAX_WAITING", 1 << 12)
    said: list[str] = []
    file = McapFile(FULL, report=said.append)
    channel = file.channel(TALK)
    for time in range(1000):
        file.add(channel, time, bytes(100))
    file.flush()
    file.close()
    assert not file.is_whole
    assert said == ["/dev/full: cannot be written any more: No space left on device"]
