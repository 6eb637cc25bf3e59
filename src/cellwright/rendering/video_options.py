"""Video options: file, camera, speed and size, checked before anything is drawn."""

import importlib.util
import math
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from cellwright.rendering.picture import MAX_SIDE
from cellwright.rendering.views import Viewpoint
from cellwright.util.errors import UsageError

SIZE = WIDTH, HEIGHT = 1280, 720
"""Default size of a video, in pixels, where it can be drawn about as fast as it plays."""
RATE = Fraction(25)
"""Frames per second of the video."""

_MIN_SIDE = 16


@dataclass(frozen=True)
class VideoOptions:
    """Options of a video.

    Attributes:
        file: MP4; overwritten.
        camera: the camera, or the name of a view of the cell; None for its overview, or for the whole robot.
        speed: simulated seconds per second of the video.
        size: width and height [pixels], even; None for the largest up to 1280x720 that is drawn about as fast as the
            video plays (see `video_size`).
        fine: smoother edges, which take half as long again without a GPU.

    Raises:
        UsageError: the extra `video`, whose package writes the file, is not installed.
    """

    file: Path
    camera: Viewpoint | None = None
    speed: float = 1.0
    size: tuple[int, int] | None = None
    fine: bool = False

    def __post_init__(self) -> None:
        if importlib.util.find_spec("av") is None:
            raise UsageError("video: PyAV is not installed; run: pip install 'cellwright[video]'")


def check_video_size(width: int, height: int) -> None:
    """Raise UsageError for a size that no video can have."""
    for name, value in (("width", width), ("height", height)):
        if not _MIN_SIDE <= value <= MAX_SIDE or value % 2:
            raise UsageError(f"video {name} must be an even number from {_MIN_SIDE} to {MAX_SIDE} (got {value})")


def period_of(speed: float) -> Fraction:
    """Return the simulation time [s] between two frames.

    Raises:
        UsageError: `speed` is not positive and finite.
    """
    if not (math.isfinite(speed) and speed > 0):
        raise UsageError(f"video speed must be above 0 (got {speed:g})")
    return Fraction(str(speed)) / RATE
