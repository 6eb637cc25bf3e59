"""Server of an environment: a websocket for one client at a time."""

from __future__ import annotations

import logging
import socket
import traceback
from contextlib import suppress
from ipaddress import ip_address
from threading import Event, Lock, Thread
from typing import Final

from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

from cellwright.envs.served.protocol import MAX_REQUEST
from cellwright.envs.served.session import EnvSession, error_reply
from cellwright.util.errors import UsageError

_PATIENCE: Final = 2.0
"""Bound of a client's wait for the end of the one before [s]: that one may just have closed its connection."""
_OPEN_TIMEOUT: Final = 5.0
"""Bound of the handshake [s]: a peer that says nothing delays the end of the process by it."""
_CLOSE_TIMEOUT: Final = 1.0  # [s]
_TRY_AGAIN_LATER: Final = 1013  # close code, as registered with IANA for RFC 6455

# What peers do wrong is answered, or ends their connection; websockets would print a traceback for each.
_SILENT = logging.Logger("cellwright.envs.served", logging.CRITICAL)


class EnvServer:
    """Server of an environment, in a thread of its own, until it is closed.

    Clients are programs: it refuses pages in browsers, which send an origin. It sends no pings, since a client may
    think for any time between two requests.

    Args:
        session: the environment, which is closed with the server.
        host: address to listen at.
        port: port to listen at; 0 takes a free one.

    Attributes:
        address: `ws://HOST:PORT`.
        is_local: True if only programs on this machine can reach it.

    Raises:
        UsageError: it cannot listen there.

    Example:
        >>> from cellwright import load_trial
        >>> server = EnvServer(EnvSession(load_trial("pick_from_bin")))
        >>> server.address.rpartition(":")[0]
        'ws://127.0.0.1'
        >>> server.close()
    """

    def __init__(self, session: EnvSession, host: str = "127.0.0.1", port: int = 0) -> None:
        self._session = session
        self._turn, self._guard = Lock(), Lock()
        self._client: ServerConnection | None = None
        self._over = Event()
        try:
            self._server = serve(
                self._handle,
                host,
                port,
                origins=[None],
                compression=None,
                max_size=MAX_REQUEST,
                ping_interval=None,
                open_timeout=_OPEN_TIMEOUT,
                close_timeout=_CLOSE_TIMEOUT,
                logger=_SILENT,
            )
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or error
            raise UsageError(f"{host}:{port}: cannot listen there ({reason}); choose another port or host") from None
        bound, number = self._server.socket.getsockname()[:2]
        self.address, self.is_local = f"ws://{host}:{number}", ip_address(bound).is_loopback
        self._thread = Thread(target=self._server.serve_forever)
        self._thread.start()

    @property
    def is_running(self) -> bool:
        """True until `end` or `close`."""
        return not self._over.is_set()

    def end(self) -> None:
        """Ask for the end, from any thread."""
        self._over.set()

    def close(self) -> None:
        """End the connection, once the action that runs is done, and release the environment."""
        self.end()
        self._session.end()
        self._server.shutdown()
        with self._guard:
            client = self._client
        if client is not None:
            # not `close`, which waits for its turn to send: a client that reads nothing never gives it
            with suppress(OSError):
                client.socket.shutdown(socket.SHUT_RDWR)
        self._thread.join()
        with self._turn:
            self._session.close()

    def _handle(self, connection: ServerConnection) -> None:
        with suppress(ConnectionClosed, OSError):
            if not self._turn.acquire(timeout=_PATIENCE):
                connection.send(error_reply("busy", "another client is connected; start a server for each").frame)
                connection.close(_TRY_AGAIN_LATER, "busy")
                return
            try:
                self._serve(connection)
            finally:
                with self._guard:
                    self._client = None
                self._turn.release()

    def _serve(self, connection: ServerConnection) -> None:
        with self._guard:
            self._client = connection
        if self._over.is_set():  # it would not be ended
            return
        self._session.forget()
        for frame in connection:
            try:
                reply = self._session.reply(frame)
            except Exception:  # a defect, of which nothing else would tell
                traceback.print_exc()
                raise
            connection.send(reply.frame)
            if reply.is_last or self._over.is_set():
                return
