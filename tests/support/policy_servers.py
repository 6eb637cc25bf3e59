"""Servers of policies on the loopback, each in a thread: they do what the reference servers do, or what a test says."""

import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Event, Thread
from typing import Any

import zmq
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

from cellwright.clients.policies.array_forms import MAX_BYTES, NPY, OPENPI, ArrayForm
from cellwright.clients.policies.codec import pack, pack_json, unpack, unpack_json

Infer = Callable[[dict[str, Any]], object]
"""A policy: a reply to an observation. Bytes and text are sent as they are; an error is sent as its traceback."""


@contextmanager
def websocket_server(handle: Callable[[ServerConnection], None], **options: Any) -> Iterator[str]:
    """Serve each connection by a function; the address ends with the block."""

    def quietly(connection: ServerConnection) -> None:
        with suppress(ConnectionClosed):
            handle(connection)

    # a machine that is busy with other tests is slow; no wait has a bound
    options = {
        "open_timeout": None,
        "close_timeout": 1,
        "compression": None,
        "max_size": MAX_BYTES,
        "ping_interval": None,
    } | options
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


@contextmanager
def act_server(act: Callable[[dict[str, Any]], object]) -> Iterator[str]:
    """Serve `POST /act` by a function as OpenVLA's server does: "error" with status 200 where it raises one."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = unpack_json(self.rfile.read(int(self.headers["Content-Length"])))
            assert isinstance(body, dict)
            encoded = "encoded" in body
            try:
                reply = act(unpack_json(body["encoded"].encode()) if encoded else body)  # type: ignore[arg-type]
                content = reply if isinstance(reply, bytes) else pack_json(reply)
            except Exception:
                content = b'"error"'
            else:
                content = pack_json(content.decode()) if encoded else content
            self.send_response(200 if self.path == "/act" else 404)
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            with suppress(OSError):  # of a client that waits no longer
                self.wfile.write(content)

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_address[1]}"
        finally:
            server.shutdown()
            thread.join()


@contextmanager
def groot_server(answer: Callable[[dict[str, Any]], object]) -> Iterator[str]:
    """Serve requests by a function as GR00T's server does; bytes are sent as they are."""
    ended = Event()
    with zmq.Context() as context, context.socket(zmq.REP) as server:
        server.setsockopt(zmq.LINGER, 0)
        port = server.bind_to_random_port("tcp://127.0.0.1")

        def serve_requests() -> None:
            while not ended.is_set():
                if not server.poll(20):
                    continue
                request = unpack(server.recv(), NPY)
                assert isinstance(request, dict)
                try:
                    reply = answer(request)
                except Exception as error:
                    reply = {"error": str(error)}
                server.send(reply if isinstance(reply, bytes) else pack(reply, NPY))

        thread = Thread(target=serve_requests)
        thread.start()
        try:
            yield f"tcp://127.0.0.1:{port}"
        finally:
            ended.set()
            thread.join()
