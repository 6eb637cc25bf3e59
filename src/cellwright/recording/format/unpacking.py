"""The messages in a chunk of an MCAP file, read as if somebody wished us ill."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Collection, Iterator

from mcap.opcode import Opcode

from cellwright.recording.format.format import Entry
from cellwright.recording.format.scan import LATEST, ChunkPlace
from cellwright.util.errors import RecordingError

_MESSAGE = struct.Struct("<BQHIQQ")
_HEAD = struct.Struct("<BQ")


def unpack(data: bytes, place: ChunkPlace) -> bytes:
    """The content of a chunk; of one that was cut, what can be had of it.

    Args:
        data: its bytes as they are in the file.
        place: what the file says of it.

    Raises:
        RecordingError: it is damaged, or compressed in a way that is not known.
    """
    raw = _decompressed(data, place)
    if not place.is_cut and (len(raw) != place.size or (place.checksum and zlib.crc32(raw) != place.checksum)):
        raise RecordingError(f"damaged at byte {place.offset}: a chunk's checksum is wrong")
    return raw


def _decompressed(data: bytes, place: ChunkPlace) -> bytes:
    match place.compression:
        case "":
            return data
        case "zstd":
            return _zstd(data, place)
    raise RecordingError(f"a chunk is compressed by {place.compression!r:.20}, which is not known here")


def _zstd(data: bytes, place: ChunkPlace) -> bytes:
    """Decompress piece by piece: what the data says of its own size is no measure of what it may take."""
    import zstandard  # not before something is read: the command line starts without it

    found = bytearray()
    reader = zstandard.ZstdDecompressor(max_window_size=1 << 27).stream_reader(data)
    try:
        while len(found) <= place.size and (piece := reader.read(1 << 18)):
            found += piece
    except (zstandard.ZstdError, MemoryError) as fault:
        if not place.is_cut:
            raise RecordingError(f"damaged at byte {place.offset}: {fault}") from None
    return bytes(found[: place.size + 1])


def entries(raw: bytes, channels: Collection[int] | None = None) -> Iterator[Entry]:
    """The whole messages in the content of a chunk, in its order; those of some channels, or of all."""
    place, size = 0, len(raw)
    unpack_message, head = _MESSAGE.unpack_from, _MESSAGE.size
    while place + head <= size:
        opcode, length, channel, _, time, _ = unpack_message(raw, place)
        if opcode != Opcode.MESSAGE:
            length = _HEAD.unpack_from(raw, place)[1]
        elif length < head - 9:
            raise RecordingError("a message is shorter than its own head")
        end = place + 9 + length
        if end > size:
            return
        if opcode == Opcode.MESSAGE and (channels is None or channel in channels):
            if time > LATEST:
                raise RecordingError(f"damaged: a message at {time} ns, which no run comes to")
            yield channel, time, raw[place + head : end]
        place = end
