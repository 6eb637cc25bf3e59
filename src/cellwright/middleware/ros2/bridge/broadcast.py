"""Joint states as `joint_state_broadcaster` of ros2_control publishes them: with a frame in their headers."""

from __future__ import annotations

NAME, TYPE = "/joint_states", "sensor_msgs/JointState"
"""Name and type of its topic."""

# In CDR, 4 bytes of encapsulation and 8 of the stamp come first. The frame and the padding behind it are 8 or 16 bytes
# long, so that all that follows keeps its alignment.
_PLACE = 12
_NONE, _NONE_LENGTH = b"\x01\0\0\0\0", 8
_FRAME = b"\x0a\0\0\0base_link\0\0\0"


def with_frame(payload: bytes) -> bytes:
    """Return a message in CDR with the frame `base_link`, if its header has none: RViz ignores efforts without one."""
    if payload[_PLACE : _PLACE + len(_NONE)] != _NONE:
        return payload
    return b"".join((payload[:_PLACE], _FRAME, payload[_PLACE + _NONE_LENGTH :]))
