"""Relay between a client of the socket protocol and a cell in a ROS: what those of ROS 1 and 2 share.

A relay is an ordinary node. It speaks to its one client as a served cell would (`cellwright.middleware.wire.frames`),
and ends when the client hangs up, when its stdin is closed, or when the simulator has ended.
"""

from __future__ import annotations

import json
import os
import socket
import sys
import threading
import time
from collections import deque
from typing import Any, Callable

from cellwright.middleware.wire.connection import BufferedConnection
from cellwright.middleware.wire.event_loop import EventLoop, report, report_ready
from cellwright.middleware.wire.frames import Decoder, Frame, FrameError, FrameKind, read_advance, time_frame
from cellwright.middleware.wire.graph import Graph, GraphGoneError, PublishedTopic, ServiceGoneError, SubscribedTopic

CLOCK, STEP = "/clock", "/cellwright/step"

DECLARE = "relay:type"
"""Service of the relay itself: the client declares a type that it will publish, as JSON: type, md5, definition."""

PUBLISHER_TIMEOUT = 5.0  # time for connections to be established, and for messages to arrive [s]
_NAP = 0.002
_LOOK_AFTER = 0.5
_MAX_LOOKS = 10


class TimeStandsError(Exception):
    """Lockstep time cannot advance any more; the text has the reason."""


class Relay:
    """Server of one client, as long as the simulator is there; `welcome` is its first answer."""

    def __init__(self, loop: EventLoop, connection: socket.socket, graph: Graph, welcome: dict[str, Any]) -> None:
        self._loop = loop
        self._graph = graph
        self._welcome = welcome
        self._now = int(welcome["time"])
        self._types = {topic["name"]: topic["type"] for topic in welcome["topics"]}
        self._sources = {topic["name"] for topic in welcome["topics"] if topic["publishers"]}
        self._command_names = {topic["name"] for topic in welcome["topics"] if topic["subscribers"]}
        self._services = {service["name"] for service in welcome["services"]}
        self._subscribed: dict[str, SubscribedTopic] = {}
        self._published: dict[str, PublishedTopic] = {}
        self._lockstep = bool(welcome["lockstep"])
        self._lock = threading.Lock()
        self._inbox: dict[str, deque[tuple[tuple[int, ...], bytes]]] = {}
        self._barrier = 0
        self._decoder = Decoder()
        connection.setblocking(False)
        self._connection = BufferedConnection(loop, connection, self._read, lambda: loop.stop(0))
        self._looks = 0
        loop.later(_LOOK_AFTER, self._look_after)

    def end(self, reason: str) -> None:
        """Send the client the reason of the end, and end the relay."""
        self._send(Frame(FrameKind.ENDED, payload=reason.encode()))
        self._connection.close_when_empty()
        self._loop.stop(0)

    def _look_after(self) -> None:
        """Look for awaited topics, and end if the cell has signed off, or if the graph and its clock are gone."""
        try:
            for name in self._subscribed.keys() - self._sources:
                self._sources |= {name} if self._subscribed[name].is_connected else set()
            self._looks = _MAX_LOOKS if self._graph.is_over() else 0
        except GraphGoneError:
            topic = self._subscribed.get(CLOCK)
            self._looks = self._looks + 1 if topic is not None and not topic.is_connected else 0
        if self._looks >= _MAX_LOOKS:
            self.end("the cell has ended")
        else:
            self._loop.later(_LOOK_AFTER, self._look_after)

    def _read(self, data: bytes) -> None:
        try:
            for frame in self._decoder.feed(data):
                self._act(frame)
        except FrameError as error:
            report(f"invalid data from the client: {error}")
            self._send(_refusal(0, "UsageError", str(error)))
            self._connection.close_when_empty()
            self._loop.stop(1)

    def _act(self, frame: Frame) -> None:
        acts: dict[FrameKind, Callable[[Frame], Frame | None]] = {
            FrameKind.HELLO: self._greet,
            FrameKind.SUBSCRIBE: self._subscribe,
            FrameKind.UNSUBSCRIBE: self._unsubscribe,
            FrameKind.PUBLISH: self._publish,
            FrameKind.CALL: self._call,
            FrameKind.ADVANCE: self._advance,
        }
        if frame.kind not in acts:
            raise FrameError(f"a client cannot send {frame.kind.name}")
        try:
            answer = acts[frame.kind](frame)
        except TimeStandsError as error:
            self.end(str(error))
            return
        except ServiceGoneError as error:
            self._answer_later(frame.number, str(error), time.monotonic() + PUBLISHER_TIMEOUT)
            return
        except GraphGoneError as error:
            answer = _refusal(frame.number, "ServiceFailedError", str(error))
        if answer is not None:
            self._send(answer)

    def _answer_later(self, number: int, reason: str, end: float) -> None:
        """Answer a call whose service hung up: the cell may be ending, and sign off a moment later."""
        try:
            is_over = self._graph.is_over()
        except GraphGoneError:
            is_over = True
        if is_over:
            self.end("the cell has ended")
        elif time.monotonic() > end:
            self._send(_refusal(number, "ServiceFailedError", reason))
        else:
            self._loop.later(_LOOK_AFTER / 5, lambda: self._answer_later(number, reason, end))

    def _send(self, frame: Frame) -> None:
        self._connection.send(frame.encode())

    def _greet(self, frame: Frame) -> Frame:
        if frame.json().get("encoding") != self._graph.encoding:
            return _refusal(0, "UsageError", f"this relay supports the encoding {self._graph.encoding} only")
        return Frame(FrameKind.WELCOME, payload=json.dumps(self._welcome).encode())

    def _subscribe(self, frame: Frame) -> Frame:
        topic = self._subscribed.get(frame.name)
        if topic is None:
            name = frame.name
            self._inbox[name] = deque()
            topic = self._graph.subscribe(name, self._types.get(name, ""), lambda *message: self._take(name, *message))
            self._subscribed[name] = topic
        topic.add(frame.number)
        # A topic without a publisher is awaited without limit.
        if frame.name in self._sources:
            is_connected = _wait(lambda: topic.is_connected)
            if self._lockstep and is_connected:
                self._graph.settle(topic)
        return Frame(FrameKind.DONE, frame.number)

    def _unsubscribe(self, frame: Frame) -> None:
        for topic in list(self._subscribed.values()):
            if topic.remove(frame.number) and not topic.is_wanted:
                del self._subscribed[topic.name]
                topic.close()

    def _take(self, name: str, numbers: tuple[int, ...], data: bytes) -> None:
        """Take a message, in a thread of rospy."""
        if self._lockstep:
            with self._lock:
                self._inbox[name].append((numbers, data))
        else:
            self._pass_on(numbers, data)

    def _pass_on(self, numbers: tuple[int, ...], data: bytes) -> None:
        for number in numbers:
            self._send(Frame(FrameKind.MESSAGE, number, payload=data))

    def _publish(self, frame: Frame) -> Frame | None:
        if frame.name not in self._command_names:
            known = ", ".join(sorted(self._command_names))
            return _refusal(
                frame.number, "UnknownNameError", f"unknown topic to publish on {frame.name!r} (known: {known})"
            )
        topic = self._published.get(frame.name)
        if topic is None:
            theirs = self._types.get(frame.name, frame.type)
            if theirs not in (frame.type, "", "*"):
                return _refusal(frame.number, "MessageError", f"{frame.name} takes {theirs}, not {frame.type}")
            topic = self._graph.advertise(frame.name, frame.type)
            if topic is None:
                return _refusal(frame.number, "UsageError", f"type {frame.type} is not declared")
            self._published[frame.name] = topic
        elif topic.type != frame.type:
            return _refusal(frame.number, "MessageError", f"{frame.name} takes {topic.type}, not {frame.type}")
        if not _wait(lambda: topic.is_connected):
            return _refusal(frame.number, "RejectedCommandError", f"no subscriber on {frame.name}")
        topic.publish(frame.payload)
        return Frame(FrameKind.DONE, frame.number) if frame.number else None

    def _call(self, frame: Frame) -> Frame:
        if frame.name == DECLARE:
            request = frame.json()
            self._graph.declare(str(request["type"]), request)
            return Frame(FrameKind.ANSWER, frame.number)
        if frame.name not in self._services:
            known = ", ".join(sorted(self._services))
            return _refusal(frame.number, "UnknownNameError", f"unknown service {frame.name!r} (known: {known})")
        if self._lockstep and self._barrier != self._count():
            # The call must not overtake earlier messages.
            self._step(0)
        # in lockstep no time passes during this wait: a service that needs some would never answer
        succeeded, payload = self._graph.call(frame.name, frame.payload, PUBLISHER_TIMEOUT if self._lockstep else None)
        if succeeded:
            return Frame(FrameKind.ANSWER, frame.number, payload=payload)
        if not payload:
            return _refusal(frame.number, "ServiceFailedError", f"{frame.name} gave no answer")
        return _refusal(frame.number, "RejectedCommandError", payload.decode(errors="replace"))

    def _advance(self, frame: Frame) -> Frame:
        until, each_tick = read_advance(frame)
        if not self._lockstep:
            return _refusal(
                frame.number, "UsageError", "ADVANCE requires lockstep; time advances without requests here"
            )
        while self._now < until:
            if self._step(1) or each_tick:  # a nanosecond: advances to the next tick
                break
        return time_frame(frame.number, self._now)

    def _step(self, duration: int) -> bool:
        """Advance time [ns], and deliver what arrived; True if there was anything. A TimeStandsError if it fails."""
        published = {topic.name: topic.published for topic in self._published.values()}
        self._barrier = self._count()
        try:
            failure, now, sent = self._graph.step(duration, published)
        except (ServiceGoneError, GraphGoneError) as error:
            raise TimeStandsError(f"the cell has ended: {error}") from None
        if failure:
            raise TimeStandsError(f"time cannot advance: {failure}")
        self._now = now
        for name, count in sent:
            topic = self._subscribed.get(name)
            if topic is not None and not topic.wait_for(count, PUBLISHER_TIMEOUT):
                raise TimeStandsError(f"messages on {name} are missing after {PUBLISHER_TIMEOUT:g} s")
        return self._deliver([name for name, _ in sent])

    def _deliver(self, order: list[str]) -> bool:
        """Deliver received messages, in the order of the topics' newest ones; return whether there were any."""
        has_messages = False
        # The step names topics by their newest message; those that it does not name carry none of this tick.
        for name in (*(name for name in self._inbox if name not in order), *order):
            with self._lock:
                queue = self._inbox.get(name)
                messages = list(queue) if queue else []
                if queue:
                    queue.clear()
            for numbers, data in messages:
                has_messages = has_messages or bool(numbers)
                self._pass_on(numbers, data)
        return has_messages

    def _count(self) -> int:
        return sum(topic.published for topic in self._published.values())


def _refusal(number: int, error: str, reason: str) -> Frame:
    return Frame(FrameKind.REFUSED, number, name=error, payload=reason.encode())


def _wait(condition: Callable[[], bool]) -> bool:
    """Wait for a connection, for `PUBLISHER_TIMEOUT` at most; return whether there is one."""
    end = time.monotonic() + PUBLISHER_TIMEOUT
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(_NAP)
    return True


def serve_one(loop: EventLoop, graph: Graph, welcome: dict[str, Any]) -> int:
    """Print `ready PORT`, wait there for a client, and serve it; return the exit status."""
    loop.watch(sys.stdin, lambda: loop.stop(0) if not os.read(0, 4096) else None)
    listener = socket.create_server(("127.0.0.1", 0))

    def accept() -> None:
        connection, _ = listener.accept()
        loop.forget(listener)
        listener.close()
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        Relay(loop, connection, graph, welcome)

    loop.watch(listener, accept)
    report_ready(str(listener.getsockname()[1]))
    return loop.run()
