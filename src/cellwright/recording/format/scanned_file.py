"""Recording file: its layout, chunks unpacked on demand, and verification of all its checksums."""

from __future__ import annotations

import os
import zlib
from bisect import bisect_left
from collections import OrderedDict
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from cellwright.recording.format.format import MAGIC, METADATA, Entry
from cellwright.recording.format.scan import RECORD_HEAD, ChunkPlace, Layout, chunk_entries, scan_file, unpack_chunk
from cellwright.util.errors import RecordingError
from cellwright.util.files import open_to_read

_PIECE = 1 << 20
_DATA_END = RECORD_HEAD.size + 4
_FOOTER = RECORD_HEAD.size + 20


def verify_checksums(file: BinaryIO, layout: Layout) -> None:
    """Compare all checksums that the file has with its bytes.

    Of a file that was ended as it should be that is every byte up to the last records. One that was cut short has
    checksums of its whole chunks and of the files within.

    Raises:
        RecordingError: some are not what was written; the text says where.
    """
    for chunk in layout.chunks:
        if not chunk.is_cut:
            file.seek(chunk.offset)
            unpack_chunk(file.read(chunk.length), chunk)
    for name, (begin, length) in layout.checked.items():
        file.seek(begin + length)
        if _crc_of(file, begin, length) != _read_number(file, begin + length):
            raise RecordingError(f"damaged at byte {begin}: the checksum of the file {name!r:.60} within is wrong")
    if layout.is_complete:
        _check_end(file, layout)


def _check_end(file: BinaryIO, layout: Layout) -> None:
    """Compare the checksum of everything before the summary, and that of the summary."""
    end = layout.data_end
    told = _read_number(file, end + RECORD_HEAD.size)
    if told and _crc_of(file, 0, end) != told:
        raise RecordingError(f"damaged before byte {end}: the checksum of all data is wrong")
    summary, footer = end + _DATA_END, layout.footer
    told = _read_number(file, footer + _FOOTER - 4)
    if told and _crc_of(file, summary, footer + _FOOTER - 4 - summary) != told:
        raise RecordingError(f"damaged behind byte {summary}: the checksum of the summary is wrong")
    file.seek(footer + _FOOTER)
    if file.read(len(MAGIC) + 1) != MAGIC:
        raise RecordingError(f"damaged at byte {footer + _FOOTER}: it does not end as an MCAP file ends")


def _crc_of(file: BinaryIO, begin: int, length: int) -> int:
    checksum = 0
    for piece in _pieces(file, begin, length):
        checksum = zlib.crc32(piece, checksum)
    return checksum


def _pieces(file: BinaryIO, begin: int, length: int) -> Iterator[bytes]:
    file.seek(begin, os.SEEK_SET)
    while length > 0 and (piece := file.read(min(length, _PIECE))):
        length -= len(piece)
        yield piece


def _read_number(file: BinaryIO, place: int) -> int:
    file.seek(place)
    return int.from_bytes(file.read(4), "little")


_KEPT = 8  # chunks that are kept unpacked, for those who look around in one place


@contextmanager
def named_errors(path: Path) -> Iterator[None]:
    """Raise errors of reading a file as RecordingError that begins with its path."""
    try:
        yield
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from None
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror or error}") from None


class ScannedFile:
    """A recording's file, open for reading.

    Args:
        path: the file.

    Attributes:
        path: the file.
        layout: what is in it, and where.

    Raises:
        RecordingError: it cannot be read, or is no recording of Cellwright.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        with named_errors(path):
            self._file = open_to_read(path)
            try:
                self.layout = self._scanned()
            except BaseException:
                self._file.close()
                raise
        self._kept: OrderedDict[int, bytes] = OrderedDict()

    def close(self) -> None:
        """Read no more."""
        self._file.close()

    def chunks(self, start: int | None, until: int | None) -> Iterator[ChunkPlace]:
        """The chunks that may hold messages from `start` [ns] on and before `until` [ns]; None: no bound."""
        chunks = self.layout.chunks
        first = 0 if start is None else bisect_left(chunks, start, key=lambda each: each.last)
        for chunk in chunks[first:]:
            if until is not None and chunk.first >= until:
                return
            yield chunk

    def entries(self, chunk: ChunkPlace, channels: Collection[int]) -> Iterator[Entry]:
        """The messages of some channels in a chunk.

        Raises:
            RecordingError: the file is damaged.
        """
        with named_errors(self.path):
            yield from chunk_entries(self._content(chunk), channels)

    def read(self, offset: int, length: int) -> bytes:
        """Bytes of the file.

        Raises:
            RecordingError: it cannot be read any more.
        """
        with named_errors(self.path):
            return self._read(offset, length)

    def check_bytes(self) -> None:
        """Compare the checksums of the whole file with its bytes.

        Raises:
            RecordingError: it is damaged; the text says where.
        """
        with named_errors(self.path):
            verify_checksums(self._file, self.layout)

    def _scanned(self) -> Layout:
        layout = scan_file(self._file, self._file.seek(0, 2))
        if METADATA not in layout.metadata:
            raise RecordingError("is an MCAP file, but no recording of Cellwright")
        return layout

    def _read(self, offset: int, length: int) -> bytes:
        try:
            self._file.seek(offset)
            data = self._file.read(length)
        except ValueError as error:  # it was closed
            raise RecordingError(f"cannot be read: {error}") from None
        if len(data) < length:
            raise RecordingError("has become shorter while it was read")
        return data

    def _content(self, chunk: ChunkPlace) -> bytes:
        found = self._kept.get(chunk.offset)
        if found is None:
            found = self._kept[chunk.offset] = unpack_chunk(self._read(chunk.offset, chunk.length), chunk)
            if len(self._kept) > _KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(chunk.offset)
        return found
