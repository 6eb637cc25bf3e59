"""A client for tests, in the thread of its server."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from cellwright.middleware.bus import Node
from cellwright.middleware.messages import TYPES, Message, type_of
from cellwright.middleware.server import Server
from cellwright.middleware.wire.frames import Decoder, Frame, FrameKind, hello
from tests.support.waiting import wait_until


class Talker:
    """Client that sends frames, and lets the server serve until the answer arrives."""

    def __init__(self, server: Server, node: str = "/me", encoding: str = "cdr") -> None:
        self.server = server
        self.encoding = encoding
        self.heard: list[Frame] = []
        self.connection = socket.create_connection(server.address)
        self._decoder = Decoder()
        self._number = 0
        self.is_over = False
        self.welcome: dict[str, Any] = {}
        if node:
            self.say(hello(node, encoding))
            self.welcome = self.wait_for(FrameKind.WELCOME).json()

    def say(self, *frames: Frame) -> None:
        """Send frames."""
        self.connection.sendall(b"".join(frame.encode() for frame in frames))

    def listen(self) -> None:
        """Read what has arrived by now."""
        self.connection.setblocking(False)
        try:
            while data := self.connection.recv(1 << 16):
                self.heard += self._decoder.feed(data)
            self.is_over = True
        except BlockingIOError:
            pass
        except ConnectionError:
            self.is_over = True
        finally:
            self.connection.setblocking(True)

    def wait_until(self, condition: Callable[[], bool]) -> None:
        """Let the server serve until a condition holds."""

        def serve() -> None:
            self.server.wait(0.001)
            self.listen()

        wait_until(condition, "expected state of server and client", seen=lambda: self.heard[-3:], between=serve)

    def wait_for(self, kind: FrameKind, number: int = 0) -> Frame:
        """Wait for the next frame of a kind with a number, and remove it from `heard`."""

        def fits(frame: Frame) -> bool:
            return (frame.kind, frame.number) == (kind, number)

        self.wait_until(lambda: any(map(fits, self.heard)))
        found = next(filter(fits, self.heard))
        self.heard.remove(found)
        return found

    def ask(self, frame: Frame) -> Frame:
        """Send a frame and wait for any answer."""
        self.say(frame)

        def answers(each: Frame) -> bool:
            return each.number == frame.number and each.kind is not FrameKind.MESSAGE

        self.wait_until(lambda: any(map(answers, self.heard)))
        found = next(filter(answers, self.heard))
        self.heard.remove(found)
        return found

    def bytes_of(self, message: Message) -> bytes:
        """Return a message in this client's encoding."""
        return TYPES.to_ros1(message) if self.encoding == "ros1" else TYPES.to_cdr(message)

    def publish(self, topic: str, message: Message, *, number: int = 1, node: str = "") -> Frame:
        """Publish, and wait for the answer."""
        said = Frame(FrameKind.PUBLISH, number, topic, type_of(type(message)), node, self.bytes_of(message))
        return self.ask(said)

    def call(self, service: str, request: Message, type_name: str = "", *, node: str = "") -> Frame:
        """Call a service, and wait for the answer."""
        return self.ask(Frame(FrameKind.CALL, 1, service, type_name, node, self.bytes_of(request)))

    def messages(self, number: int) -> list[bytes]:
        """Return the messages of a subscription so far."""
        self.server.wait(0.0)
        self.listen()
        return [frame.payload for frame in self.heard if (frame.kind, frame.number) == (FrameKind.MESSAGE, number)]


@dataclass
class Hall:
    """A server on a free port, the lines that it reports, and the clients that were created here."""

    server: Server
    lines: list[str]
    clients: list[Talker] = field(default_factory=list)

    def connect(self, node: str = "/me", encoding: str = "cdr") -> Talker:
        """Return a client after WELCOME; without a name it has not sent HELLO."""
        client = Talker(self.server, node, encoding)
        self.clients.append(client)
        return client


@contextmanager
def served(cell: Node, *, lockstep: bool = False) -> Iterator[Hall]:
    """A server and its clients, closed in the end."""
    lines: list[str] = []
    hall = Hall(Server(cell, port=0, lockstep=lockstep, report=lines.append), lines)
    try:
        yield hall
    finally:
        hall.server.close("the test is over")
        for client in hall.clients:
            client.connection.close()


def as_json(**fields: Any) -> bytes:
    """Return a JSON object."""
    return json.dumps(fields).encode()
