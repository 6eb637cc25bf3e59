"""The door of a server: the address that it listens at, and who comes in by it."""

from __future__ import annotations

import os
import socket

from cellwright.errors import UsageError
from cellwright.server.guest import Guest

_MOST_DESCRIPTORS = 1024  # those beyond are none that `select` could look at


def listen(host: str, port: int) -> socket.socket:
    """A socket that listens at an address; 0 takes a free port.

    Raises:
        UsageError: the address cannot be listened at.
    """
    if not 0 <= port <= 65535:
        raise UsageError(f"a port is from 0 to 65535, not {port}")
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        listener = socket.socket(family, kind, protocol)
    except OSError as error:
        raise UsageError(f"{host}: cannot be listened at: {error.strerror or error}") from None
    try:
        if os.name == "posix":  # elsewhere it would let two servers share a port
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(address)
        listener.listen(64)
    except OSError as error:
        listener.close()
        raise UsageError(f"{host}:{port}: cannot be listened at: {error.strerror or error}") from None
    listener.setblocking(False)
    return listener


def accept(listener: socket.socket) -> Guest | None:
    """Who has come; None where nobody can be taken in."""
    try:
        connection, address = listener.accept()
    except OSError:  # gone again, or there are no more descriptors to be had
        return None
    if os.name == "posix" and connection.fileno() >= _MOST_DESCRIPTORS:
        connection.close()
        return None
    try:
        return Guest(connection, str(address[0]))
    except OSError:
        connection.close()
        return None
