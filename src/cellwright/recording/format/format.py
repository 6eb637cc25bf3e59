"""Recording format: topics, attachments, metadata and header that Cellwright adds to an MCAP file of ROS 2.

Times are simulation time [ns]. Topics of the bus keep their names and types. The topics that Cellwright adds begin with
`/cellwright/` and have standard message types too, so that every tool of ROS opens every channel.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

from cellwright.middleware.messages import short_name
from cellwright.util.errors import RecordingError, printable

Entry: TypeAlias = tuple[int, int, bytes]
"""A message in a file: channel number, time [ns], bytes."""

FORMAT_VERSION, EXPORT = "1", "export"
"""Values of the metadata key `format`: of a recording, and of an export for other tools."""

MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of every MCAP file."""

PROFILE = "ros2"
METADATA = "cellwright"
"""Name of the metadata record that holds the header."""

SCENE = "scene"
"""Attachment: the scene, as `scene.encode_scene` writes it."""

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
"""Topics that Cellwright adds, with their message types: JSON in strings, scene frames in bytes."""

_MAX_NAME_LENGTH = 200  # characters
_MAX_CLOCK_OFFSET = (1 << 31) * 1_000_000_000  # [ns]: the seconds of a stamp have 32 bits
CLOCK_OFFSET = "clock_offset"
"""Fact of the header after a reset that kept the clock: message time at the begin of the run [ns]."""


@dataclass(frozen=True, slots=True)
class RecordedTopic:
    """A topic in a recording.

    Attributes:
        type: short name of the message type.
        direction: "out" of the cell, or "in".
        rate: in words.
        node: its publisher or subscriber.
    """

    name: str
    type: str
    direction: str = "out"
    rate: str = ""
    latch: bool = False
    node: str = ""

    @property
    def is_own(self) -> bool:
        """True if Cellwright adds it: it was not on the bus."""
        return self.name in OWN_TOPICS

    def metadata(self) -> dict[str, str]:
        """Return the metadata of the channel, besides name and type."""
        latch = "true" if self.latch else "false"
        return {"direction": self.direction, "rate": self.rate, "latch": latch, "node": self.node}

    @staticmethod
    def of(name: str, type_name: str, metadata: Mapping[str, str]) -> RecordedTopic:
        """Read the topic of a channel in a file."""
        latch = metadata.get("latch") == "true"
        values = metadata.get("direction", "out"), metadata.get("rate", ""), latch, metadata.get("node", "")
        return RecordedTopic(name, short_name(type_name), *values)


@dataclass(frozen=True)
class RecordingHeader:
    """Header of a recording.

    Attributes:
        kind: "cell" or "robot".
        name: of the trial or the robot.
        facts: JSON values: versions, seed, timestep and everything else that the run depends on.
    """

    kind: str
    name: str
    facts: Mapping[str, Any] = field(default_factory=dict)

    @property
    def clock_offset(self) -> int:
        """Message time at the begin of the run [ns]; 0 if the header, which is untrusted, has no valid one."""
        value = self.facts.get(CLOCK_OFFSET, 0)
        return value if type(value) is int and 0 <= value < _MAX_CLOCK_OFFSET else 0

    def with_clock_offset(self, offset: int) -> RecordingHeader:
        """Return the header of a run that begins at a message time [ns]."""
        return replace(self, facts={**self.facts, CLOCK_OFFSET: offset}) if offset else self

    def metadata(self, format_version: str = FORMAT_VERSION) -> dict[str, str]:
        """Return the values of the metadata record; the format `EXPORT` marks files for other tools."""
        return {"format": format_version, "kind": self.kind, "name": self.name, "header": json.dumps(self.facts)}

    @staticmethod
    def of(values: Mapping[str, str]) -> RecordingHeader:
        """Read the header in an untrusted metadata record.

        Raises:
            RecordingError: it is no header, or one of another format.
        """
        if values.get("format") == EXPORT:
            raise RecordingError("not a recording, but an export for other tools; give the original recording")
        if values.get("format") != FORMAT_VERSION:
            found = values.get("format", "none")
            raise RecordingError(
                f"recording format must be {FORMAT_VERSION} (got {found!r:.20}); use the Cellwright that wrote it"
            )
        kind, name = values.get("kind", ""), values.get("name", "")
        try:
            facts = json.loads(values.get("header", ""))
        except (ValueError, RecursionError):
            facts = None
        if kind not in ("cell", "robot") or not isinstance(facts, dict):
            raise RecordingError("damaged: the header is invalid")
        return RecordingHeader(kind, " ".join(printable(name, _MAX_NAME_LENGTH).split()), facts)
