"""Tests of the reader of data sets: what it returns is what was written."""

from pathlib import Path

import numpy as np
import pytest

from cellwright.recording.dataset.read import DataSet
from cellwright.util.errors import UnknownNameError, UsageError
from tests.recording.dataset.sets import (
    CAMERAS,
    DATA,
    EPISODES,
    LENGTHS,
    SENTENCES,
    change_info,
    change_table,
    copied,
    grey,
    made,
    write,
)

TOP, SIDE = (f"observation.images.{camera}" for camera in CAMERAS)


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("sets") / "good", CAMERAS)


def test_rows_and_sentences_are_those_that_were_written(good: Path) -> None:
    read = DataSet(good)
    assert (len(read), read.rate, read.videos) == (2, 20, (TOP, SIDE))
    for number in (0, 1):
        assert read.sentence(number) == SENTENCES[number]
        columns = read.columns(number)
        assert columns["frame_index"].tolist() == [*range(LENGTHS[number])]
        for column in made(number).columns:
            np.testing.assert_array_equal(columns[column.name], column.values)


def test_recording_of_an_episode_is_named_where_the_set_names_it(good: Path, tmp_path: Path) -> None:
    assert [DataSet(good).recording(number) for number in (0, 1)] == [("run0.mcap", "0" * 64), ("run1.mcap", "1" * 64)]
    folder = copied(good, tmp_path / "of-another-program")
    change_table(folder / EPISODES, lambda table: table.drop_columns(["recording/name", "recording/sha256"]))
    assert DataSet(folder).recording(0) == ("", "")


@pytest.mark.parametrize(("feature", "camera"), [(TOP, "top"), (SIDE, "side")])
@pytest.mark.parametrize("episode", [0, 1])
def test_pictures_are_those_of_the_frames(good: Path, feature: str, camera: str, episode: int) -> None:
    shown = [float(picture.mean()) for picture in DataSet(good).pictures(episode, feature)]
    expected = [grey(episode, frame, camera) for frame in range(LENGTHS[episode])]
    np.testing.assert_allclose(shown, expected, atol=3)


def test_set_with_a_fault_is_refused_with_the_command_that_checks_it(good: Path, tmp_path: Path) -> None:
    folder = copied(good, tmp_path / "bad")
    change_table(folder / DATA, lambda table: table.drop_columns(["action"]))
    with pytest.raises(UsageError, match=r"action: column is missing; see cellwright export --check .*bad$"):
        DataSet(folder)


def test_unknown_feature_and_missing_pictures_are_refused(good: Path, tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match=r"did you mean observation\.images\.top"):
        next(DataSet(good).pictures(0, "observation.images.tip"))
    folder = copied(good, tmp_path / "short")
    (video,) = (folder / "videos" / TOP).rglob("*.mp4")
    (other,) = (write(tmp_path / "other", ("top",)) / "videos" / TOP).rglob("*.mp4")
    video.write_bytes(other.read_bytes()[:1000])
    with pytest.raises(UsageError, match="cannot be read"):
        list(DataSet(folder).pictures(0, TOP))
    change_info(folder, fps=10)
    with pytest.raises(UsageError, match="timestamp must be"):
        DataSet(folder)
