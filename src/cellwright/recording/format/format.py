"""The format of a recording: an MCAP file with the profile of ROS 2, and what Cellwright adds to it.

Times are simulation time [ns]. Topics of the bus keep their names and types. What Cellwright adds stands under
`/cellwright/`, as messages of standard types too, so that every tool of ROS opens every channel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

Entry: TypeAlias = tuple[int, int, bytes]
"""A message in a file: number of its channel, its time [ns], its bytes."""

FORMAT = "1"
"""Version of the format, in the metadata."""

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
        name: of the topic.
        type: of its messages, the short name.
        direction: "out" of the cell, or "in".
        rate: how often, in words.
        latch: whether who listens late is given the newest message.
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
        return {
            "direction": self.direction,
            "rate": self.rate,
            "latch": "true" if self.latch else "false",
            "node": self.node,
        }
