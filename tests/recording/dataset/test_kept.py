"""Tests of kept episodes: each is the one that was made, and is made again where anything differs."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cellwright.recording.dataset import kept
from cellwright.recording.dataset.episode import FACTS, Episode
from cellwright.recording.dataset.kept import kept_episode
from tests.recording.dataset.sets import CAMERAS, made

SETTINGS = {"hz": 20, "cameras": [*CAMERAS]}


class Maker:
    """Makes an episode, and counts."""

    def __init__(self) -> None:
        self.calls = 0

    def __call__(self) -> Episode:
        """Make it."""
        self.calls += 1
        return made(0, CAMERAS)


@pytest.fixture(name="recording")
def recording_of(tmp_path: Path) -> Path:
    path = tmp_path / "run0.mcap"
    path.write_bytes(b"commands")
    return path


def test_kept_episode_is_the_one_that_was_made(tmp_path: Path, recording: Path) -> None:
    make = Maker()
    first = kept_episode(tmp_path / "kept", recording, SETTINGS, make)
    again = kept_episode(tmp_path / "kept", recording, SETTINGS, make)
    assert make.calls == 1
    expected = made(0, CAMERAS)
    assert [getattr(again, name) for name in FACTS] == [getattr(expected, name) for name in FACTS]
    for column, given in zip(again.columns, first.columns, strict=True):
        assert (column.name, column.names, column.units) == (given.name, given.names, given.units)
        assert column.values.dtype == given.values.dtype
        np.testing.assert_array_equal(column.values, given.values)
    for film, wanted in zip(again.films, first.films, strict=True):
        assert (film.camera, film.width, film.height, film.frames) == (
            wanted.camera,
            wanted.width,
            wanted.height,
            wanted.frames,
        )
        assert film.video == wanted.video
        assert film.statistics.as_lists() == wanted.statistics.as_lists()


def other_content(recording: Path, _monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    recording.write_bytes(b"other commands")
    return SETTINGS


def other_settings(_recording: Path, _monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    return {**SETTINGS, "hz": 10}


def other_version(_recording: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    monkeypatch.setattr(kept, "VERSION", "0.0.0")
    return SETTINGS


@pytest.mark.parametrize("change", [other_content, other_settings, other_version])
def test_episode_is_made_again_where_anything_differs(
    change: Any, tmp_path: Path, recording: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make, folder = Maker(), tmp_path / "kept"
    kept_episode(folder, recording, SETTINGS, make)
    kept_episode(folder, recording, change(recording, monkeypatch), make)
    assert make.calls == 2


@pytest.mark.parametrize("content", [b"", b"no archive", None], ids=["empty", "foreign", "cut"])
def test_damaged_file_is_made_again(content: bytes | None, tmp_path: Path, recording: Path) -> None:
    make, folder = Maker(), tmp_path / "kept"
    kept_episode(folder, recording, SETTINGS, make)
    [file] = (tmp_path / "kept").iterdir()
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2] if content is None else content)
    kept_episode(folder, recording, SETTINGS, make)
    assert make.calls == 2
    assert file.read_bytes() == whole
