"""Tests of videos: pictures at their times, and files that are cut between episodes."""

import os
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest

from cellwright.recording.dataset.video import CameraVideos, Clip
from cellwright.util.errors import CellwrightError
from tests.recording.dataset.sets import HEIGHT, RATE, WIDTH, grey

KEY = "observation.images.top"


def clip(number: int, frames: int, rate: int = RATE) -> bytes:
    video = Clip(WIDTH, HEIGHT, rate)
    for frame in range(frames):
        video.add(np.full((HEIGHT, WIDTH, 3), grey(number, frame), np.uint8))
    return video.finish()


@pytest.mark.parametrize("rate", [20, 25, 30, 50, 60])
def test_picture_of_frame_is_at_exactly_its_time(tmp_path: Path, rate: int) -> None:
    videos = CameraVideos(tmp_path, KEY, rate)
    videos.append(clip(0, 7, rate))
    place = videos.append(clip(1, 5, rate))
    videos.close()
    assert place[f"videos/{KEY}/from_timestamp"] == 7 / rate
    with av.open(str(tmp_path / f"videos/{KEY}/chunk-000/file-000.mp4")) as file:
        stream: Any = file.streams.video[0]
        assert (stream.average_rate, stream.codec_context.name[-4:]) == (rate, "av1d")
        shown = [
            (Fraction(frame.pts or 0) * Fraction(frame.time_base or 0), frame.to_ndarray(format="rgb24").mean())
            for frame in file.decode(stream)
        ]
    assert [time for time, _ in shown] == [Fraction(k, rate) for k in range(12)]
    expected = [grey(0, frame) for frame in range(7)] + [grey(1, frame) for frame in range(5)]
    np.testing.assert_allclose([level for _, level in shown], expected, atol=3)


def test_files_are_cut_between_episodes(tmp_path: Path) -> None:
    clips = [clip(0, 4), clip(1, 3), clip(0, 2)]
    videos = CameraVideos(tmp_path, KEY, RATE, max_bytes=len(clips[0]) + len(clips[1]))
    places = [videos.append(each) for each in clips]
    videos.close()
    numbers = [tuple(place[f"videos/{KEY}/{name}"] for name in ("file_index", "from_timestamp")) for place in places]
    assert numbers == [(0, 0.0), (0, 4 / RATE), (1, 0.0)]
    assert len([*tmp_path.rglob("*.mp4")]) == 2


def test_size_that_the_encoder_refuses_is_an_error_with_the_size() -> None:
    with pytest.raises(CellwrightError, match="libsvtav1: cannot encode pictures of 2 x 2"):
        Clip(2, 2, RATE).add(np.zeros((2, 2, 3), np.uint8))


def test_encoder_prints_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    clip(0, 2)
    assert capfd.readouterr() == ("", "")


def test_encoder_makes_no_thread_a_real_time_one() -> None:
    own, others = os.sched_getscheduler(0), {*os.listdir("/proc/self/task")}
    clip = Clip(64, 64, 20)
    for _ in range(3):
        clip.add(np.zeros((64, 64, 3), np.uint8))
    started = {*os.listdir("/proc/self/task")} - others
    policies = [os.sched_getscheduler(int(each)) for each in started]
    clip.finish()
    assert policies == [own] * len(started)
    assert os.sched_getscheduler(0) == own
