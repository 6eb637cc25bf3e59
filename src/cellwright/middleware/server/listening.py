"""Listening sockets of servers and pages."""

from __future__ import annotations

import errno
import os
import socket
from contextlib import suppress

from cellwright.util.errors import UsageError

_EXHAUSTED = frozenset({errno.EMFILE, errno.ENFILE})


def listen(host: str, port: int, *, tries: int = 1, backlog: int = 64) -> socket.socket:
    """A socket that listens at an address.

    Args:
        host: name or address of this machine.
        port: 0 takes a free one.
        tries: so many ports are tried, from `port` upward, where it is in use.
        backlog: so many connections may wait to be accepted.

    Raises:
        UsageError: the address cannot be listened at.
    """
    if not 0 <= port <= 65535:
        raise UsageError(f"a port is from 0 to 65535, not {port}")
    for wished in range(port, min(port + (tries if port else 1), 65536)):
        try:
            family, kind, protocol, _, address = socket.getaddrinfo(host, wished, type=socket.SOCK_STREAM)[0]
            listener = socket.socket(family, kind, protocol)
        except OSError as error:
            raise UsageError(f"{host}: cannot be listened at: {error.strerror or error}") from None
        try:
            if os.name == "posix":  # elsewhere it would let two servers share a port
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(address)
            listener.listen(backlog)
        except OSError as error:
            listener.close()
            reason = error.strerror or str(error)
        else:
            return listener
    raise UsageError(f"{host}:{port}: cannot be listened at: {reason}")


class Listener:
    """A listening socket that turns connections away when the process has no more descriptors.

    A connection that is not accepted stays in the queue, and `select` reports the socket as readable without end. So
    one descriptor is kept back, with which such a connection is accepted and closed.

    Args:
        listener: a listening socket; it is closed with this object.
    """

    def __init__(self, listener: socket.socket) -> None:
        listener.setblocking(False)
        self.socket = listener
        self._spare: int | None = None
        self._keep_one_back()

    def accept(self) -> tuple[socket.socket, str] | None:
        """The next connection and the host that it comes from; None where there is none, or it was turned away."""
        if self._spare is None:
            self._keep_one_back()
        try:
            connection, address = self.socket.accept()
        except OSError as error:
            if error.errno in _EXHAUSTED:
                self._turn_away()
            return None
        return connection, str(address[0])

    def close(self) -> None:
        """Listen no longer."""
        self.socket.close()
        self._give_one_up()

    def _turn_away(self) -> None:
        self._give_one_up()
        with suppress(OSError):  # the connection has gone, or another thread took the descriptor
            self.socket.accept()[0].close()
        self._keep_one_back()

    def _keep_one_back(self) -> None:
        try:
            self._spare = os.open(os.devnull, os.O_RDONLY)
        except OSError:
            self._spare = None

    def _give_one_up(self) -> None:
        if self._spare is not None:
            os.close(self._spare)
            self._spare = None
