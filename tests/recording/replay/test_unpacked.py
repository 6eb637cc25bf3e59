from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.recording.replay.rebuild import path_inside, unpacked_files
from cellwright.util.errors import RecordingError


def test_files_lie_as_they_lay_and_are_gone_afterwards() -> None:
    with unpacked_files({"files/trial.yaml": b"a", "files/meshes/x.stl": b"b", "bundled/y.yaml": b""}) as folder:
        assert (folder / "files" / "trial.yaml").read_bytes() == b"a"
        assert (folder / "files" / "meshes" / "x.stl").read_bytes() == b"b"
    assert not folder.exists()


@pytest.mark.parametrize(
    "name", ["/etc/passwd", "../x", "a/../../x", "", "C:\\x", "c:x", "a\\..\\..\\x", None, 3, ["a"]]
)
def test_nothing_leads_out_of_the_folder(name: object) -> None:
    with pytest.raises(RecordingError, match="invalid file name"):
        path_inside(Path("/made"), name)


@given(st.text())
def test_whatever_a_name_is_it_stays_inside(name: str) -> None:
    try:
        found = path_inside(Path("/made"), name)
    except RecordingError:
        return
    assert found.is_relative_to("/made")
    assert ".." not in found.parts


@pytest.mark.parametrize("sources", [{"a": b"", "a/b": b""}, {"x" * 5000: b""}, {"a\0b": b""}])
def test_what_cannot_be_unpacked_is_one_line(sources: dict[str, bytes]) -> None:
    with pytest.raises(RecordingError, match="cannot be unpacked") as error, unpacked_files(sources):
        pass
    assert "\n" not in str(error.value)
