"""Output files of a recording."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.recording.format.files import RecordingFiles
from cellwright.util.errors import UsageError
from tests.recording.format.files import write


@pytest.mark.parametrize(
    ("names", "reason"),
    [
        ((), "record: no file given"),
        (("a.txt",), "use a name such as run.mcap"),
        (("a.bag", "b.bag"), "only one .bag file"),
    ],
)
def test_invalid_recording_paths_are_refused(names: tuple[str, ...], reason: str) -> None:
    with pytest.raises(UsageError, match=reason):
        RecordingFiles([Path(each) for each in names])


def test_bag_alone_is_made_from_temporary_mcap_file(tmp_path: Path) -> None:
    files = RecordingFiles([tmp_path / "run.bag"])
    assert files.path == tmp_path / "run.bag.mcap"
    again = tmp_path / "run.bag_2.mcap"
    write(files.path, 3)
    write(again, 3)
    files.finish([files.path, again])
    assert files.is_whole
    assert files.written == [tmp_path / "run.bag", tmp_path / "run_2.bag"]
    assert sorted(each.name for each in tmp_path.iterdir()) == ["run.bag", "run_2.bag"]


def test_bag_and_mcap_file_are_both_kept(tmp_path: Path) -> None:
    files = RecordingFiles([tmp_path / "run.bag", tmp_path / "other.mcap"])
    write(files.path, 3)
    files.finish([files.path])
    assert files.written == [tmp_path / "other.mcap", tmp_path / "run.bag"]
    assert all(each.is_file() for each in files.written)


def test_failed_bag_keeps_mcap_file(tmp_path: Path) -> None:
    lines: list[str] = []
    files = RecordingFiles([tmp_path / "run.bag"], report=lines.append)
    write(files.path, 3)
    (tmp_path / "run.bag").mkdir()
    files.finish([files.path])
    assert not files.is_whole
    assert files.path.is_file()
    assert len(lines) == 1
    assert lines[0].endswith(f"the recording is in {files.path}")
