import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from cellwright.rendering.picture import encode_png, save_png
from cellwright.util.errors import UsageError


def chunks_of(png: bytes) -> list[tuple[bytes, bytes]]:
    """Chunks of a PNG file, with every checksum verified."""
    assert png[:8] == bytes([137, 80, 78, 71, 13, 10, 26, 10])
    chunks, at = [], 8
    while at < len(png):
        (length,) = struct.unpack_from(">I", png, at)
        kind, content = png[at + 4 : at + 8], png[at + 8 : at + 8 + length]
        assert len(content) == length
        assert png[at + 8 + length : at + 12 + length] == struct.pack(">I", zlib.crc32(kind + content))
        chunks.append((kind, content))
        at += 12 + length
    return chunks


def decode(png: bytes) -> NDArray[np.uint8]:
    """Pixels of a PNG of 8-bit true colour, decoded as in the specification."""
    chunks = chunks_of(png)
    assert [kind for kind, _ in chunks] == [b"IHDR", b"sRGB", b"IDAT", b"IEND"]
    width, height, depth, colour, compression, filtering, interlace = struct.unpack(">IIBBBBB", chunks[0][1])
    assert (depth, colour, compression, filtering, interlace) == (8, 2, 0, 0, 0)
    assert chunks[3][1] == b""
    content = zlib.decompress(chunks[2][1])
    above, rows = bytes(3 * width), []
    for row in range(height):
        kind, line = content[row * (3 * width + 1)], content[row * (3 * width + 1) + 1 : (row + 1) * (3 * width + 1)]
        assert kind in (0, 2)
        above = line if kind == 0 else bytes((a + b) % 256 for a, b in zip(line, above, strict=True))
        rows.append(above)
    assert len(content) == height * (3 * width + 1)
    return np.frombuffer(b"".join(rows), np.uint8).reshape(height, width, 3)


shapes = st.tuples(st.integers(1, 12), st.integers(1, 12), st.just(3))


@given(arrays(np.uint8, shapes))
def test_png_decodes_to_same_picture(picture: NDArray[np.uint8]) -> None:
    before = picture.copy()
    assert np.array_equal(decode(encode_png(picture)), picture)
    assert np.array_equal(before, picture)


def test_png_of_strided_picture_is_correct() -> None:
    picture = np.arange(5 * 8 * 3, dtype=np.uint8).reshape(5, 8, 3)[::-2, ::2]
    assert np.array_equal(decode(encode_png(picture)), picture)


def test_png_of_smooth_picture_is_small() -> None:
    ramp = np.repeat(np.arange(256, dtype=np.uint8)[:, None, None], 256, axis=1).repeat(3, axis=2)
    assert len(encode_png(ramp)) < ramp.size / 100


@pytest.mark.parametrize(
    "picture",
    [np.zeros((2, 2, 3)), np.zeros((2, 2), np.uint8), np.zeros((2, 2, 4), np.uint8), np.zeros((0, 2, 3), np.uint8)],
)
def test_invalid_picture_array_is_refused(picture: NDArray[np.uint8]) -> None:
    with pytest.raises(UsageError, match="height, width, 3"):
        encode_png(picture)


def test_save_png_replaces_file(tmp_path: Path) -> None:
    path, picture = tmp_path / "cell.png", np.full((3, 4, 3), 7, np.uint8)
    for place in (path, str(path)):
        save_png(place, picture)
        assert np.array_equal(decode(path.read_bytes()), picture)


def test_unwritable_picture_is_reported_with_path(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"nowhere.*cell\.png.*No such file"):
        save_png(tmp_path / "nowhere" / "cell.png", np.zeros((1, 1, 3), np.uint8))
