"""Checks of a picture by its content: never pixel by pixel.

A page looks a little different from one browser and machine to the next. Some things do not change: that there is
something, the colours of known things, and their rough positions.
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
    """Range of colours.

    Attributes:
        centre: hue [degrees]: red 0, green 120, blue 240.
        width: largest distance of a hue from it [degrees].
        saturation: minimum; grey has 0.
        value: minimum brightness 0..1.
    """

    centre: float
    width: float = 25.0
    saturation: float = 0.3
    value: float = 0.15


def pixels(png: bytes | Path) -> Pixels:
    """Decode a picture."""
    with Image.open(io.BytesIO(png) if isinstance(png, bytes) else png) as picture:
        return np.asarray(picture.convert("RGB"))


def variety(picture: Pixels) -> int:
    """Count of clearly different colours, each on a thousandth of the picture: an empty page has 1."""
    coarse = (picture >> 4).reshape(-1, 3).astype(np.int32)
    _, counts = np.unique(coarse @ np.array([256, 16, 1]), return_counts=True)
    return int((counts >= coarse.shape[0] / 1000).sum())


def of_hue(picture: Pixels, hues: Hues) -> NDArray[np.bool_]:
    """Mask of the pixels in this range of colours."""
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
    """Share of the picture in this range of colours, 0..1."""
    return float(of_hue(picture, hues).mean())


def middle(picture: Pixels, hues: Hues) -> tuple[float, float]:
    """Centre of this range of colours: the median across and down, 0..1; nan if there are none."""
    rows, columns = np.nonzero(of_hue(picture, hues))
    if not len(rows):
        return float("nan"), float("nan")
    return float(np.median(columns)) / picture.shape[1], float(np.median(rows)) / picture.shape[0]


def change(before: Pixels, after: Pixels, threshold: int = 24) -> float:
    """Share of the picture, 0..1, that differs clearly: by more than `threshold` of 255 in one channel."""
    return float((np.abs(before.astype(np.int16) - after.astype(np.int16)).max(axis=-1) > threshold).mean())


def distance(one: Pixels, other: Pixels) -> float:
    """Distance between the colours of two pictures, regardless of position: 0 same shares of each, 1 none in common."""
    return 0.5 * float(np.abs(_shares(one) - _shares(other)).sum())


def _shares(picture: Pixels) -> NDArray[np.float64]:
    """Shares of 6 x 6 x 6 colours."""
    coarse = (picture.astype(np.int32) * 6 // 256).reshape(-1, 3) @ np.array([36, 6, 1])
    return np.bincount(coarse, minlength=216) / len(coarse)
