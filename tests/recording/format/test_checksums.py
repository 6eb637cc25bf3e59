"""Integrity of a recording: each changed byte is found."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.recording.format.reader import RecordingFile
from cellwright.util.errors import RecordingError
from tests.recording.format.files import write


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of some chunks."""
    path = tmp_path_factory.mktemp("recordings") / "whole.mcap"
    write(path, 300, pieces=6)
    return path


def damage(path: Path) -> str:
    """Return the error about a changed file; empty if it is unchanged."""
    try:
        with RecordingFile(path) as recording:
            recording.check_bytes()
            return "" if recording.is_complete else f"{path}: was cut short"
    except RecordingError as error:
        return str(error)


@given(where=st.floats(0, 1), bit=st.integers(0, 7))
@settings(max_examples=60, deadline=None)
def test_any_flipped_bit_is_found(
    whole: Path, tmp_path_factory: pytest.TempPathFactory, where: float, bit: int
) -> None:
    data = bytearray(whole.read_bytes())
    data[int(where * (len(data) - 1))] ^= 1 << bit
    path = tmp_path_factory.getbasetemp() / "flipped.mcap"
    path.write_bytes(data)

    error = damage(path)

    assert error.startswith(f"{path}: ")
    assert "\n" not in error


def test_whole_and_truncated_files_pass_check(whole: Path, tmp_path: Path) -> None:
    assert not damage(whole)
    data = whole.read_bytes()
    for kept in (len(data) * 2 // 3, len(data) // 3):
        (tmp_path / "cut.mcap").write_bytes(data[:kept])
        with RecordingFile(tmp_path / "cut.mcap") as recording:
            recording.check_bytes()


def test_attachment_of_truncated_file_is_checked(whole: Path, tmp_path: Path) -> None:
    data = whole.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) * 2 // 3].replace(b"a scene", b"a scone"))
    with (
        RecordingFile(tmp_path / "cut.mcap") as recording,
        pytest.raises(RecordingError, match="wrong checksum of the attached file 'scene'"),
    ):
        recording.check_bytes()
