"""The handshake that begins every connection between nodes."""

from __future__ import annotations

from typing import Mapping

from rosgraph.network import encode_ros_handshake_header


def handshake(fields: Mapping[str, str]) -> bytes:
    """The bytes of a handshake."""
    return bytes(encode_ros_handshake_header(fields))
