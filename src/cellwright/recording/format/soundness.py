"""Whether the bytes of a recording are those that were written: all of them, not only those that somebody reads."""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator
from typing import BinaryIO

from cellwright.recording.format.format import MAGIC
from cellwright.recording.format.scan import HEAD, Layout
from cellwright.recording.format.unpacking import unpack
from cellwright.util.errors import RecordingError

_PIECE = 1 << 20
_DATA_END = HEAD.size + 4
_FOOTER = HEAD.size + 20


def check_bytes(file: BinaryIO, layout: Layout) -> None:
    """Compare all checksums that the file has with its bytes.

    Of a file that was ended as it should be that is every byte up to the last records. One that was cut short has
    checksums of its whole chunks and of the files within.

    Raises:
        RecordingError: some are not what was written; the text says where.
    """
    for chunk in layout.chunks:
        if not chunk.is_cut:
            file.seek(chunk.offset)
            unpack(file.read(chunk.length), chunk)
    for name, (begin, length) in layout.checked.items():
        file.seek(begin + length)
        if _of(file, begin, length) != _number(file, begin + length):
            raise RecordingError(f"damaged at byte {begin}: the checksum of the file {name!r:.60} within is wrong")
    if layout.is_complete:
        _check_end(file, layout)


def _check_end(file: BinaryIO, layout: Layout) -> None:
    """Compare the checksum of everything before the summary, and that of the summary."""
    end = layout.data_end
    told = _number(file, end + HEAD.size)
    if told and _of(file, 0, end) != told:
        raise RecordingError(f"damaged before byte {end}: the checksum of all data is wrong")
    summary, footer = end + _DATA_END, layout.footer
    told = _number(file, footer + _FOOTER - 4)
    if told and _of(file, summary, footer + _FOOTER - 4 - summary) != told:
        raise RecordingError(f"damaged behind byte {summary}: the checksum of the summary is wrong")
    file.seek(footer + _FOOTER)
    if file.read(len(MAGIC) + 1) != MAGIC:
        raise RecordingError(f"damaged at byte {footer + _FOOTER}: it does not end as an MCAP file ends")


def _of(file: BinaryIO, begin: int, length: int) -> int:
    checksum = 0
    for piece in _pieces(file, begin, length):
        checksum = zlib.crc32(piece, checksum)
    return checksum


def _pieces(file: BinaryIO, begin: int, length: int) -> Iterator[bytes]:
    file.seek(begin, os.SEEK_SET)
    while length > 0 and (piece := file.read(min(length, _PIECE))):
        length -= len(piece)
        yield piece


def _number(file: BinaryIO, place: int) -> int:
    file.seek(place)
    return int.from_bytes(file.read(4), "little")
