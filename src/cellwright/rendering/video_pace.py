"""Pace of a video: from its first frames, how long the whole takes and what makes it quicker; then its progress."""

import math
import time
from collections.abc import Callable

from cellwright.rendering.video_options import RATE, SIZE, VideoOptions

SLOW = 60.0
"""Estimated wall time [s] from which a video is slow, so that its estimate and progress are reported."""

_FIRST, _FIRST_TIME = 4, 2.0  # frames and wall time [s] that an estimate needs
_PERIOD = 30.0  # [s] of wall time between two lines of progress
_QUICK_WIDTH, _QUICK_HEIGHT, _QUICK_SPEED = 640, 360, 4
_MAX_DROPPED = 25  # frames


class VideoPace:
    """Estimate and progress of a video.

    Args:
        options: file, size and speed of the video.
        frames: number of frames, or an upper bound; None if no end is known.
        report: receives lines for people.
        is_bound: `frames` is an upper bound.
        clock: source of wall time [s].

    Example:
        >>> from pathlib import Path
        >>> ticks = iter([0.0, 1.0, 2.0, 3.0])
        >>> pace = VideoPace(VideoOptions(Path("a.mp4")), 500, print, clock=lambda: next(ticks))
        >>> for _ in range(4):
        ...     pace.count_drawn()
        a.mp4: a frame takes 1.00 s, 500 frames about 8 min; quicker: --video-speed 4, --video-size 640x360
    """

    def __init__(
        self,
        options: VideoOptions,
        frames: int | None,
        report: Callable[[str], None],
        *,
        is_bound: bool = False,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._options, self._frames, self._report, self._clock = options, frames, report, clock
        self._bound = "at most " * is_bound
        self._begin = self._next = 0.0
        self._drawn = self._dropped = 0
        self._is_slow = False

    def count_drawn(self) -> None:
        """Count a frame that was drawn; report the estimate once it is known, and the progress from time to time."""
        now = self._clock()
        self._drawn += 1
        # The time before it is that of the start.
        if self._drawn == 1:
            self._begin = now
        if self._drawn < _FIRST or now < max(self._begin + _FIRST_TIME, self._next):
            return
        each = (now - self._begin) / (self._drawn - 1)
        if not self._is_slow:
            self._is_slow = self._takes(each) >= SLOW
            self._next = now + (_PERIOD if self._is_slow else _FIRST_TIME)
            if self._is_slow:
                self._report(f"{self._options.file}: {self._estimate(each)}; quicker: {self._quicker()}")
        elif self._frames is not None:
            self._next = now + _PERIOD
            left = duration_words(each * max(0, self._frames - self._drawn))
            frames = f"{self._drawn} of {self._bound}{self._frames} frames"
            self._report(f"{self._options.file}: {frames} drawn, {self._bound}about {left} to go")

    def count_dropped(self) -> None:
        """Count a frame that was dropped since drawing is slower than time; report a second of them, once."""
        self._dropped += 1
        if self._dropped == _MAX_DROPPED:
            reason = "frames are dropped, since drawing is slower than time"
            self._report(f"{self._options.file}: {reason}; quicker: {self._quicker()}")

    def _takes(self, each: float) -> float:
        """Return the wall time of the whole [s]; if no end is known, of a simulated minute."""
        frames = float(60 * RATE) / self._options.speed if self._frames is None else self._frames
        return each * frames

    def _estimate(self, each: float) -> str:
        whole = duration_words(self._takes(each))
        frame = f"a frame takes {each:.2f} s"
        if self._frames is None:
            return f"{frame}, a simulated minute about {whole}"
        return f"{frame}, {self._bound}{self._frames} frames about {whole}"

    def _quicker(self) -> str:
        options = self._options
        ways = [f"--video-speed {_QUICK_SPEED * options.speed:g}"]
        if math.prod(options.size or SIZE) > _QUICK_WIDTH * _QUICK_HEIGHT:
            ways.append(f"--video-size {_QUICK_WIDTH}x{_QUICK_HEIGHT}")
        if options.fine:
            ways.append("no --video-fine")
        return ", ".join(ways)


def duration_words(duration: float) -> str:
    """Return a duration [s] in words, such as `8 min`."""
    if duration < 100.0:
        return f"{duration:.0f} s"
    return f"{duration / 60.0:.0f} min" if duration < 6000.0 else f"{duration / 3600.0:.1f} h"
