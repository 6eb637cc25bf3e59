from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.recording.format.format import RecordingHeader
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.rebuild import path_inside, rebuild, unpacked_files
from cellwright.util.errors import RecordingError
from tests.recording.plots.reading.recordings import write


def test_unpacked_files_keep_their_paths_and_are_deleted() -> None:
    with unpacked_files({"files/trial.yaml": b"a", "files/meshes/x.stl": b"b", "bundled/y.yaml": b""}) as folder:
        assert (folder / "files" / "trial.yaml").read_bytes() == b"a"
        assert (folder / "files" / "meshes" / "x.stl").read_bytes() == b"b"
    assert not folder.exists()


@pytest.mark.parametrize(
    "name", ["/etc/passwd", "../x", "a/../../x", "", "C:\\x", "c:x", "a\\..\\..\\x", "a\0b", "\ud800", None, 3, ["a"]]
)
def test_path_out_of_folder_is_refused(name: object) -> None:
    with pytest.raises(RecordingError, match="invalid file name"):
        path_inside(Path("/made"), name)


@given(st.text())
def test_any_name_stays_inside_folder(name: str) -> None:
    try:
        found = path_inside(Path("/made"), name)
    except RecordingError:
        return
    assert found.is_relative_to("/made")
    assert ".." not in found.parts


@pytest.mark.parametrize("sources", [{"a": b"", "a/b": b""}, {"x" * 300: b""}, {"x" * 5000: b""}])
def test_unpackable_names_are_reported_in_one_line(sources: dict[str, bytes]) -> None:
    with pytest.raises(RecordingError, match="cannot be unpacked") as error, unpacked_files(sources):
        pass
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("key", ["files", "packages"])
@pytest.mark.parametrize("name", ["n" * 300, "n/" * 5000, "a\0b", "\ud800"], ids=["long", "deep", "zero", "surrogate"])
def test_recording_with_name_that_no_file_can_have_cannot_be_run_again(tmp_path: Path, key: str, name: str) -> None:
    header = RecordingHeader("cell", "small", {"files": ["files/a.yaml"], key: [name]})
    write(tmp_path / "a.mcap", header, [])
    reasons = "the recording lacks |invalid file name"
    with (
        RecordingFile(tmp_path / "a.mcap") as recording,
        pytest.raises(RecordingError, match=reasons) as caught,
        rebuild(recording),
    ):
        pass
    assert len(str(caught.value)) < 300
