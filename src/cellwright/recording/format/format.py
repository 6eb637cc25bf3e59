"""Recording format: topics, attachments, metadata and header that Cellwright adds to an MCAP file of ROS 2.

Times are simulation time [ns]. Topics of the bus keep their names and types. What Cellwright adds stands under
`/cellwright/`, as messages of standard types too, so that every tool of ROS opens every channel.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from cellwright.middleware.messages import short_name
from cellwright.util.errors import RecordingError, showable

Entry: TypeAlias = tuple[int, int, bytes]
"""A message in a file: number of its channel, its time [ns], its bytes."""

FORMAT_VERSION, EXPORT = "1", "export"
"""Format in the metadata: of a recording, and of what was made of one for other tools."""

MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of every MCAP file."""

PROFILE = "ros2"
METADATA = "cellwright"
"""Name of the metadata record that says what the recording is of."""

SCENE = "scene"
"""Attachment: what stands where and how it looks, as `scene.encode_scene` writes it."""

START = "start"
"""Attachment: the checkpoint that the run began from, if it did not begin at time 0."""

SOURCES = "sources/"
"""Attachments with this prefix are the files that the cell or robot was read from."""

TEXT, BYTES = "std_msgs/String", "std_msgs/UInt8MultiArray"

COMMAND = "/cellwright/command"
FRAME = "/cellwright/frame"
PANEL = "/cellwright/panel"
EVENT = "/cellwright/event"
STATE_HASH = "/cellwright/state_hash"
END = "/cellwright/end"

OWN_TOPICS = {COMMAND: TEXT, FRAME: BYTES, PANEL: TEXT, EVENT: TEXT, STATE_HASH: TEXT, END: TEXT}
"""What Cellwright adds, with the type of message that carries it: JSON in a text, frames of the scene in bytes."""


@dataclass(frozen=True, slots=True)
class RecordedTopic:
    """A topic in a recording.

    Attributes:
        type: of its messages, the short name.
        direction: "out" of the cell, or "in".
        rate: how often, in words.
        node: who publishes it, or hears it.
    """

    name: str
    type: str
    direction: str = "out"
    rate: str = ""
    latch: bool = False
    node: str = ""

    @property
    def is_own(self) -> bool:
        """Whether Cellwright adds it: it was not on the bus."""
        return self.name in OWN_TOPICS

    def metadata(self) -> dict[str, str]:
        """What the channel in the file says besides name and type."""
        latch = "true" if self.latch else "false"
        return {"direction": self.direction, "rate": self.rate, "latch": latch, "node": self.node}

    @staticmethod
    def of(name: str, type_name: str, metadata: Mapping[str, str]) -> RecordedTopic:
        """The topic of a channel in a file."""
        latch = metadata.get("latch") == "true"
        told = metadata.get("direction", "out"), metadata.get("rate", ""), latch, metadata.get("node", "")
        return RecordedTopic(name, short_name(type_name), *told)


_MAX_NAME_LENGTH = 200  # characters


@dataclass(frozen=True)
class RecordingHeader:
    """What a recording is of.

    Attributes:
        kind: "cell" or "robot".
        name: of the trial or the robot.
        facts: JSON values: versions, seed, timestep and whatever else the run depends on.
    """

    kind: str
    name: str
    facts: Mapping[str, Any] = field(default_factory=dict)

    def metadata(self, format_version: str = FORMAT_VERSION) -> dict[str, str]:
        """As the values of a metadata record; `EXPORT` is the format of files for other tools."""
        return {"format": format_version, "kind": self.kind, "name": self.name, "header": json.dumps(self.facts)}

    @staticmethod
    def of(values: Mapping[str, str]) -> RecordingHeader:
        """The header in a metadata record, which may come from anywhere.

        Raises:
            RecordingError: it is none, or of another format.
        """
        if values.get("format") == EXPORT:
            raise RecordingError("it was made for other tools, and is no recording: give the one that it was made of")
        if values.get("format") != FORMAT_VERSION:
            found = values.get("format", "none")
            raise RecordingError(f"it is a recording of format {found!r:.20}, and this version reads {FORMAT_VERSION}")
        kind, name = values.get("kind", ""), values.get("name", "")
        try:
            facts = json.loads(values.get("header", ""))
        except (ValueError, RecursionError):
            facts = None
        if kind not in ("cell", "robot") or not isinstance(facts, dict):
            raise RecordingError("what it says of itself makes no sense")
        return RecordingHeader(kind, " ".join(showable(name, _MAX_NAME_LENGTH).split()), facts)
