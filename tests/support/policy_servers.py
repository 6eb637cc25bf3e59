"""Servers of policies on the loopback, each in a thread: they do what the reference servers do, or what a test says."""

import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from threading import Thread
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

from cellwright.clients.policies.array_forms import MAX_BYTES, OPENPI, ArrayForm
from cellwright.clients.policies.codec import pack, unpack

Infer = Callable[[dict[str, Any]], object]
"""A policy: a reply to an observation. Bytes and text are sent as they are; an error is sent as its traceback."""


@contextmanager
def websocket_server(handle: Callable[[ServerConnection], None], **options: Any) -> Iterator[str]:
    """Serve each connection by a function; the address ends with the block."""

    def quietly(connection: ServerConnection) -> None:
        with suppress(ConnectionClosed):
            handle(connection)

    options = {"compression": None, "max_size": MAX_BYTES, "ping_interval": None, "close_timeout": 1} | options
    with serve(quietly, "127.0.0.1", 0, **options) as server:
        thread = Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"ws://127.0.0.1:{server.socket.getsockname()[1]}"
        finally:
            server.shutdown()
            thread.join()


def openpi(
    infer: Infer, metadata: Mapping[str, object] | bytes | str = {}, arrays: ArrayForm = OPENPI
) -> Callable[[ServerConnection], None]:
    """Return what OpenPI's server does with a connection, with a policy and its metadata."""

    def handle(connection: ServerConnection) -> None:
        connection.send(metadata if isinstance(metadata, (bytes, str)) else pack(metadata, arrays))
        for frame in connection:
            assert isinstance(frame, bytes), "a client sends no text"
            observation = unpack(frame, arrays)
            assert isinstance(observation, dict)
            try:
                reply = infer(observation)
            except Exception:
                connection.send(traceback.format_exc())
                connection.close(1011, "Internal server error. Traceback included in previous frame.")
                return
            connection.send(reply if isinstance(reply, (bytes, str)) else pack(reply, arrays))

    return handle
