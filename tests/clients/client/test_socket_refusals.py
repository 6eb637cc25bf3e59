"""Refusals of a client's connection to a server: addresses that are none, and servers of other programs."""

from __future__ import annotations

import re
import socket
import threading
from dataclasses import replace

import pytest

from cellwright.clients.client.client import Client
from cellwright.clients.client.socket_transport import SocketTransport, check_answer
from cellwright.middleware.wire.frames import Frame, FrameKind, hello
from cellwright.util.errors import UnknownNameError, UsageError
from tests.support.waiting import TIMEOUT


def test_missing_server_is_reported() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = taken.getsockname()[:2]
    with pytest.raises(UsageError, match=f"no server answers at 127.0.0.1:{address[1]}: "):
        SocketTransport(address)


@pytest.mark.parametrize(
    "response",
    [
        b"HTTP/1.1 400 Bad Request\r\n\r\n",
        b"",
        Frame(FrameKind.REFUSED, name="UsageError", payload=b"not you").encode(),
    ],
)
def test_foreign_server_is_refused(response: bytes) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = listener.getsockname()[:2]

        def answer() -> None:
            connection, _ = listener.accept()
            with connection:
                connection.recv(len(hello("/client", "cdr").encode()))
                connection.sendall(response)

        thread = threading.Thread(target=answer)
        thread.start()
        with pytest.raises(UsageError, match="no server answers at"):
            SocketTransport(address)
        thread.join(TIMEOUT)


def test_control_bytes_in_refusal_are_escaped() -> None:
    refusal = Frame(FrameKind.REFUSED, name="UsageError", payload=b"not \x1b[2J\x1b]0;you\x07")
    with pytest.raises(UsageError, match=re.escape(r"not \x1b[2J\x1b]0;you\x07")):
        check_answer(refusal)
    with pytest.raises(UnknownNameError, match=re.escape(r"\x1b")):
        check_answer(replace(refusal, name="UnknownNameError"))


@pytest.mark.parametrize(
    "text", ["", "here", ":80", "here:", "here:0", "here:65536", "here:8o", "here:" + 7 * "9", "a:²"]
)
def test_connect_refuses_invalid_address(text: str | tuple[str, int]) -> None:
    with pytest.raises(UsageError, match="give a host and a port"):
        Client.connect(text)
