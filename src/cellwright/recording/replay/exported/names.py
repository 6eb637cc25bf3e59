"""What stands in an exported file besides the topics that were recorded, and how the frames in it are called."""

from __future__ import annotations

from cellwright.recording.format.format import RecordedTopic

_NODE = "/cellwright_export"

MARKERS = RecordedTopic("/cellwright/markers", "visualization_msgs/MarkerArray", rate="once", latch=True, node=_NODE)
"""The shapes of the scene, each in the frame of its body."""

TRANSFORMS = RecordedTopic("/cellwright/tf", "tf2_msgs/TFMessage", rate="25 Hz", node=_NODE)
"""Where the bodies are."""

WORLD = "world"
"""The frame of what stands still, and the parent of all others."""


def frame_of(body: int, name: str) -> str:
    """The name of a body's frame. The arm's links have frames on `/tf` too, so those here stand apart."""
    return f"cellwright/{name}" if body else WORLD
