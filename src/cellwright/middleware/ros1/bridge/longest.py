"""A limit to the length of a message from another node: rospy keeps whatever comes until a message is whole."""

from __future__ import annotations

import struct
from typing import Any, Callable

from rospy.exceptions import TransportException
from rospy.impl.tcpros_pubsub import TCPROSSub

from cellwright.middleware.wire.frames import LONGEST_SAID

_LENGTH = struct.Struct("<I")


def limit_messages(tell: Callable[[str], None], longest: int = LONGEST_SAID) -> None:
    """Have connections cut, and made anew, on which a message is announced that is too long to be carried.

    Args:
        tell: told of it, with the name of the topic; by threads of rospy's.
        longest: length of a message [bytes].
    """
    read = TCPROSSub.read_messages

    def read_messages(self: Any, buffer: Any, messages: Any, connection: Any) -> None:
        with buffer.getbuffer() as view:
            (length,) = _LENGTH.unpack_from(view)
        if length > longest:
            buffer.seek(0)
            buffer.truncate()  # else what has come would be taken for the next handshake
            tell(self.resolved_name)
            raise TransportException(f"a message of {length} bytes is too long")
        read(self, buffer, messages, connection)

    TCPROSSub.read_messages = read_messages
