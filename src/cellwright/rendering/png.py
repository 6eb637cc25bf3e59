"""Pictures as PNG bytes, with nothing but the standard library (PNG specification, third edition, W3C 2025)."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cellwright.util.atomic_file import write_whole
from cellwright.util.errors import UsageError

SIGNATURE = b"\x89PNG\r\n\x1a\n"
TRUE_COLOUR = 2
FILTER_UP = 2


def encode(picture: NDArray[np.uint8]) -> bytes:
    """The PNG file of a picture (height, width, 3) of 8 bits per channel, sRGB.

    Each row is stored as its difference to the row above (filter "up"), which suits smooth shading and costs one
    subtraction.

    Raises:
        UsageError: if the array is of another type or shape, or empty.
    """
    if picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] != 3 or picture.size == 0:
        raise UsageError(f"a picture is a (height, width, 3) array of uint8, not {picture.shape} of {picture.dtype}")
    height, width, _ = picture.shape
    rows = np.empty((height, 1 + 3 * width), np.uint8)
    rows[:, 0] = FILTER_UP
    rows[:, 1:] = picture.reshape(height, 3 * width)
    rows[1:, 1:] -= picture.reshape(height, 3 * width)[:-1]
    header = struct.pack(">IIBBBBB", width, height, 8, TRUE_COLOUR, 0, 0, 0)
    return (
        SIGNATURE
        + _chunk(b"IHDR", header)
        + _chunk(b"sRGB", b"\x00")
        + _chunk(b"IDAT", zlib.compress(rows.tobytes(), 6))
        + _chunk(b"IEND", b"")
    )


def save(path: str | Path, picture: NDArray[np.uint8]) -> None:
    """Write a picture to a PNG file, whole or not at all.

    Raises:
        UsageError: it cannot be written.
    """
    try:
        write_whole(Path(path), encode(picture))
    except OSError as error:
        raise UsageError(f"cannot write the picture {path}: {error.strerror or error}") from error


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
