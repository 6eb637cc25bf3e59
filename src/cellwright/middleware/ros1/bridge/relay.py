"""Relay between a client without rospy and a cell in ROS 1; run by the path of this file under the python3 with rospy.

It waits for a simulator, and then prints `ready PORT`: one client may connect there, and use the protocol of a cell
(`cellwright.middleware.wire.frames`). It ends when the client hangs up, when its stdin is closed, or when the simulator
has ended. A simulator is present while /clock has a publisher, or another topic that an option names as its sign.
"""

from __future__ import annotations

import argparse
import json
import os
import socket
import sys
import threading
import time
import types
from collections import deque
from pathlib import Path
from typing import Any, Callable

if __name__ == "__main__":
    # Cellwright and its dependencies are not installed here: load only these parts of it.
    sys.path[:] = [folder for folder in sys.path if folder != str(Path(__file__).parent)]
    cellwright = types.ModuleType("cellwright")
    cellwright.__path__ = [str(Path(__file__).resolve().parents[3])]
    sys.modules["cellwright"] = cellwright

import rospy

from cellwright.middleware.ros1.bridge.message_bytes import read_step_response, step_request
from cellwright.middleware.ros1.bridge.node import (
    Master,
    MasterGoneError,
    begin_node,
    limit_messages,
    listen_on_loopback,
    run_process,
    stop_by,
)
from cellwright.middleware.ros1.bridge.ros_client import (
    CLOCK,
    PublishedTopic,
    ServiceClient,
    ServiceGoneError,
    SubscribedTopic,
    discover_interface,
)
from cellwright.middleware.ros1.bridge.services import STEP_SERVICE as STEP
from cellwright.middleware.ros1.bridge.tcpros import raw_type
from cellwright.middleware.wire.connection import BufferedConnection
from cellwright.middleware.wire.event_loop import EventLoop, MissingError, ThrottledLog, report, report_ready
from cellwright.middleware.wire.frames import (
    MAX_FRAME_BYTES,
    Decoder,
    Frame,
    FrameError,
    FrameKind,
    read_advance,
    time_frame,
)

DECLARE = "relay:type"
"""Service of the relay itself: the client declares a type that it will publish, as JSON: type, md5, definition."""

PUBLISHER_TIMEOUT = 5.0  # time for connections to be established, and for messages to arrive [s]
_NAP = 0.002
_SIMULATOR_NAP = 0.05
_LOOK_AFTER = 0.5
_MAX_LOOKS = 10
_CLOCK_BYTES = 8


class TimeStandsError(Exception):
    """Lockstep time cannot advance any more; the text has the reason."""


class Relay:
    """Server of one client, as long as the topic `sign` has a publisher; `welcome` is its first answer."""

    def __init__(
        self,
        loop: EventLoop,
        connection: socket.socket,
        master: Master,
        node: str,
        welcome: dict[str, Any],
        sign: str = CLOCK,
    ) -> None:
        self._loop = loop
        self._master = master
        self._node = node
        self._welcome = welcome
        self._sign = sign
        self._now = int(welcome["time"])
        self._types = {topic["name"]: topic["type"] for topic in welcome["topics"]}
        self._command_names = {topic["name"] for topic in welcome["topics"] if topic["subscribers"]}
        self._services = {
            service["name"]: ServiceClient(master, node, service["name"], service["md5"])
            for service in welcome["services"]
        }
        self._definitions: dict[str, dict[str, str]] = {}
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
        """Check that the cell still exists; end if it has signed off, or if master and sign are gone."""
        try:
            self._looks = _MAX_LOOKS if is_simulator_gone(self._master, self._sign) else 0
        except MasterGoneError:
            topic = self._subscribed.get(self._sign)
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
        except MasterGoneError as error:
            answer = _refusal(frame.number, "ServiceFailedError", str(error))
        if answer is not None:
            self._send(answer)

    def _answer_later(self, number: int, reason: str, end: float) -> None:
        """Answer a call whose service hung up: the cell may be ending, and sign off a moment later."""
        try:
            is_over = is_simulator_gone(self._master, self._sign)
        except MasterGoneError:
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
        if frame.json().get("encoding") != "ros1":
            return _refusal(0, "UsageError", "a relay supports the encoding ros1 only")
        return Frame(FrameKind.WELCOME, payload=json.dumps(self._welcome).encode())

    def _subscribe(self, frame: Frame) -> Frame:
        topic = self._subscribed.get(frame.name)
        if topic is None:
            name = frame.name
            self._inbox[name] = deque()
            topic = SubscribedTopic(name, self._types.get(name, ""), lambda *message: self._take(name, *message))
            self._subscribed[name] = topic
        topic.add(frame.number)
        if self._types.get(frame.name):  # an unknown topic is awaited without limit
            _wait(lambda: topic.is_connected)
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
            theirs, known_type = self._types.get(frame.name, frame.type), self._definitions.get(frame.type)
            if theirs not in (frame.type, "", "*"):
                return _refusal(frame.number, "MessageError", f"{frame.name} takes {theirs}, not {frame.type}")
            if known_type is None:
                return _refusal(frame.number, "UsageError", f"type {frame.type} is not declared")
            topic = PublishedTopic(frame.name, frame.type, known_type["md5"], known_type["definition"])
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
            self._definitions[str(request["type"])] = {key: str(request[key]) for key in ("md5", "definition")}
            return Frame(FrameKind.ANSWER, frame.number)
        service = self._services.get(frame.name)
        if service is None:
            known = ", ".join(sorted(self._services))
            return _refusal(frame.number, "UnknownNameError", f"unknown service {frame.name!r} (known: {known})")
        if self._lockstep and self._barrier != self._count():
            self._step(0)  # the call must not overtake earlier messages
        # in lockstep no time passes during this wait: a service that needs some would never answer
        succeeded, payload = service.call(frame.payload, PUBLISHER_TIMEOUT if self._lockstep else None)
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
            succeeded, data = self._services[STEP].call(step_request(duration, published))
        except (ServiceGoneError, MasterGoneError) as error:
            raise TimeStandsError(f"the cell has ended: {error}") from None
        failure, now, sent = read_step_response(data) if succeeded else (data.decode(errors="replace"), 0, [])
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


def is_simulator_gone(master: Master, sign: str = CLOCK) -> bool:
    """True if the topic /clock, or another sign, has no publisher any more."""
    state = master.ask("getSystemState")
    return state is not None and all(name != sign for name, _ in state[0])


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


def serve(node: str, timeout: float, sign: str) -> int:
    """Wait for a simulator, for `timeout` [s] at most, then for a client, and serve it; return the exit status."""
    listen_on_loopback()
    loop = EventLoop()
    loop.watch(sys.stdin, lambda: loop.stop(0) if not os.read(0, 4096) else None)
    end = time.monotonic() + timeout
    master = Master(node)
    master.wait(timeout)
    welcome = _wait_for_simulator(master, node, end, sign)
    tally = ThrottledLog(loop, "{count} messages on {subject} dropped: too long")
    limit_messages(tally.count, MAX_FRAME_BYTES // 2)
    begin_node(node)
    rospy.on_shutdown(lambda: loop.stop(0))
    welcome["time"] = _time(master, node, welcome, end)
    listener = socket.create_server(("127.0.0.1", 0))
    loop.watch(listener, lambda: _accept(loop, listener, master, node, welcome, sign))
    loop.wake_by_signals()
    stop_by(lambda: loop.stop(0))
    report_ready(str(listener.getsockname()[1]))
    return loop.run()


def _accept(
    loop: EventLoop, listener: socket.socket, master: Master, node: str, welcome: dict[str, Any], sign: str
) -> None:
    """Accept the one client."""
    connection, _ = listener.accept()
    loop.forget(listener)
    listener.close()
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    Relay(loop, connection, master, node, welcome, sign)


def _wait_for_simulator(master: Master, node: str, end: float, sign: str) -> dict[str, Any]:
    while True:
        welcome = discover_interface(master, node, sign)
        if welcome is not None:
            return welcome
        if time.monotonic() > end:
            raise MissingError(f"no simulator at {master.uri}: {sign} has no publisher")
        time.sleep(_SIMULATOR_NAP)


def _time(master: Master, node: str, welcome: dict[str, Any], end: float) -> int:
    """Return simulation time [ns]; 0 if it has no publisher."""
    if welcome["lockstep"]:
        try:
            _, data = ServiceClient(master, node, STEP).call(step_request(0, {}))
        except ServiceGoneError as error:
            raise MissingError(str(error)) from None
        return read_step_response(data)[1]
    if not any(topic["name"] == CLOCK and topic["direction"] == "out" for topic in welcome["topics"]):
        return 0
    clocks: list[bytes] = []
    subscriber = rospy.Subscriber(CLOCK, raw_type("rosgraph_msgs/Clock"), lambda message: clocks.append(message.data))
    while not clocks:
        if time.monotonic() > end:
            raise MissingError(f"simulation time stands still: no message on {CLOCK}")
        time.sleep(_SIMULATOR_NAP / 10)
    subscriber.unregister()
    data = clocks[-1][:_CLOCK_BYTES]
    return int.from_bytes(data[:4], "little") * 1_000_000_000 + int.from_bytes(data[4:], "little")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="relay", description="Connect a client to a cell in ROS 1.")
    parser.add_argument("--node", metavar="/NODE", default="/agent", help="name of the client's node (%(default)s)")
    parser.add_argument(
        "--wait", metavar="S", type=float, default=30.0, help="timeout for a simulator to appear (%(default)s)"
    )
    parser.add_argument(
        "--sign", metavar="/TOPIC", default=CLOCK, help="topic that a present simulator publishes (%(default)s)"
    )
    options = parser.parse_args()
    run_process(lambda: serve(options.node, options.wait, options.sign))
