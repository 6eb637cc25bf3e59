"""Tests of a video's pace: an estimate from the first frames, and progress while it takes minutes."""

from pathlib import Path

import pytest

from cellwright.rendering.video_options import VideoOptions
from cellwright.rendering.video_pace import VideoPace, duration_words

FILE = Path("a.mp4")


def lines_of(
    drawn: int, each: float, frames: int | None, options: VideoOptions | None = None, *, is_bound: bool = False
) -> list[tuple[int, str]]:
    """Return the lines of a video whose frames take `each` [s], with the number of frames drawn before."""
    lines: list[tuple[int, str]] = []
    now = 0
    pace = VideoPace(
        options or VideoOptions(FILE),
        frames,
        lambda line: lines.append((now, line)),
        is_bound=is_bound,
        clock=lambda: now * each,
    )
    for now in range(1, drawn + 1):  # noqa: B007 (the clock reads it)
        pace.count_drawn()
    return lines


def test_slow_video_gets_estimate_and_quick_settings_within_seconds() -> None:
    ((number, line),) = lines_of(40, 0.2, 12501, is_bound=True)
    assert number * 0.2 <= 3.0
    assert line == (
        "a.mp4: a frame takes 0.20 s, at most 12501 frames about 42 min; quicker: --video-speed 4, --video-size 640x360"
    )


def test_progress_comes_each_half_minute_with_time_left() -> None:
    _, *progress = lines_of(400, 1.0, 400)
    assert [number for number, _ in progress] == list(range(34, 400, 30))
    assert progress[0][1] == "a.mp4: 34 of 400 frames drawn, about 6 min to go"
    assert progress[-1][1] == "a.mp4: 394 of 400 frames drawn, about 6 s to go"


@pytest.mark.parametrize(("drawn", "each", "frames"), [(500, 0.1, 500), (300, 0.03, None), (3, 9.0, 3)])
def test_quick_or_short_video_says_nothing(drawn: int, each: float, frames: int | None) -> None:
    assert lines_of(drawn, each, frames) == []


def test_video_without_known_end_is_estimated_by_simulated_time() -> None:
    ((_, line),) = lines_of(100, 0.2, None)
    assert line.startswith("a.mp4: a frame takes 0.20 s, a simulated minute about 5 min; quicker: ")


def test_video_that_becomes_slow_later_is_estimated_then() -> None:
    lines: list[str] = []
    now = [0.0]
    pace = VideoPace(VideoOptions(FILE), 1000, lines.append, clock=lambda: now[0])
    for each in [0.01] * 100 + [0.5] * 100:
        now[0] += each
        pace.count_drawn()
    assert "1000 frames about" in lines[0]


def test_suggestions_are_those_that_make_a_difference() -> None:
    small = VideoOptions(FILE, speed=0.5, size=(320, 240), fine=True)
    ((_, line),) = lines_of(5, 5.0, 15, small)
    assert line.endswith("quicker: --video-speed 2, no --video-fine")


def test_dropped_frames_are_reported_once() -> None:
    lines: list[str] = []
    pace = VideoPace(VideoOptions(FILE), None, lines.append)
    for _ in range(100):
        pace.count_dropped()
    assert lines == [
        "a.mp4: frames are dropped, since drawing is slower than time; quicker: --video-speed 4, --video-size 640x360"
    ]


@pytest.mark.parametrize(
    ("duration", "words"), [(99.4, "99 s"), (100.0, "2 min"), (5999.0, "100 min"), (7200.0, "2.0 h")]
)
def test_duration_has_fitting_unit(duration: float, words: str) -> None:
    assert duration_words(duration) == words
