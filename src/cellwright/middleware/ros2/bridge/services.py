"""Services of the bridge: calls forwarded to the cell, and lockstep time as a service.

ROS 2 has no way to fail a call. If the cell refuses a request or gives no answer, the caller gets a response with
`success` false and the reason. A type without such fields has its defaults then. The cell reports what it refuses, and
the bridge a service without an answer.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from rclpy.serialization import deserialize_message

from cellwright.middleware.ros2.bridge.interfaces import fill, interface_class, is_values
from cellwright.middleware.ros2.bridge.node import RosNode, relative
from cellwright.middleware.ros2.bridge.receiver import Respond
from cellwright.middleware.ros2.bridge.topics import CommandTopic, Publication, as_bytes
from cellwright.middleware.wire.call_queue import MAX_WAITING_CALLS, CallQueue
from cellwright.middleware.wire.command_queue import MESSAGE_TIMEOUT, Step, StepQueue, refusal_line
from cellwright.middleware.wire.connection import LinkClient
from cellwright.middleware.wire.event_loop import EventLoop, ThrottledLog, nothing
from cellwright.middleware.wire.frames import Frame, FrameError, FrameKind

STEP_SERVICE, STEP_TYPE = "/cellwright/step", "cellwright_msgs/Step"
NO_ANSWER = "ServiceFailedError"  # error of a service without an answer
NANOSECONDS = 1_000_000_000
_NAP = 0.002  # [s]


class CellCalls:
    """Calls of the cell's services, and of those of its server, as a node `sender`; from any thread."""

    def __init__(self, link: LinkClient, sender: str) -> None:
        self._link = link
        self._sender = sender
        self._queue = CallQueue()
        self.before_answer: Callable[[], object] = nothing
        """Called before an answer of the standard's services is sent."""

    def ask(self, name: str, type_name: str, request: bytes, answered: Callable[[Frame], None]) -> None:
        """Call a service; `answered` gets the frame ANSWER or REFUSED, usually in the thread of the loop."""

        def heard(frame: Frame) -> None:
            # In lockstep: it takes time, which other callers may advance.
            if frame.kind is FrameKind.DONE:
                self._link.ask_again(frame.number, heard)
            else:
                self._queue.note_answer(name)
                answered(frame)

        def send() -> None:
            try:
                self._link.request(FrameKind.CALL, heard, name=name, type=type_name, node=self._sender, payload=request)
            except FrameError as error:
                heard(Frame(FrameKind.REFUSED, payload=str(error).encode()))

        if not self._queue.add(name, len(request), send):
            reason = f"too many calls of {name} wait (at most {MAX_WAITING_CALLS}); wait for answers"
            answered(Frame(FrameKind.REFUSED, payload=reason.encode()))


class CellService:
    """Service of the cell, served in ROS 2 under each of `names`."""

    def __init__(
        self, ros: RosNode, loop: EventLoop, calls: CellCalls, service: Mapping[str, Any], names: Sequence[str]
    ) -> None:
        self._name: str = service["name"]
        self._type: str = service["type"]
        self._calls = calls
        self._class = interface_class(self._type, "srv")
        self._failures = ThrottledLog(loop, "{count} x {subject}")
        self._log = ros.log
        for name in names:
            ros.receiver.serve(self._class, relative(name), partial(self._serve, ros.full_service_name(name)))

    def _serve(self, name: str, request: Any, respond: Respond) -> None:
        data = as_bytes(request, self._type)
        self._calls.ask(self._name, self._type, data, lambda answer: respond(self._response(name, answer)))

    def _response(self, name: str, answer: Frame) -> Any:
        if line := refusal_line(answer, name):
            self._log(line)
        if answer.kind is not FrameKind.ANSWER:
            return self._failed(self._class.Response(), answer)
        if is_values(self._type):
            return fill(self._class.Response(), json.loads(answer.payload))
        return deserialize_message(answer.payload, self._class.Response)

    def _failed(self, response: Any, answer: Frame) -> Any:
        reason = " ".join(answer.text().split())
        if answer.name == NO_ANSWER:
            self._failures.count(f"{self._name} gave no answer: {reason}")
        fields = response.get_fields_and_field_types()
        if fields.get("success") == "boolean":
            response.success = False
        if fields.get("message") == "string":
            response.message = reason
        return response


class StepService:
    """Service that lets time pass in lockstep, after the caller's messages.

    A request names topics with numbers. For one that the cell receives it is the number of messages that the cell must
    have: those before the caller's first, and the caller's. For one that the cell publishes it is the number of
    subscribers that must be known, so that they miss nothing.

    A response names each topic with the number of its messages so far: those that were published, which subscribers
    find as the sequence number of a message, and those that the cell has received.
    """

    def __init__(
        self,
        ros: RosNode,
        loop: EventLoop,
        steps: StepQueue,
        sender: str,
        commands: Mapping[str, CommandTopic],
        publications: Mapping[str, Publication],
        sent: Mapping[str, int],
    ) -> None:
        self._loop = loop
        self._steps = steps
        self._sender = sender
        self._commands = commands
        self._publications = publications
        self._sent = sent
        self._class = interface_class(STEP_TYPE, "srv")
        ros.receiver.serve(self._class, relative(STEP_SERVICE), self._serve)

    def _serve(self, request: Any, respond: Respond) -> None:
        duration = request.duration.sec * NANOSECONDS + request.duration.nanosec
        names, counts = list(request.topics), [int(each) for each in request.published]
        if counts and len(counts) != len(names):
            reason = f"topics and published must have the same length (got {len(names)} and {len(counts)})"
            respond(self._class.Response(message=reason))
            return
        for name in names:
            if name in self._commands and self._commands[name].count_publishers() > 1:
                reason = f"{name} has several publishers; in lockstep one node commands a topic"
                respond(self._class.Response(message=reason))
                return
        wanted = dict(zip(names, counts or [0] * len(names), strict=True))
        subscribed = {name: wanted.pop(name) for name in names if name in self._publications}
        end = time.monotonic() + MESSAGE_TIMEOUT

        def begin() -> None:
            """Begin the step once these numbers of subscribers are known."""
            late = [name for name, count in subscribed.items() if not self._publications[name].is_ready_for(count)]
            if not late:
                self._steps.add(Step(self._sender, duration, wanted, finished))
            elif time.monotonic() > end:
                reason = f"subscribers of {late[0]} are not known within {MESSAGE_TIMEOUT:g} s"
                respond(self._class.Response(message=reason))
            else:
                self._loop.later(_NAP, begin)

        def finished(failure: str, now: int) -> None:
            response = self._class.Response(success=not failure, message=failure)
            response.time.sec, response.time.nanosec = divmod(now, NANOSECONDS)
            sent = self._counts()
            response.topics, response.sent = [name for name, _ in sent], [count for _, count in sent]
            respond(response)

        self._loop.call(begin)

    def _counts(self) -> list[tuple[str, int]]:
        received = ((name, topic.handed_over(self._sender)) for name, topic in self._commands.items())
        return [*received, *self._sent.items()]
