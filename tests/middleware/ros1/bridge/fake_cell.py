"""Fake cell for a bridge, whose frames the test decides."""

from __future__ import annotations

import contextlib
import json
import socket
import threading
from collections.abc import Callable
from typing import Any

from cellwright.middleware.messages import TYPES
from cellwright.middleware.wire.frames import Decoder, Frame, FrameKind, time_frame
from cellwright.middleware.wire.quiet_clock import TIME
from tests.support.waiting import TIMEOUT

TICK = 2_000_000
"""Duration of a tick [ns]."""


def out(name: str, type_name: str = "std_msgs/String", **more: Any) -> dict[str, Any]:
    """Return a topic that the cell publishes."""
    return _topic(name, type_name, "out") | {"publishers": ["/gazebo"]} | more


def heard(name: str, type_name: str = "std_msgs/String") -> dict[str, Any]:
    """Return a topic that the cell receives."""
    return _topic(name, type_name, "in") | {"subscribers": ["/gazebo"]}


def service(name: str, type_name: str = "std_srvs/Trigger") -> dict[str, Any]:
    """Return a service."""
    return {"name": name, "type": type_name, "md5": TYPES.md5(type_name), "node": "/gazebo"}


def _topic(name: str, type_name: str, direction: str) -> dict[str, Any]:
    return {
        "name": name,
        "type": type_name,
        "md5": TYPES.md5(type_name),
        "definition": TYPES.definition(type_name),
        "direction": direction,
        "rate": "",
        "latch": False,
        "on_event": False,
        "publishers": [],
        "subscribers": [],
    }


class FakeCell:
    """Fake cell on a free port that records received frames, and answers them.

    The attribute `answer` returns the answer to each of them, None for none.
    """

    def __init__(
        self, topics: list[dict[str, Any]], services: list[dict[str, Any]] | None = None, *, lockstep: bool = False
    ) -> None:
        self.welcome = {
            "protocol": 1,
            "cellwright": "0",
            "trial": "fake",
            "timestep": [1, 500],
            "lockstep": lockstep,
            "competition": False,
            "time": 0,
            "topics": topics,
            "services": services or [],
            "actions": [],
        }
        self.frames: list[Frame] = []
        self.answer: Callable[[Frame], Frame | None] = self.usual
        self.now = 0
        self.subscribed: dict[str, dict[int, Frame]] = {}
        self._lock = threading.RLock()
        self._has_come = threading.Condition(self._lock)
        self._connection: socket.socket | None = None
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def reset(self) -> None:
        """Forget received frames, and answer as usual; for a cell that several tests share."""
        with self._lock:
            self.frames.clear()
            self.answer = self.usual

    def of(self, kind: FrameKind) -> list[Frame]:
        """Return the frames of a kind received so far."""
        with self._lock:
            return [frame for frame in self.frames if frame.kind is kind]

    def listeners(self, topic: str) -> int:
        """Return the number of subscriptions to a topic."""
        with self._lock:
            return len(self.subscribed.get(topic, {}))

    def say(self, topic: str, payload: bytes) -> None:
        """Publish a message to the present subscribers."""
        with self._lock:
            for number in self.subscribed.get(topic, {}):
                self.send(Frame(FrameKind.MESSAGE, number, payload=payload))

    def say_heard(self, topic: str, payload: bytes) -> None:
        """Publish a message as soon as there is a subscriber: a subscription may still be in transit."""
        self.wait_for_listener(topic)
        self.say(topic, payload)

    def wait_for_listener(self, topic: str) -> None:
        """Wait until a topic has a subscription."""
        with self._has_come:
            assert self._has_come.wait_for(lambda: self.subscribed.get(topic), TIMEOUT), f"{topic} has no subscription"

    def send(self, frame: Frame) -> None:
        """Send a frame."""
        assert self._connection is not None
        self._connection.sendall(frame.encode())

    def send_bytes(self, data: bytes) -> None:
        """Send bytes, which may be no frame."""
        assert self._connection is not None
        self._connection.sendall(data)

    def usual(self, frame: Frame) -> Frame | None:
        """Return the usual answer of a cell: it grants all time, and services have empty responses."""
        if frame.kind is FrameKind.ADVANCE:
            until = int.from_bytes(frame.payload[:8], "little", signed=True)
            self.now = max(self.now, -(-until // TICK) * TICK)
            return time_frame(frame.number, self.now)
        if frame.kind is FrameKind.CALL and frame.name == TIME:  # a bridge asks while no time passes
            return Frame(FrameKind.ANSWER, frame.number, payload=json.dumps({"time": self.now}).encode())
        if frame.kind is FrameKind.CALL:
            return Frame(FrameKind.ANSWER, frame.number)
        if frame.kind is FrameKind.SUBSCRIBE or (frame.kind is FrameKind.PUBLISH and frame.number):
            return Frame(FrameKind.DONE, frame.number)
        return None

    def hang_up(self) -> None:
        """Close the connection without ENDED."""
        assert self._connection is not None
        self._connection.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Close all sockets."""
        with contextlib.suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)  # the thread that accepts is waiting
        self._listener.close()
        if self._connection is not None:
            with contextlib.suppress(OSError):
                self.hang_up()
        self._thread.join(TIMEOUT)

    def _serve(self) -> None:
        while True:
            try:
                self._connection, _ = self._listener.accept()
            except OSError:
                return
            self._connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            with contextlib.suppress(OSError), self._connection as connection:
                self._talk(connection)

    def _talk(self, connection: socket.socket) -> None:
        decoder = Decoder()
        self.subscribed.clear()
        while data := connection.recv(1 << 16):
            for frame in decoder.feed(data):
                with self._lock:
                    self.frames.append(frame)
                    if frame.kind is FrameKind.HELLO:
                        self.send(Frame(FrameKind.WELCOME, payload=json.dumps(self.welcome).encode()))
                        continue
                    if frame.kind is FrameKind.SUBSCRIBE:
                        self.subscribed.setdefault(frame.name, {})[frame.number] = frame
                        self._has_come.notify_all()
                    elif frame.kind is FrameKind.UNSUBSCRIBE:
                        for numbers in self.subscribed.values():
                            numbers.pop(frame.number, None)
                    answer = self.answer(frame)
                    if answer is not None:
                        self.send(answer)
