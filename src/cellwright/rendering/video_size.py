"""Size of a video for which none was given: the largest that this machine draws about as fast as the video plays."""

import time
from collections.abc import Callable
from dataclasses import dataclass

from cellwright.rendering.video_options import RATE, SIZE

LONGEST = 1.25 / float(RATE)
"""Longest wall time [s] of a frame of such a video, unless the smallest takes longer. A fifth above the time that it is
shown, so that measuring on a busy machine seldom makes a difference."""


@dataclass(frozen=True)
class FrameQuality:
    """Quality of the frames of a video.

    Attributes:
        size: width and height [pixels].
        samples: along each side of a pixel.
    """

    size: tuple[int, int]
    samples: int


@dataclass(frozen=True)
class ChosenQuality:
    """Quality that was chosen; `reason` says why, for people, and is empty for the default."""

    quality: FrameQuality
    reason: str


QUALITIES = (
    FrameQuality(SIZE, 2),
    FrameQuality((960, 540), 1),
    FrameQuality((640, 360), 1),
    FrameQuality((480, 270), 1),
)
"""Qualities to try, in order. Without a GPU samples take the time of a frame, so small ones have one a pixel."""


def choose_quality(
    draw: Callable[[FrameQuality], object], *, samples: int = 0, clock: Callable[[], float] = time.perf_counter
) -> ChosenQuality:
    """Choose by drawing frames: the first of `QUALITIES` that takes no longer than `LONGEST`, else the last.

    Args:
        draw: draws a frame.
        samples: samples of all of them, if they were requested; 0 for their own.
        clock: source of wall time [s].

    Example:
        >>> ticks = iter([0.0, 0.9, 1.0, 1.2, 2.0, 2.1, 3.0, 3.03])
        >>> choose_quality(lambda _quality: None, clock=lambda: next(ticks)).reason
        '960x540, since a frame of 1280x720 takes 0.20 s here'
    """
    first, quality = 0.0, QUALITIES[0]
    for each in QUALITIES:
        quality = FrameQuality(each.size, samples or each.samples)
        took = min(_time_of(draw, quality, clock) for _ in range(2))  # the first of a size takes longer
        first = first or took
        if took <= LONGEST:
            break
    if quality.size == SIZE:
        return ChosenQuality(quality, "")
    return ChosenQuality(
        quality, f"{_words(quality)}, since a frame of {_words(QUALITIES[0])} takes {first:.2f} s here"
    )


def smallest_quality(reason: str) -> ChosenQuality:
    """Return the last of `QUALITIES`, for a machine on which trying would take long itself."""
    return ChosenQuality(QUALITIES[-1], f"{_words(QUALITIES[-1])}, since {reason}")


def _time_of(draw: Callable[[FrameQuality], object], quality: FrameQuality, clock: Callable[[], float]) -> float:
    begin = clock()
    draw(quality)
    return clock() - begin


def _words(quality: FrameQuality) -> str:
    return "{}x{}".format(*quality.size)
