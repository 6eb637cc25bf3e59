"""The bytes of a recording: its file, the layout that a scan found in it, and chunks, unpacked as they are needed."""

from __future__ import annotations

from bisect import bisect_left
from collections import OrderedDict
from collections.abc import Collection, Iterator
from pathlib import Path

from cellwright.recording.format.format import METADATA, Entry
from cellwright.recording.format.scan import ChunkPlace, Layout, scan
from cellwright.recording.format.soundness import check_bytes
from cellwright.recording.format.unpacking import entries, unpack
from cellwright.util.atomic_file import open_to_read
from cellwright.util.errors import RecordingError

_KEPT = 8  # chunks that are kept unpacked, for those who look around in one place


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
        try:
            self._file = open_to_read(path)
        except OSError as error:
            raise RecordingError(f"{path}: cannot be read: {error.strerror or error}") from None
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
        try:
            yield from entries(self._content(chunk), channels)
        except RecordingError as error:
            raise RecordingError(f"{self.path}: {error}") from None

    def read(self, offset: int, length: int) -> bytes:
        """Bytes of the file.

        Raises:
            RecordingError: it cannot be read any more.
        """
        try:
            self._file.seek(offset)
            data = self._file.read(length)
        except (OSError, ValueError) as error:
            raise RecordingError(f"{self.path}: cannot be read: {error}") from None
        if len(data) < length:
            raise RecordingError(f"{self.path}: has become shorter while it was read")
        return data

    def check_bytes(self) -> None:
        """Compare the checksums of the whole file with its bytes.

        Raises:
            RecordingError: it is damaged; the text says where.
        """
        try:
            check_bytes(self._file, self.layout)
        except RecordingError as error:
            raise RecordingError(f"{self.path}: {error}") from None
        except OSError as error:
            raise RecordingError(f"{self.path}: cannot be read: {error.strerror or error}") from None

    def _scanned(self) -> Layout:
        try:
            size = self._file.seek(0, 2)
            layout = scan(self._file, size)
        except RecordingError as error:
            raise RecordingError(f"{self.path}: {error}") from None
        except OSError as error:
            raise RecordingError(f"{self.path}: cannot be read: {error.strerror or error}") from None
        if METADATA not in layout.metadata:
            raise RecordingError(f"{self.path}: is an MCAP file, but no recording of Cellwright")
        return layout

    def _content(self, chunk: ChunkPlace) -> bytes:
        found = self._kept.get(chunk.offset)
        if found is None:
            found = self._kept[chunk.offset] = unpack(self.read(chunk.offset, chunk.length), chunk)
            if len(self._kept) > _KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(chunk.offset)
        return found
