"""Line of text in the lower left corner of a picture."""

import warnings
from functools import lru_cache
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.ft2font import FT2Font
from numpy.typing import NDArray

_FONT = "fonts/ttf/DejaVuSans.ttf"
_SHARE = 1 / 40  # of the picture's height
_SMALLEST = 9  # [pixels]
_MARGIN = 0.8  # in letter sizes
_BEHIND, _INK = np.array((22.0, 26.0, 30.0)), np.array((244.0, 246.0, 247.0))
_DIMNESS = 0.62


def write_line(picture: NDArray[np.uint8], text: str) -> None:
    """Write a line into a picture (height, width, 3), in place; clip text that does not fit."""
    height, width, _ = picture.shape
    size = max(_SMALLEST, round(height * _SHARE))
    ink = _ink(text, size)
    margin = round(_MARGIN * size)
    line = round(1.9 * size)
    right = min(width, ink.shape[1] + 3 * margin)
    top = max(0, height - line - margin)
    box = picture[top : height - margin, margin:right].astype(np.float64)
    if not box.size:
        return
    box += (_BEHIND - box) * _DIMNESS
    down = max(0, (line - ink.shape[0]) // 2)
    ink = ink[: max(0, box.shape[0] - down), : max(0, box.shape[1] - margin)]
    at = (slice(down, down + ink.shape[0]), slice(margin, margin + ink.shape[1]))
    box[at] += (_INK - box[at]) * (ink[:, :, None] / 255.0)
    picture[top : height - margin, margin:right] = box.round().astype(np.uint8)


@lru_cache(maxsize=16)
def _ink(text: str, size: int) -> NDArray[np.uint8]:
    """Coverage of each pixel by letters (rows, columns), 0..255; all lines of text have the same rows."""
    font = _font(size)
    with warnings.catch_warnings():
        # Letters missing from the font become boxes.
        warnings.simplefilter("ignore")
        font.set_text(f"{text}\u2009|jÅ", 0.0)  # the tallest letters at its end, clipped below
        font.draw_glyphs_to_bitmap(antialiased=True)
        image = np.asarray(font.get_image()).copy()
        font.set_text(text or " ", 0.0)
        columns = int(font.get_width_height()[0] / 64) + 2
    return image[:, : min(columns, image.shape[1])].astype(np.uint8)


@lru_cache(maxsize=4)
def _font(size: int) -> FT2Font:
    font = FT2Font(str(Path(matplotlib.get_data_path()) / _FONT))
    font.set_size(size, 72)
    return font
