"""What a picture shows, told by its content: never pixel against pixel.

A page is drawn by whatever draws in a browser, and looks a little different from one machine to the next. What does not
change: that there is something, the colours of known things, and where they roughly stand.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Pixels = NDArray[np.uint8]
"""(height, width, 3), sRGB."""


@dataclass(frozen=True)
class Hues:
    """A range of colours.

    Attributes:
        centre: of the hues [degrees]: red 0, green 120, blue 240.
        width: how far from it a hue may lie [degrees].
        saturation: the least; grey has 0.
        value: the least brightness 0..1.
    """

    centre: float
    width: float = 25.0
    saturation: float = 0.3
    value: float = 0.15


def pixels(png: bytes | Path) -> Pixels:
    """A picture as an array."""
    with Image.open(io.BytesIO(png) if isinstance(png, bytes) else png) as picture:
        return np.asarray(picture.convert("RGB"))


def variety(picture: Pixels) -> int:
    """How many clearly different colours there are, each on a thousandth of the picture: an empty page has 1."""
    coarse = (picture >> 4).reshape(-1, 3).astype(np.int32)
    _, counts = np.unique(coarse @ np.array([256, 16, 1]), return_counts=True)
    return int((counts >= coarse.shape[0] / 1000).sum())


def of_hue(picture: Pixels, hues: Hues) -> NDArray[np.bool_]:
    """Which pixels have a colour of this range."""
    rgb = picture.astype(np.float32) / 255.0
    high, low = rgb.max(axis=-1), rgb.min(axis=-1)
    spread = high - low
    red, green, blue = np.moveaxis(rgb, -1, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        hue = np.select(
            [high == red, high == green],
            [(green - blue) / spread, 2.0 + (blue - red) / spread],
            4.0 + (red - green) / spread,
        )
        saturation = np.where(high > 0.0, spread / high, 0.0)
    far = np.abs((hue * 60.0 - hues.centre + 180.0) % 360.0 - 180.0)
    found: NDArray[np.bool_] = (
        (spread > 0) & (far <= hues.width) & (saturation >= hues.saturation) & (high >= hues.value)
    )
    return found


def share(picture: Pixels, hues: Hues) -> float:
    """The share of the picture in colours of this range, 0..1."""
    return float(of_hue(picture, hues).mean())


def middle(picture: Pixels, hues: Hues) -> tuple[float, float]:
    """Where colours of this range lie: the median of their places across and down, 0..1; nan where there are none."""
    rows, columns = np.nonzero(of_hue(picture, hues))
    if not len(rows):
        return float("nan"), float("nan")
    return float(np.median(columns)) / picture.shape[1], float(np.median(rows)) / picture.shape[0]


def change(before: Pixels, after: Pixels, least: int = 24) -> float:
    """The share of the picture, 0..1, that has clearly changed: by more than `least` of 255 in one of its colours."""
    return float((np.abs(before.astype(np.int16) - after.astype(np.int16)).max(axis=-1) > least).mean())


def distance(one: Pixels, other: Pixels) -> float:
    """How far the colours of two pictures are apart, wherever they lie: 0 the same shares of each, 1 none in common."""
    return 0.5 * float(np.abs(_shares(one) - _shares(other)).sum())


def _shares(picture: Pixels) -> NDArray[np.float64]:
    """Shares of 6 x 6 x 6 colours."""
    coarse = (picture.astype(np.int32) * 6 // 256).reshape(-1, 3) @ np.array([36, 6, 1])
    return np.bincount(coarse, minlength=216) / len(coarse)
