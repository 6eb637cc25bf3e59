"""Tests of the check of videos, and of the mark that shows a shift by one frame."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest

from cellwright.recording.dataset.check import check_lerobot
from cellwright.recording.dataset.check_videos import check_videos
from cellwright.recording.dataset.described import read_description
from tests.recording.dataset.damage import put, replaced
from tests.recording.dataset.sets import (
    EPISODES,
    HEIGHT,
    LENGTHS,
    RATE,
    WIDTH,
    change_info,
    change_table,
    copied,
    grey,
    greys,
    write,
)

VIDEO = "videos/observation.images.top/chunk-000/file-000.mp4"
COLUMN = "videos/observation.images.top"
GREYS = [grey(episode, frame) for episode in (0, 1) for frame in range(LENGTHS[episode])]


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("sets") / "good")


def film(path: Path, levels: list[int], rate: int = RATE, width: int = WIDTH, late: Fraction = Fraction(0)) -> None:
    """Write a video of grey pictures in place of another one."""
    with av.open(str(path), "w", format="mp4") as file:
        stream: Any = file.add_stream("libx264", rate=rate, options={"bf": "0"})
        stream.width, stream.height, stream.pix_fmt = width, HEIGHT, "yuv420p"
        stream.codec_context.time_base = Fraction(1, 10_000)
        for k, level in enumerate(levels):
            frame = av.VideoFrame.from_ndarray(np.full((HEIGHT, width, 3), level, np.uint8), format="rgb24")
            frame.pts, frame.time_base = round((Fraction(k, rate) + (late if k else 0)) * 10_000), Fraction(1, 10_000)
            file.mux(stream.encode(frame))
        file.mux(stream.encode(None))


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda path: film(path, GREYS[:-1]), "must have a picture for each frame of its episodes, 21 (got 20)"),
        (lambda path: film(path, GREYS, late=Fraction(1, 1000)), "picture 1 must be at 0.0500 s (got 0.0510)"),
        (lambda path: film(path, GREYS, width=98), "pictures must be 96 x 64 pixels, as in info.json (got 98 x 64)"),
        (lambda path: film(path, GREYS, rate=10), "must have the 20 pictures per second of info.json (got 10)"),
        (lambda path: path.write_bytes(b"no video"), "cannot be read: Invalid data found when processing input"),
        (lambda path: path.unlink(), "cannot be read: No such file or directory"),
    ],
    ids=["length", "late", "size", "rate", "damaged", "missing"],
)
def test_wrong_video_is_a_problem(good: Path, tmp_path: Path, change: Callable[[Path], Any], text: str) -> None:
    folder = copied(good, tmp_path / "set")
    change(folder / VIDEO)
    assert f"{folder / VIDEO}: {text}" in check_lerobot(folder)


def test_video_of_no_episode_is_a_problem(good: Path, tmp_path: Path) -> None:
    folder = copied(good, tmp_path / "set")
    other = folder / VIDEO.replace("file-000", "file-001")
    other.write_bytes((folder / VIDEO).read_bytes())
    assert check_lerobot(folder) == [f"{other}: is of no episode"]


@pytest.mark.parametrize(
    ("name", "time", "text"),
    [
        ("from_timestamp", 0.65, "episode 1: from_timestamp must be 0.6000, by the frames before it (got 0.6500)"),
        ("to_timestamp", 1.0, "episode 1: to_timestamp must be 1.0500, by the frames before it (got 1.0000)"),
    ],
)
def test_place_that_is_shifted_by_a_frame_is_a_problem(
    good: Path, tmp_path: Path, name: str, time: float, text: str
) -> None:
    folder = copied(good, tmp_path / "set")
    change_table(folder / EPISODES, put(f"{COLUMN}/{name}", replaced(1, time)))
    assert check_lerobot(folder) == [f"{folder / VIDEO}: {text}"]


def test_file_that_is_missing_for_an_episode_is_a_problem(good: Path, tmp_path: Path) -> None:
    folder = copied(good, tmp_path / "set")
    change_table(folder / EPISODES, put(f"{COLUMN}/file_index", replaced(1, 3)))
    missing = folder / VIDEO.replace("file-000", "file-003")
    assert f"{missing}: cannot be read: No such file or directory" in check_lerobot(folder)


def test_pictures_that_are_shifted_by_a_frame_show_in_their_mark_alone(good: Path, tmp_path: Path) -> None:
    folder = copied(good, tmp_path / "set")
    np.testing.assert_allclose(greys(folder, 0), GREYS[:12], atol=3)
    film(folder / VIDEO, [GREYS[0], *GREYS[:-1]])
    assert check_lerobot(folder) == []
    late = np.array(greys(folder, 0)) - GREYS[:12]
    np.testing.assert_allclose(late, [0, *[-9] * 11], atol=3)


def test_other_rate_in_the_description_is_a_problem(good: Path, tmp_path: Path) -> None:
    folder = copied(good, tmp_path / "set")
    change_info(folder, fps=10)
    assert f"{folder / VIDEO}: must have the 10 pictures per second of info.json (got 20)" in check_lerobot(folder)


def test_videos_are_not_judged_without_episodes(good: Path) -> None:
    problems: list[str] = []
    described = read_description(good, problems)
    assert described is not None
    check_videos(described, [], problems)
    assert problems == []
