"""MCAP parser for untrusted files: layout record by record, messages of a chunk, and checksums.

Nothing that the file says of sizes is trusted: a record ends with the file at the latest, and what is too large to be
true is an error. The content of chunks is passed over, so that some hundred megabytes take a moment.
"""

import struct
import zlib
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from io import SEEK_END, BytesIO
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata

from cellwright.recording.format.format import MAGIC, Entry, RecordedTopic
from cellwright.util.errors import RecordingError, showable

LARGEST_CHUNK = 256 << 20
"""Bytes of a chunk at most, uncompressed."""

LARGEST_ATTACHMENT = 1 << 30
LARGEST_RECORD = 16 << 20
"""Bytes of any other record at most."""

MOST_CHUNKS = 10_000_000
LATEST = 4 * 10**18
"""Of times [ns], some 127 years: no run comes to a later one, and no bag can hold it."""

_MAX_NAME_LENGTH = 1000  # characters of the name of a topic or a type
_RECORD_HEAD = struct.Struct("<BQ")  # what a record is, and how long
_BAG = b"#ROSBAG V"  # what a bag of ROS 1 begins with
_CHUNK = struct.Struct("<QQQI")
_INDEX = struct.Struct("<HI")


@dataclass(slots=True)
class ChunkPlace:
    """A chunk in a file: times of its first and last message [ns], where its bytes are, and what they come to."""

    first: int
    last: int
    compression: str
    offset: int
    length: int
    size: int
    checksum: int
    is_cut: bool = False
    counts: dict[int, int] = field(default_factory=dict)
    """Messages by channel, as far as the file says."""


@dataclass
class Layout:
    """What a file holds and where."""

    topics: dict[int, RecordedTopic] = field(default_factory=dict)
    """Those of the channels whose messages are CDR, by number."""
    chunks: list[ChunkPlace] = field(default_factory=list)
    attachments: dict[str, tuple[int, int, int]] = field(default_factory=dict)
    """Place and length of each by name, and where that begins which its checksum is of; that follows at once."""
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    is_complete: bool = False
    """Whether the file was ended as it should be, not cut short."""
    data_end: int = 0
    """Place of the record that ends the data of such a file."""
    footer: int = 0
    """Place of the last record of such a file."""


class _Fields(ReadDataStream):
    """The fields of a record; one that ends too early is an error, and letters that are none are replaced."""

    def __init__(self, data: bytes) -> None:
        super().__init__(BytesIO(data))

    def read(self, length: int) -> bytes:
        data = self._stream.read(length)
        self._count += length
        if len(data) < length:
            raise RecordingError("a record ends in the middle")
        return data

    def read_prefixed_string(self) -> str:
        return self.read(self.read4()).decode(errors="replace")


def scan_file(file: BinaryIO) -> Layout:
    """What the file holds, up to its end or to where it was cut.

    Raises:
        RecordingError: it is no MCAP file, or damaged.
    """
    size = file.seek(0, SEEK_END)
    file.seek(0)
    begin = file.read(max(len(MAGIC), len(_BAG)))
    if begin.startswith(_BAG):
        raise RecordingError(
            "it is a bag of ROS 1, which rosbag plays; here it takes the MCAP file that --record run.mcap writes"
        )
    if not begin.startswith(MAGIC):
        raise RecordingError("it is no MCAP file")
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
            if len(layout.chunks) > MOST_CHUNKS:
                raise RecordingError(f"it has more than {MOST_CHUNKS} chunks")
        if length > size - place:
            break
        if opcode == Opcode.ATTACHMENT:
            _attachment(file, place, length, layout)
        elif opcode == Opcode.MESSAGE_INDEX:
            _count(file, length, layout)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA):
            if length > LARGEST_RECORD:
                raise RecordingError(f"a record of {length} bytes")
            _describe(opcode, _Fields(file.read(length)), layout, schemas)
        elif opcode == Opcode.DATA_END:
            layout.data_end = place - _RECORD_HEAD.size
        elif opcode == Opcode.FOOTER:
            layout.is_complete = True
            layout.footer = place - _RECORD_HEAD.size
            break
        place += length
    if layout.chunks and not layout.is_complete:
        layout.chunks[-1].counts.clear()  # its indexes may have been cut, and not every channel be among them
    layout.chunks.sort(key=lambda each: each.first)
    return layout


def _chunk(file: BinaryIO, place: int, length: int, size: int) -> ChunkPlace | None:
    """A chunk, whole or as far as it is there; None when not even its head is."""
    head = file.read(_CHUNK.size + 4)
    if len(head) < _CHUNK.size + 4:
        return None
    first, last, whole, checksum = _CHUNK.unpack_from(head)
    named = int.from_bytes(head[-4:], "little")
    if named > 16:
        raise RecordingError("a chunk says nothing sensible of how it was compressed")
    rest = file.read(named + 8)
    if len(rest) < named + 8:
        return None
    packed = int.from_bytes(rest[named:], "little")
    if max(first, last) > LATEST:
        raise RecordingError("a chunk says nothing sensible of its times")
    begin = place + _CHUNK.size + 4 + len(rest)
    if whole > LARGEST_CHUNK or packed > LARGEST_CHUNK or begin - place + packed != length:
        raise RecordingError("a chunk says nothing sensible of its size")
    there = min(packed, size - begin)
    compression = rest[:named].decode(errors="replace")
    return ChunkPlace(first, last, compression, begin, there, whole, checksum, is_cut=there < packed)


def _attachment(file: BinaryIO, place: int, length: int, layout: Layout) -> None:
    fields = _Fields(file.read(min(length, 1 << 16)))
    fields.read(16)  # its times
    name = fields.read_prefixed_string()
    fields.read_prefixed_string()  # its media type
    data = fields.read8()
    if data > LARGEST_ATTACHMENT or data + 4 > length:
        raise RecordingError(f"the attachment {name!r:.60} says nothing sensible of its size")
    layout.attachments[name] = place + length - 4 - data, data, place


def _count(file: BinaryIO, length: int, layout: Layout) -> None:
    """How many messages of a channel the newest chunk has."""
    head = file.read(_INDEX.size)
    if length >= _INDEX.size and len(head) == _INDEX.size and layout.chunks:
        channel, size = _INDEX.unpack(head)
        layout.chunks[-1].counts[channel] = size // 16


def _describe(opcode: int, fields: _Fields, layout: Layout, schemas: dict[int, str]) -> None:
    if opcode == Opcode.SCHEMA:
        number = fields.read2()
        schemas[number] = _shown_name(fields.read_prefixed_string())  # the rest is not needed, and may be damaged
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
    """A name that a terminal can show, whatever stands in the file."""
    return showable(name, _MAX_NAME_LENGTH).replace("\n", " ").replace("\t", " ")


_MESSAGE_HEAD = struct.Struct("<BQHIQQ")


def unpack_chunk(data: bytes, place: ChunkPlace) -> bytes:
    """The content of a chunk, from its bytes in the file; of one that was cut, what can be had of it.

    Raises:
        RecordingError: it is damaged, or compressed in a way that is not known.
    """
    match place.compression:
        case "":
            raw = data
        case "zstd":
            raw = _zstd(data, place)
        case unknown:
            raise RecordingError(f"a chunk is compressed by {unknown!r:.20}, which is not known here")
    if not place.is_cut and (len(raw) != place.size or (place.checksum and zlib.crc32(raw) != place.checksum)):
        raise RecordingError(f"damaged at byte {place.offset}: a chunk's checksum is wrong")
    return raw


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


def chunk_entries(raw: bytes, channels: Collection[int] | None = None) -> Iterator[Entry]:
    """The whole messages in the content of a chunk, in its order; those of some channels, or of all."""
    place, size = 0, len(raw)
    unpack_message, head = _MESSAGE_HEAD.unpack_from, _MESSAGE_HEAD.size
    while place + head <= size:
        opcode, length, channel, _, time, _ = unpack_message(raw, place)
        if opcode != Opcode.MESSAGE:
            length = _RECORD_HEAD.unpack_from(raw, place)[1]
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


_PIECE = 1 << 20
_DATA_END = _RECORD_HEAD.size + 4
_FOOTER = _RECORD_HEAD.size + 20


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
    for name, (place, length, begin) in layout.attachments.items():
        end = place + length
        if _checksum(file, begin, end - begin) != _read_number(file, end):
            raise RecordingError(f"damaged at byte {begin}: the checksum of the file {name!r:.60} within is wrong")
    if layout.is_complete:
        _verify_end(file, layout)


def _verify_end(file: BinaryIO, layout: Layout) -> None:
    """Compare the checksum of everything before the summary, and that of the summary."""
    end, footer = layout.data_end, layout.footer
    told = _read_number(file, end + _RECORD_HEAD.size)
    if told and _checksum(file, 0, end) != told:
        raise RecordingError(f"damaged before byte {end}: the checksum of all data is wrong")
    summary, checked = end + _DATA_END, footer + _FOOTER - 4
    told = _read_number(file, checked)
    if told and _checksum(file, summary, checked - summary) != told:
        raise RecordingError(f"damaged behind byte {summary}: the checksum of the summary is wrong")
    file.seek(footer + _FOOTER)
    if file.read(len(MAGIC) + 1) != MAGIC:
        raise RecordingError(f"damaged at byte {footer + _FOOTER}: it does not end as an MCAP file ends")


def _checksum(file: BinaryIO, begin: int, length: int) -> int:
    """CRC-32 of so many bytes of a file."""
    checksum = 0
    file.seek(begin)
    while length > 0 and (piece := file.read(min(length, _PIECE))):
        length -= len(piece)
        checksum = zlib.crc32(piece, checksum)
    return checksum


def _read_number(file: BinaryIO, place: int) -> int:
    file.seek(place)
    return int.from_bytes(file.read(4), "little")
