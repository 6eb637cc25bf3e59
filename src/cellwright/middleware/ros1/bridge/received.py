"""What a connection that waits for nothing has brought."""

from __future__ import annotations

import socket


def received(connection: socket.socket, most: int) -> bytes | None:
    """What has come, up to so many bytes: None when it is nothing yet, empty when nothing will come any more."""
    try:
        return connection.recv(most)
    except (BlockingIOError, InterruptedError):
        return None
    except OSError:
        return b""
