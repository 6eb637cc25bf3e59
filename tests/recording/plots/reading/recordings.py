"""Recordings for tests: messages of any topics in a file, panels, and lines of the log."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from cellwright.middleware.messages import TYPES, Message
from cellwright.middleware.messages.standard import String
from cellwright.recording.format import format as names
from cellwright.recording.format.format import RecordedTopic, RecordingHeader
from cellwright.recording.format.mcap_file import McapFile
from cellwright.recording.format.reader import RecordedMessage

SECOND = 1_000_000_000

TimedMessage = tuple[float, str, str, Message]
"""Time [s], topic, type and message."""


def message(time: float, content: Message, topic: str = "/a") -> RecordedMessage:
    """Return one message as a reader gets it."""
    return RecordedMessage(topic, round(time * SECOND), TYPES.to_cdr(content))


def text(time: float, topic: str, value: Any) -> RecordedMessage:
    """Return JSON on a topic."""
    return message(time, String(data=json.dumps(value)), topic)


def event(time: float, **values: Any) -> RecordedMessage:
    """Return a line of the referee's log."""
    return text(time, names.EVENT, {"time": time, **values})


def trays(time: float, **contents: Iterable[str]) -> RecordedMessage:
    """Return a panel with trays only: names of parts by number of AGV, as in `agv1=["a"]`; `!a` is faulty."""
    contained = [
        {"number": int(agv[3:]), "parts": [{"name": p.lstrip("!"), "faulty": p.startswith("!")} for p in parts]}
        for agv, parts in contents.items()
    ]
    return text(time, names.PANEL, {"kind": "cell", "trays": contained})


def kit(time: float, agv: int = 1, **evidence: Any) -> RecordedMessage:
    """Return the event of a judged kit."""
    link = f"agv{agv}::kit_tray_{agv}::kit_tray_{agv}::tray"
    found = {"kit_type": "order_0_kit_0", "total": 1.0, "best": 6.0, "parts": [], "extras": [], **evidence}
    return event(time, kind="kit", tray_id=link, kit_type="order_0_kit_0", refusal=None, evidence=found)


def write(
    path: Path,
    header: RecordingHeader,
    messages: Iterable[TimedMessage],
    *,
    attachments: dict[str, bytes] | None = None,
) -> None:
    """Write a recording of messages, in the order of their times."""
    with McapFile(path) as file:
        file.describe(names.METADATA, header.metadata())
        for name, data in (attachments or {}).items():
            file.attach(name, "application/octet-stream", data)
        channels: dict[str, int] = {}
        for time, topic, kind, content in sorted(messages, key=lambda each: each[0]):
            if topic not in channels:
                channels[topic] = file.channel(RecordedTopic(topic, kind))
            file.add(channels[topic], round(time * SECOND), TYPES.to_cdr(content))
