"""MCAP parser for untrusted files: layout record by record, and the messages of a chunk.

Nothing that the file says of sizes is trusted: a record ends with the file at the latest, and what is too large to be
true is an error. The content of chunks is passed over, so that some hundred megabytes take a moment.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from typing import BinaryIO

from mcap.opcode import Opcode

from cellwright.recording.format.format import MAGIC, Entry
from cellwright.util.errors import RecordingError, showable

LARGEST_CHUNK = 256 << 20
"""Bytes of a chunk at most, uncompressed."""

LARGEST_ATTACHMENT = 1 << 30
LARGEST_RECORD = 16 << 20
"""Bytes of any other record at most."""

MOST_CHUNKS = 10_000_000
LATEST = 4 * 10**18
"""Of times [ns], some 127 years: no run comes to a later one, and no bag can hold it."""

LONGEST_NAME = 1000
"""Characters of the name of a topic or a type; of a longer one some are left out."""

RECORD_HEAD = struct.Struct("<BQ")
"""What each record begins with: what it is, and how long."""

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


@dataclass(frozen=True, slots=True)
class ChannelRecord:
    """A channel as the file has it."""

    topic: str
    encoding: str
    type: str
    metadata: dict[str, str]


@dataclass
class Layout:
    """What a file holds and where."""

    profile: str = ""
    channels: dict[int, ChannelRecord] = field(default_factory=dict)
    chunks: list[ChunkPlace] = field(default_factory=list)
    attachments: dict[str, tuple[int, int]] = field(default_factory=dict)
    """Place and length of each, by name."""
    checked: dict[str, tuple[int, int]] = field(default_factory=dict)
    """Place and length of what the checksum of each attachment is of, which follows at once; by name."""
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    is_complete: bool = False
    """Whether the file was ended as it should be, not cut short."""
    data_end: int = 0
    """Place of the record that ends the data of such a file."""
    footer: int = 0
    """Place of the last record of such a file."""


class Fields:
    """Reads the fields of a record one after another.

    Raises:
        RecordingError: the record ends before, from all that read.
    """

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    @property
    def is_over(self) -> bool:
        """Whether everything has been read."""
        return self._at >= len(self._data)

    def number(self, size: int) -> int:
        """An unsigned number of so many bytes."""
        return int.from_bytes(self.take(size), "little")

    def text(self) -> str:
        """A text, its length before it."""
        return self.take(self.number(4)).decode(errors="replace")

    def name(self) -> str:
        """A text that is told to people: whatever stands there, a terminal can show it."""
        return showable(self.text(), LONGEST_NAME).replace("\n", " ").replace("\t", " ")

    def table(self) -> dict[str, str]:
        """Texts by texts."""
        inner = Fields(self.take(self.number(4)))
        found = {}
        while not inner.is_over:
            key = inner.text()
            found[key] = inner.text()
        return found

    def take(self, size: int) -> bytes:
        """So many bytes."""
        data = self._data[self._at : self._at + size]
        if len(data) < size:
            raise RecordingError("a record ends in the middle")
        self._at += size
        return data


def scan_file(file: BinaryIO, size: int) -> Layout:
    """What the file holds, up to its end or to where it was cut.

    Args:
        file: the file.
        size: how many bytes of it there are.

    Raises:
        RecordingError: it is no MCAP file, or damaged.
    """
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
        head = file.read(RECORD_HEAD.size)
        if len(head) < RECORD_HEAD.size:
            break
        opcode, length = RECORD_HEAD.unpack(head)
        place += RECORD_HEAD.size
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
        elif opcode in (Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA):
            if length > LARGEST_RECORD:
                raise RecordingError(f"a record of {length} bytes")
            _describe(opcode, Fields(file.read(length)), layout, schemas)
        elif opcode == Opcode.DATA_END:
            layout.data_end = place - RECORD_HEAD.size
        elif opcode == Opcode.FOOTER:
            layout.is_complete = True
            layout.footer = place - RECORD_HEAD.size
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
    fields = Fields(file.read(min(length, 1 << 16)))
    fields.take(16)
    name = fields.text()
    fields.text()
    data = fields.number(8)
    if data > LARGEST_ATTACHMENT or data + 4 > length:
        raise RecordingError(f"the attachment {name!r:.60} says nothing sensible of its size")
    layout.attachments[name] = place + length - 4 - data, data  # the checksum follows
    layout.checked[name] = place, length - 4


def _count(file: BinaryIO, length: int, layout: Layout) -> None:
    """How many messages of a channel the newest chunk has."""
    head = file.read(_INDEX.size)
    if length >= _INDEX.size and len(head) == _INDEX.size and layout.chunks:
        channel, size = _INDEX.unpack(head)
        layout.chunks[-1].counts[channel] = size // 16


def _describe(opcode: int, fields: Fields, layout: Layout, schemas: dict[int, str]) -> None:
    if opcode == Opcode.HEADER:
        layout.profile = fields.text()
    elif opcode == Opcode.SCHEMA:
        number = fields.number(2)
        schemas[number] = fields.name()
    elif opcode == Opcode.CHANNEL:
        number, schema = fields.number(2), fields.number(2)
        topic, encoding = fields.name(), fields.text()
        layout.channels[number] = ChannelRecord(topic, encoding, schemas.get(schema, ""), fields.table())
    else:
        name = fields.text()
        layout.metadata.setdefault(name, fields.table())


_MESSAGE_HEAD = struct.Struct("<BQHIQQ")
_HEAD = struct.Struct("<BQ")


def unpack_chunk(data: bytes, place: ChunkPlace) -> bytes:
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


def chunk_entries(raw: bytes, channels: Collection[int] | None = None) -> Iterator[Entry]:
    """The whole messages in the content of a chunk, in its order; those of some channels, or of all."""
    place, size = 0, len(raw)
    unpack_message, head = _MESSAGE_HEAD.unpack_from, _MESSAGE_HEAD.size
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
