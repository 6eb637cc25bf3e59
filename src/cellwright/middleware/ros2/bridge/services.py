"""Services of the bridge: calls forwarded to the cell, and lockstep time as a service.

ROS 2 has no way to fail a call. If the cell refuses a request or gives no answer, the caller gets a response with
`success` false and the reason. A type without such fields has its defaults then. The cell reports what it refuses, and
the bridge a service without an answer.
"""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from typing import Any

from rclpy.serialization import deserialize_message

from cellwright.middleware.ros2.bridge.interfaces import fill, interface_class, is_values
from cellwright.middleware.ros2.bridge.node import RosNode, relative
from cellwright.middleware.ros2.bridge.topics import CommandTopic, Publication, as_bytes
from cellwright.middleware.wire.command_queue import MESSAGE_TIMEOUT, Step, StepQueue
from cellwright.middleware.wire.connection import LinkClient
from cellwright.middleware.wire.event_loop import EventLoop, ThrottledLog
from cellwright.middleware.wire.frames import Frame, FrameError, FrameKind

STEP_SERVICE, STEP_TYPE = "/cellwright/step", "cellwright_msgs/Step"
NO_ANSWER = "ServiceFailedError"  # error of a service without an answer
NANOSECONDS = 1_000_000_000
_NAP = 0.002  # [s]


class CellCall:
    """Calls of the cell's services from a coroutine of the executor."""

    def __init__(self, ros: RosNode, link: LinkClient, node: str) -> None:
        self._ros = ros
        self._link = link
        self._node = node

    async def ask(self, name: str, type_name: str, request: bytes) -> Frame:
        """Return the frame that answers a call: ANSWER or REFUSED."""
        future, resolve = self._ros.awaited()

        def answered(frame: Frame) -> None:
            if frame.kind is FrameKind.DONE:  # in lockstep: it takes time, which other callers may advance
                self._link.ask_again(frame.number, answered)
            else:
                resolve(frame)

        try:
            self._link.request(FrameKind.CALL, answered, name=name, type=type_name, node=self._node, payload=request)
        except FrameError as error:
            return Frame(FrameKind.REFUSED, payload=str(error).encode())
        answer: Frame = await future
        return answer


class CellService:
    """Service of the cell, served in ROS 2 under each of `names`."""

    def __init__(
        self, ros: RosNode, loop: EventLoop, calls: CellCall, service: Mapping[str, Any], names: Sequence[str]
    ) -> None:
        self._name: str = service["name"]
        self._type: str = service["type"]
        self._calls = calls
        self._class = interface_class(self._type, "srv")
        self._failures = ThrottledLog(loop, "{count} x {subject}")
        self._services = [
            ros.node.create_service(self._class, relative(name), self._serve, callback_group=ros.group)
            for name in names
        ]

    async def _serve(self, request: Any, response: Any) -> Any:
        answer = await self._calls.ask(self._name, self._type, as_bytes(request, self._type))
        if answer.kind is FrameKind.ANSWER:
            if is_values(self._type):
                return fill(response, json.loads(answer.payload))
            return deserialize_message(answer.payload, self._class.Response)
        return self._failed(response, answer)

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
        self._ros = ros
        self._loop = loop
        self._steps = steps
        self._sender = sender
        self._commands = commands
        self._publications = publications
        self._sent = sent
        self._class = interface_class(STEP_TYPE, "srv")
        self._service = ros.node.create_service(
            self._class, relative(STEP_SERVICE), self._serve, callback_group=ros.group
        )

    async def _serve(self, request: Any, response: Any) -> Any:
        duration = request.duration.sec * NANOSECONDS + request.duration.nanosec
        names, counts = list(request.topics), [int(each) for each in request.published]
        if counts and len(counts) != len(names):
            response.message = f"topics and published must have the same length (got {len(names)} and {len(counts)})"
            return response
        for name in names:
            if name in self._commands and self._commands[name].count_publishers() > 1:
                response.message = f"{name} has several publishers; in lockstep one node commands a topic"
                return response
        wanted = dict(zip(names, counts or [0] * len(names), strict=True))
        subscribed = {name: wanted.pop(name) for name in names if name in self._publications}
        if late := await self._known(subscribed):
            response.message = f"subscribers of {late} are not known within {MESSAGE_TIMEOUT:g} s"
            return response
        future, resolve = self._ros.awaited()
        step = Step(self._sender, duration, wanted, lambda failure, now: resolve((failure, now, self._counts())))
        self._loop.call(self._steps.add, step)
        failure, now, sent = await future
        response.success, response.message = not failure, failure
        response.time.sec, response.time.nanosec = divmod(now, NANOSECONDS)
        response.topics, response.sent = [name for name, _ in sent], [count for _, count in sent]
        return response

    async def _known(self, subscribed: dict[str, int]) -> str:
        """Wait until these numbers of subscribers are known; return a topic of which they are not, or ""."""
        if not subscribed:
            return ""
        future, resolve = self._ros.awaited()
        end = time.monotonic() + MESSAGE_TIMEOUT

        def look() -> None:
            late = [name for name, count in subscribed.items() if not self._publications[name].is_ready_for(count)]
            if not late or time.monotonic() > end:
                resolve(late[0] if late else "")
            else:
                self._loop.later(_NAP, look)

        self._loop.call(look)
        late: str = await future
        return late

    def _counts(self) -> list[tuple[str, int]]:
        received = ((name, topic.handed_over(self._sender)) for name, topic in self._commands.items())
        return [*received, *self._sent.items()]
