"""Recordings: read, iterated and compared by checksum, or refused in one line."""

from __future__ import annotations

import random
import struct
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import zstandard
from mcap.opcode import Opcode
from rich.console import Console

from cellwright.cli.replay import actions
from cellwright.middleware.bus import InputKind
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.standard import MultiArrayLayout, String, UInt8MultiArray
from cellwright.recording.format import format as names
from cellwright.recording.format.commands import Command
from cellwright.recording.format.format import MAGIC, RecordedTopic, RecordingHeader
from cellwright.recording.format.mcap_file import McapFile
from cellwright.recording.format.reader import RecordingFile, recorded_frames
from cellwright.recording.plots.reading.plot_data import load_plot_data
from cellwright.recording.replay.playback import Recorded
from cellwright.recording.replay.rebuild import unpacked_files
from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.rendering.scene.scene import decode_scene, encode_scene
from cellwright.util.errors import CellwrightError, MessageError, RecordingError
from fuzz.verdict import FindingError, check_lines

MAX_SIZE = 30_000
WORDS = ("cdr", "zstd", "lz4", "cellwright", "header", "robot", "cell", "std_msgs/msg/String", "sources/", "../")
_VALUES = (b"null", b"1e999", b"[]  ", b"{}", b"-1", b'"",', b"true", b"NaN", b'"\x1b[2J"', b'"\\u001b["')
_FOLDER = Path(tempfile.mkdtemp(prefix="cellwright-fuzz-"))
_PATH = _FOLDER / "run.mcap"
_HEAD = struct.Struct("<BQ")
_CHUNK = struct.Struct("<QQQI")

_SCENE = Scene("small", ("world", "vacuum_gripper_link"), (), ())
_POSES = np.tile(np.array([0, 0, 0, 1, 0, 0, 0], np.float32), (2, 1))
_FRAME = np.frombuffer(SceneFrame(0, _POSES, np.ones(2, bool)).encode(), np.uint8)
_TEXTS = {
    names.COMMAND: Command(
        3, InputKind.PUBLISH, "/talk", "std_msgs/String", "/me", TYPES.to_cdr(String("go"))
    ).encode(),
    names.PANEL: '{"clock": {"time": 1.0}, "score": {"total": 1.0}, "trays": [{"number": 1, "parts": [{"name": "a", '
    '"type": "gear_part", "faulty": false}]}], "intention": {"text": "on its way", "node": "/me", "time": 0.1}, '
    '"joints": [{"name": "a", "position": 0.1}], "arms": [{"name": "left", "tip": "vacuum_gripper_link"}]}',
    names.EVENT: '{"kind": "kit", "time": 0.3, "tray": "agv1::kit_tray_1", "kit_type": "k", "total": 2.0, "evidence": '
    '{"parts": [{"type": "gear_part", "cause": "placed", "object": "a", "presence": 1.0, "pose": 0.0}]}}',
    names.STATE_HASH: '{"tick": 3, "hash": "00"}',
    names.END: '{"outcome": "done", "score": {"total": 1.0}, "error": ""}',
}


def seeds() -> Iterator[bytes]:
    """Yield small recordings, whose chunks have neither compression nor checksum, so that changes get into them."""
    for kind in ("cell", "robot"):
        with McapFile(_PATH) as file:
            file.describe(names.METADATA, RecordingHeader(kind, "small", {"seed": 7, "files": ["t.yaml"]}).metadata())
            file.attach(names.SCENE, "application/octet-stream", encode_scene(_SCENE))
            file.attach(f"{names.SOURCES}t.yaml", "text/yaml", b"orders: {}\n")
            talk = RecordedTopic("/talk", "std_msgs/String", latch=True, rate="10"), TYPES.to_cdr(String("a word"))
            own = [(RecordedTopic(name, names.TEXT), TYPES.to_cdr(String(text))) for name, text in _TEXTS.items()]
            frame = (
                RecordedTopic(names.FRAME, names.BYTES),
                TYPES.to_cdr(UInt8MultiArray(MultiArrayLayout([], 0), _FRAME)),
            )
            channels = [(file.channel(topic), data) for topic, data in (talk, *own, frame)]
            for time in range(12):
                for channel, data in channels:
                    file.add(channel, time * 10**8, data)
                if time % 4 == 3:
                    file.flush()
        yield _plain(_PATH.read_bytes())


def mutate(data: bytes, chance: random.Random) -> bytes | None:
    """Return the same records, some of them changed, doubled, left out or moved; lengths stay true, mostly."""
    records = _records(data)
    if not records:
        return None
    for _ in range(chance.randint(1, 4)):
        place = chance.randrange(len(records))
        opcode, body = records[place]
        match chance.randrange(6):
            case 0:
                records.insert(chance.randrange(len(records) + 1), (opcode, body))
            case 1 if len(records) > 1:
                del records[place]
            case 2:
                records[place] = chance.randrange(16), body
            case _:
                records[place] = opcode, _changed(body, chance)
    whole = MAGIC + b"".join(_HEAD.pack(opcode, len(body)) + body for opcode, body in records)
    return whole + MAGIC if chance.random() < 0.7 else whole[: chance.randrange(len(whole))]


def attempt(data: bytes) -> None:
    """Do with the bytes what the commands do with a recording."""
    _PATH.write_bytes(data)
    try:
        recording = RecordingFile(_PATH)
    except RecordingError as error:
        check_lines([error], [str(_PATH)])
        return
    with recording:
        for look in (_table, _messages, _frames, load_plot_data, _sources, _play, RecordingFile.check_bytes):
            _refused_or_done(look, recording)
        with suppress(MessageError):
            decode_scene(recording.scene or b"")


def _refused_or_done(look: Callable[[RecordingFile], object], recording: RecordingFile) -> None:
    try:
        look(recording)
    except CellwrightError as error:
        if not str(error).isprintable():
            raise FindingError(f"a line that cannot be read: {error!r:.200}") from None


def _table(recording: RecordingFile) -> None:
    with (_FOLDER / "table.txt").open("w+", encoding="utf-8") as file:
        actions.show_contents(Console(file=file, width=80, highlight=False), actions.contents_document(recording))
        file.seek(0)
        for line in file.read().split("\n"):
            if not line.isprintable():
                raise FindingError(f"a table that no terminal can show: {line!r:.200}")


def _messages(recording: RecordingFile) -> None:
    for message in recording.messages():
        _refused_or_done(lambda recording: recording.decode(message), recording)  # noqa: B023
    recording.newest("/talk", recording.end_time)
    for command in recording.commands():
        _refused_or_done(lambda _: command.message(), recording)  # noqa: B023


def _frames(recording: RecordingFile) -> None:
    for _ in recorded_frames(recording):
        pass


def _sources(recording: RecordingFile) -> None:
    with unpacked_files(recording.sources) as folder:
        for path in folder.rglob("*"):
            if not path.resolve().is_relative_to(folder.resolve()):
                raise FindingError(f"a file lies outside: {path}")


def _play(recording: RecordingFile) -> None:
    recorded = Recorded(recording)
    for topic in recorded.bus.topics():
        recorded.bus.subscribe(topic.name, lambda _message: None, node="/me")
    for time in (recording.end_time, recording.begin):
        recorded.seek(time)
        for _ in range(3):
            recorded.simulation.step()


def _records(data: bytes) -> list[tuple[int, bytes]]:
    found, place = [], len(MAGIC)
    while data.startswith(MAGIC) and place + _HEAD.size <= len(data):
        opcode, length = _HEAD.unpack_from(data, place)
        place += _HEAD.size
        if length > len(data) - place:
            break
        found.append((opcode, data[place : place + length]))
        place += length
    return found


def _plain(data: bytes) -> bytes:
    records = []
    for opcode, body in _records(data):
        if opcode == Opcode.CHUNK:
            first, last, size, _ = _CHUNK.unpack_from(body)
            named = int.from_bytes(body[_CHUNK.size : _CHUNK.size + 4], "little")
            packed = body[_CHUNK.size + 4 + named + 8 :]
            raw = zstandard.ZstdDecompressor().decompress(packed, size) if named else packed
            records.append(
                (opcode, _CHUNK.pack(first, last, len(raw), 0) + bytes(4) + struct.pack("<Q", len(raw)) + raw)
            )
        else:
            records.append((opcode, body))
    return MAGIC + b"".join(_HEAD.pack(opcode, len(body)) + body for opcode, body in records) + MAGIC


def _changed(body: bytes, chance: random.Random) -> bytes:
    changed = bytearray(body)
    for _ in range(chance.randint(1, 3)):
        place = chance.randrange(len(changed) + 1)
        match chance.randrange(6):
            case 4 | 5:  # texts keep their length, so that the records after them are found
                word = chance.choice(_VALUES)
                changed[place : place + len(word)] = word[: len(changed) - place]
            case 0 if place < len(changed):
                changed[place] = chance.choice((0, 1, 27, 127, 128, 255, chance.randrange(256)))
            case 1:
                changed[place:place] = chance.choice(WORDS).encode()
            case 2:
                del changed[place : place + chance.randint(1, 8)]
            case _:
                changed[place : place + 4] = struct.pack("<I", chance.choice((0, 1, 1 << 16, 1 << 31, (1 << 32) - 1)))
    return bytes(changed)
