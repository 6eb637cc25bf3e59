"""Small recordings for tests."""

from __future__ import annotations

from pathlib import Path

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.standard import String
from cellwright.recording.format import format as names
from cellwright.recording.format.format import RecordedTopic, RecordingHeader
from cellwright.recording.format.mcap_file import McapFile

TALK = RecordedTopic("/talk", "std_msgs/String", "out", "on event", latch=True, node="/cell")
SHOUT = RecordedTopic("/shout", "std_msgs/String", "in", "", node="/cell")


def text(word: str) -> bytes:
    """Encode a text as in a recording."""
    return TYPES.to_cdr(String(word))


def write(path: Path, words: int, *, pieces: int = 3, kind: str = "cell") -> None:
    """Write a recording of some words on two topics in turn, a millisecond apart, in some chunks."""
    with McapFile(path) as file:
        file.describe(names.METADATA, RecordingHeader(kind, "small", {"seed": 7}).metadata())
        file.attach(names.SCENE, "application/octet-stream", b"a scene")
        file.attach(f"{names.SOURCES}trial.yaml", "text/yaml", b"orders: {}\n")
        channels = [file.channel(TALK), file.channel(SHOUT)]
        for number in range(words):
            file.add(channels[number % 2], number * 1_000_000, text(f"word {number}"))
            if number % max(1, words // pieces) == 0:
                file.flush()
