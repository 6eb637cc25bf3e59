"""Tests of films: pictures of a camera that are encoded frame by frame."""

from typing import Any

import numpy as np
import pytest

from cellwright.recording.dataset.films import Films
from cellwright.recording.dataset.video import Clip
from cellwright.util.errors import UsageError
from tests.recording.dataset.sets import HEIGHT, RATE, WIDTH, grey


def picture(level: int, width: int = WIDTH) -> Any:
    return np.full((HEIGHT, width, 3), level, np.uint8)


def test_film_has_the_video_and_the_statistics_of_its_own_pictures() -> None:
    films, alone = Films("run.mcap", ["top", "side"], RATE), Clip(WIDTH, HEIGHT, RATE)
    for frame in range(5):
        films.add({"side": picture(grey(1, frame)), "top": picture(grey(0, frame))})
        alone.add(picture(grey(0, frame)))
    top, side = films.finish()
    assert (top.camera, side.camera) == ("top", "side")
    assert (top.width, top.height, top.frames) == (WIDTH, HEIGHT, 5)
    assert top.video == alone.finish() != side.video
    mean = np.mean([grey(0, frame) / 255 for frame in range(5)])
    np.testing.assert_allclose(top.statistics.as_lists()["mean"], np.full((3, 1, 1), mean), rtol=1e-12)


def test_camera_without_pictures_has_no_film() -> None:
    assert Films("run.mcap", ["top"], RATE).finish() == ()


@pytest.mark.parametrize(
    ("widths", "text"),
    [
        ([97], r"^run\.mcap: camera top: width and height must be even for a video \(got 97 x 64 pixels\); change the"),
        ([96, 98], r"^run\.mcap: camera top: all its pictures have one size \(got 98 x 64, before 96 x 64 pixels\)$"),
    ],
    ids=["odd", "changed"],
)
def test_size_that_no_video_has_is_refused(widths: list[int], text: str) -> None:
    films = Films("run.mcap", ["top"], RATE)
    for width in widths[:-1]:
        films.add({"top": picture(0, width)})
    with pytest.raises(UsageError, match=text):
        films.add({"top": picture(0, widths[-1])})
