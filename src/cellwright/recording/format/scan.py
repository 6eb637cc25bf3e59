"""MCAP parser for untrusted files: layout record by record, messages of a chunk, and checksums.

Sizes in the file are not trusted: a record ends with the file at the latest, and an implausible size is an error. The
content of chunks is skipped, so that some hundred megabytes take a moment.
"""

import struct
import zlib
from collections.abc import Collection, Generator
from dataclasses import dataclass, field
from io import SEEK_END, BytesIO
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata

from cellwright.recording.format.format import MAGIC, Entry, RecordedTopic
from cellwright.util.errors import RecordingError, printable
from cellwright.util.files import LFS_POINTER, is_lfs_pointer

MAX_CHUNK_SIZE = 256 << 20
"""Maximum uncompressed size of a chunk [bytes]."""

MAX_ATTACHMENT_SIZE = 1 << 30
MAX_RECORD_SIZE = 16 << 20
"""Maximum size of any other record [bytes]."""

MAX_CHUNKS = 10_000_000

MIN_UNPACKED, MAX_RATIO = 1 << 28, 1000
"""A file may unpack to 256 MiB, and 1000 bytes more for each of its own; recordings of a still scene have some 50."""

MIN_RECORDS = 1_000_000
"""A file may have a million records in its chunks, and one more for each of its bytes."""

LATEST = 4 * 10**18
"""Latest time [ns], some 127 years: no run reaches it, and no bag can hold a later one."""

_MAX_NAME_LENGTH = 1000  # characters of the name of a topic or a type
_RECORD_HEAD = struct.Struct("<BQ")  # opcode and length
_BAG = b"#ROSBAG V"  # first bytes of a ROS 1 bag
_BEGIN = 64  # bytes that tell what a file is, Git's pointer included
_CHUNK = struct.Struct("<QQQI")
_INDEX = struct.Struct("<HI")
_MESSAGE_HEAD = struct.Struct("<BQHIQQ")
_PIECE = 1 << 20
_DATA_END = _RECORD_HEAD.size + 4
_FOOTER = _RECORD_HEAD.size + 20


@dataclass(slots=True)
class ChunkPlace:
    """Chunk in a file: times of its first and last message [ns], its bytes, and their unpacked size and checksum."""

    first: int
    last: int
    compression: str
    offset: int
    length: int
    size: int
    checksum: int
    is_cut: bool = False
    counts: dict[int, int] = field(default_factory=dict)
    """Messages by channel, as far as the file gives them."""


@dataclass
class Layout:
    """Contents of a file, with their offsets."""

    topics: dict[int, RecordedTopic] = field(default_factory=dict)
    """Topics of the channels whose messages are CDR, by number."""
    chunks: list[ChunkPlace] = field(default_factory=list)
    attachments: dict[str, tuple[int, int, int]] = field(default_factory=dict)
    """By name: offset and length of the data, and offset of the bytes under its checksum, which follows the data."""
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    is_complete: bool = False
    """True if the file was ended properly, not truncated."""
    data_end: int = 0
    """Offset of the record that ends the data of a complete file."""
    footer: int = 0
    """Offset of the last record of a complete file."""
    max_records: int = MIN_RECORDS
    """Maximum number of records in all chunks together."""


class _Fields(ReadDataStream):
    """Fields of a record; raises an error where the record is too short, and replaces invalid characters."""

    def __init__(self, data: bytes) -> None:
        super().__init__(BytesIO(data))

    def read(self, length: int) -> bytes:
        data = self._stream.read(length)
        self._count += length
        if len(data) < length:
            raise RecordingError("damaged: a record ends early")
        return data

    def read_prefixed_string(self) -> str:
        return self.read(self.read4()).decode(errors="replace")


def scan_file(file: BinaryIO) -> Layout:
    """Read the layout of a file, up to its end or to where it was truncated.

    Raises:
        RecordingError: not an MCAP file, or damaged.
    """
    size = file.seek(0, SEEK_END)
    file.seek(0)
    begin = file.read(_BEGIN)
    if begin.startswith(_BAG):
        raise RecordingError("a ROS 1 bag; play it with rosbag, or give the MCAP file that --record run.mcap writes")
    if is_lfs_pointer(begin):
        raise RecordingError(LFS_POINTER)
    if not begin.startswith(MAGIC):
        raise RecordingError("not an MCAP file")
    layout, schemas = Layout(), dict[int, str]()
    place = len(MAGIC)
    while place < size:
        file.seek(place)
        head = file.read(_RECORD_HEAD.size)
        if len(head) < _RECORD_HEAD.size:
            break
        opcode, length = _RECORD_HEAD.unpack(head)
        place += _RECORD_HEAD.size
        if opcode == Opcode.CHUNK:
            chunk = _chunk(file, place, length, size)
            if chunk is not None:
                layout.chunks.append(chunk)
            if len(layout.chunks) > MAX_CHUNKS:
                raise RecordingError(f"too many chunks (at most {MAX_CHUNKS})")
        if length > size - place:
            break
        if opcode == Opcode.ATTACHMENT:
            _attachment(file, place, length, layout)
        elif opcode == Opcode.MESSAGE_INDEX:
            _count(file, length, layout)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA):
            if length > MAX_RECORD_SIZE:
                raise RecordingError(f"record too large (got {length} bytes, at most {MAX_RECORD_SIZE})")
            _describe(opcode, _Fields(file.read(length)), layout, schemas)
        elif opcode == Opcode.DATA_END:
            layout.data_end = place - _RECORD_HEAD.size
        elif opcode == Opcode.FOOTER:
            layout.is_complete = True
            layout.footer = place - _RECORD_HEAD.size
            break
        place += length
    if layout.chunks and not layout.is_complete:
        # its indexes may be truncated and lack channels
        layout.chunks[-1].counts.clear()
    # Some kilobytes can unpack to petabytes. Refused here, before a chunk is unpacked.
    if sum(each.size for each in layout.chunks) > MIN_UNPACKED + MAX_RATIO * size:
        raise RecordingError(f"unpacks to more than {MAX_RATIO} times its size; is this a recording?")
    layout.max_records = MIN_RECORDS + size
    layout.chunks.sort(key=lambda each: each.first)
    return layout


def _chunk(file: BinaryIO, place: int, length: int, size: int) -> ChunkPlace | None:
    """Read a chunk's head, also of a truncated chunk; None if not even the head is complete."""
    head = file.read(_CHUNK.size + 4)
    if len(head) < _CHUNK.size + 4:
        return None
    first, last, whole, checksum = _CHUNK.unpack_from(head)
    named = int.from_bytes(head[-4:], "little")
    if named > 16:
        raise RecordingError("damaged: invalid compression of a chunk")
    rest = file.read(named + 8)
    if len(rest) < named + 8:
        return None
    packed = int.from_bytes(rest[named:], "little")
    if max(first, last) > LATEST:
        raise RecordingError("damaged: invalid times of a chunk")
    begin = place + _CHUNK.size + 4 + len(rest)
    if whole > MAX_CHUNK_SIZE or packed > MAX_CHUNK_SIZE or begin - place + packed != length:
        raise RecordingError("damaged: invalid size of a chunk")
    there = min(packed, size - begin)
    compression = rest[:named].decode(errors="replace")
    return ChunkPlace(first, last, compression, begin, there, whole, checksum, is_cut=there < packed)


def _attachment(file: BinaryIO, place: int, length: int, layout: Layout) -> None:
    fields = _Fields(file.read(min(length, 1 << 16)))
    fields.read(16)  # its times
    name = fields.read_prefixed_string()
    fields.read_prefixed_string()  # its media type
    data = fields.read8()
    if data > MAX_ATTACHMENT_SIZE or data + 4 > length:
        raise RecordingError(f"damaged: invalid size of the attachment {name!r:.60}")
    layout.attachments[name] = place + length - 4 - data, data, place


def _count(file: BinaryIO, length: int, layout: Layout) -> None:
    """Note how many messages of a channel the newest chunk has."""
    head = file.read(_INDEX.size)
    if length >= _INDEX.size and len(head) == _INDEX.size and layout.chunks:
        channel, size = _INDEX.unpack(head)
        layout.chunks[-1].counts[channel] = size // 16


def _describe(opcode: int, fields: _Fields, layout: Layout, schemas: dict[int, str]) -> None:
    if opcode == Opcode.SCHEMA:
        number = fields.read2()
        # the rest is not needed, and may be damaged
        schemas[number] = _shown_name(fields.read_prefixed_string())
    elif opcode == Opcode.CHANNEL:
        channel = Channel.read(fields)
        layout.topics.pop(channel.id, None)
        if channel.message_encoding == "cdr":
            name, type_name = _shown_name(channel.topic), schemas.get(channel.schema_id, "")
            layout.topics[channel.id] = RecordedTopic.of(name, type_name, channel.metadata)
    else:
        metadata = Metadata.read(fields)
        layout.metadata.setdefault(metadata.name, metadata.metadata)


def _shown_name(name: str) -> str:
    """Return a name that a terminal can show, whatever the file contains."""
    return printable(name, _MAX_NAME_LENGTH).replace("\n", " ").replace("\t", " ")


def unpack_chunk(data: bytes, place: ChunkPlace) -> bytes:
    """Decompress a chunk; of a truncated one, as much as possible.

    Raises:
        RecordingError: it is damaged, or its compression is unknown.
    """
    match place.compression:
        case "":
            raw = data
        case "zstd":
            raw = _zstd(data, place)
        case unknown:
            raise RecordingError(f"unknown compression of a chunk (got {unknown!r:.20})")
    if not place.is_cut and (len(raw) != place.size or (place.checksum and zlib.crc32(raw) != place.checksum)):
        raise RecordingError(f"damaged at byte {place.offset}: wrong checksum of a chunk")
    return raw


def _zstd(data: bytes, place: ChunkPlace) -> bytes:
    """Decompress piece by piece: the size that the data gives for itself is not trusted."""
    # imported late: the command line starts without it
    import zstandard

    found = bytearray()
    reader = zstandard.ZstdDecompressor(max_window_size=1 << 27).stream_reader(data)
    try:
        # One piece more than the file admits to shows that its size was a lie.
        while len(found) <= place.size and (piece := reader.read(1 << 18)):
            found += piece
    except (zstandard.ZstdError, MemoryError) as fault:
        if not place.is_cut:
            raise RecordingError(f"damaged at byte {place.offset}: {fault}") from None
    return bytes(found[: place.size + 1])


def chunk_entries(
    raw: bytes, channels: Collection[int] | None = None, max_records: int = MIN_RECORDS
) -> Generator[Entry, None, int]:
    """Yield the complete messages in the content of a chunk, in order; of some channels, or of all.

    Returns:
        The number of records.

    Raises:
        RecordingError: the chunk is damaged, or has more than `max_records` records.
    """
    place, size, number = 0, len(raw), 0
    unpack_message, head = _MESSAGE_HEAD.unpack_from, _MESSAGE_HEAD.size
    while place + head <= size:
        number += 1
        if number > max_records:
            raise RecordingError("too many records for a file of this size; is this a recording?")
        opcode, length, channel, _, time, _ = unpack_message(raw, place)
        if opcode != Opcode.MESSAGE:
            length = _RECORD_HEAD.unpack_from(raw, place)[1]
        elif length < head - 9:
            raise RecordingError("damaged: a message is shorter than its header")
        end = place + 9 + length
        if end > size:
            break
        if opcode == Opcode.MESSAGE and (channels is None or channel in channels):
            if time > LATEST:
                raise RecordingError(f"damaged: a message has the time {time} ns, which no run reaches")
            yield channel, time, raw[place + head : end]
        place = end
    return number


def verify_checksums(file: BinaryIO, layout: Layout) -> None:
    """Compare all checksums with the bytes of the file.

    In a file that was ended properly, that covers every byte up to the last records. A truncated file has checksums of
    its complete chunks and of its attachments.

    Raises:
        RecordingError: some bytes are not what was written; the text says where.
    """
    for chunk in layout.chunks:
        if not chunk.is_cut:
            file.seek(chunk.offset)
            unpack_chunk(file.read(chunk.length), chunk)
    for name, (place, length, begin) in layout.attachments.items():
        end = place + length
        if _checksum(file, begin, end - begin) != _read_number(file, end):
            raise RecordingError(f"damaged at byte {begin}: wrong checksum of the attached file {name!r:.60}")
    if layout.is_complete:
        _verify_end(file, layout)


def _verify_end(file: BinaryIO, layout: Layout) -> None:
    """Compare the checksum of everything before the summary, and that of the summary."""
    end, footer = layout.data_end, layout.footer
    expected = _read_number(file, end + _RECORD_HEAD.size)
    if expected and _checksum(file, 0, end) != expected:
        raise RecordingError(f"damaged before byte {end}: wrong checksum of all data")
    summary, checked = end + _DATA_END, footer + _FOOTER - 4
    expected = _read_number(file, checked)
    if expected and _checksum(file, summary, checked - summary) != expected:
        raise RecordingError(f"damaged after byte {summary}: wrong checksum of the summary")
    file.seek(footer + _FOOTER)
    if file.read(len(MAGIC) + 1) != MAGIC:
        raise RecordingError(f"damaged at byte {footer + _FOOTER}: the end mark of an MCAP file is missing")


def _checksum(file: BinaryIO, begin: int, length: int) -> int:
    """Return the CRC-32 of `length` bytes of a file."""
    checksum = 0
    file.seek(begin)
    while length > 0 and (piece := file.read(min(length, _PIECE))):
        length -= len(piece)
        checksum = zlib.crc32(piece, checksum)
    return checksum


def _read_number(file: BinaryIO, place: int) -> int:
    file.seek(place)
    return int.from_bytes(file.read(4), "little")
