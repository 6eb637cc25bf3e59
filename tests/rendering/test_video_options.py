"""Video options: invalid ones are refused before drawing."""

import math
import sys
from fractions import Fraction
from pathlib import Path

import pytest

from cellwright.rendering.video_options import VideoOptions, check_video_size, period_of
from cellwright.util.errors import UsageError


@pytest.mark.parametrize("size", [(0, 48), (15, 48), (65, 48), (64, 47), (64, 8192)])
def test_invalid_video_size_is_refused(size: tuple[int, int]) -> None:
    with pytest.raises(UsageError, match="must be an even number from 16 to 4096"):
        check_video_size(*size)


def test_video_without_its_package_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    assert VideoOptions(Path("run.mp4")).speed == 1.0
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(UsageError) as refused:
        VideoOptions(Path("run.mp4"))
    assert str(refused.value) == "video: PyAV is not installed; run: pip install 'cellwright[video]'"


def test_frame_period_follows_speed() -> None:
    assert period_of(1.0) == Fraction(1, 25)
    assert period_of(2.5) == Fraction(1, 10)
    for speed in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(UsageError, match="above 0"):
            period_of(speed)
