"""Topics that the cell hears: each message goes over the link under the name of the node that published it.

The cell carries commands out at its own pace. Of each topic one message is with the cell, the others wait here: up to a
number, beyond which the oldest is dropped and counted.
"""

from __future__ import annotations

import threading
from collections import deque
from typing import Any, Callable

import rospy

from cellwright.middleware.ros1.bridge.link_client import LinkClient
from cellwright.middleware.ros1.bridge.loop import Loop
from cellwright.middleware.ros1.bridge.raw_types import raw_type
from cellwright.middleware.ros1.bridge.tally import Tally
from cellwright.middleware.ros1.bridge.tcpros import Header
from cellwright.middleware.wire.frames import Frame, FrameError, Kind

QUEUE = 100
"""So many messages of a topic wait for the cell."""
MOST_BYTES = 64 << 20
"""So many bytes of them at most, also where their number has no limit."""


class CommandTopic:
    """One topic, subscribed to in ROS. Messages come in rospy's threads, one for each publisher.

    Args:
        loop: counts what is dropped.
        link: the way to the cell.
        topic: what WELCOME said of it.
        queue: so many messages may wait; None for no limit.
        on_handed_over: called when a message has been given to the cell, and then messages are counted; in lockstep.
    """

    def __init__(
        self,
        loop: Loop,
        link: LinkClient,
        topic: dict[str, Any],
        *,
        queue: int | None = QUEUE,
        on_handed_over: Callable[[], None] | None = None,
    ) -> None:
        self._link = link
        self._queue = queue
        self._on_handed_over = on_handed_over
        self._lock = threading.Lock()
        self._waiting: deque[tuple[Header, bytes]] = deque()
        self._bytes = 0
        self._is_busy = False
        self._counts: dict[str, tuple[Header, int]] = {}
        self._tally = Tally(loop, "{count} messages on {subject} dropped: they come faster than they are taken")
        self._unfit = Tally(loop, "{count} messages on {subject} are too long to be carried, and not taken")
        self.name = topic["name"]
        self._type = topic["type"]
        data_class = raw_type(topic["type"], topic["md5"], topic["definition"])
        self._subscriber = rospy.Subscriber(self.name, data_class, self._take, tcp_nodelay=True)

    def handed_over(self, caller: str) -> int:
        """How many messages of a node have been given to the cell since it connected; in lockstep."""
        with self._lock:
            _, count = self._counts.get(caller, ({}, 0))
            return count

    def _take(self, message: Any) -> None:
        with self._lock:
            dropped = 0
            while self._waiting and self._is_full(len(message.data)):
                header, data = self._waiting.popleft()
                self._bytes -= len(data)
                self._count(header)  # in lockstep time must not wait for it
                dropped += 1
            self._waiting.append((message._connection_header, message.data))
            self._bytes += len(message.data)
            if not self._is_busy:
                self._hand_over()
        for _ in range(dropped):
            self._tally.count(self.name)

    def _is_full(self, more: int) -> bool:
        """Whether there is no room for a message of so many bytes."""
        is_crowded = self._queue is not None and len(self._waiting) >= self._queue
        return is_crowded or self._bytes + more > MOST_BYTES

    def _hand_over(self) -> None:
        """Give the cell the message that has waited longest; under the lock."""
        while self._waiting:
            header, data = self._waiting.popleft()
            self._bytes -= len(data)
            caller = header.get("callerid", "")
            try:
                self._link.request(
                    Kind.PUBLISH, self._answered, name=self.name, type=self._type, node=caller, payload=data
                )
            except FrameError:
                self._count(header)
                self._unfit.count(self.name)
                continue
            self._is_busy = True
            self._count(header)
            return
        self._is_busy = False

    def _count(self, header: Header) -> None:
        """Count a message of a node as done with; in lockstep."""
        if self._on_handed_over is not None:
            caller = header.get("callerid", "")
            before, count = self._counts.get(caller, (header, 0))
            self._counts[caller] = (header, count + 1 if before is header else 1)
            self._on_handed_over()

    def _answered(self, _frame: Frame) -> None:
        """The cell is done with one; that it was refused, and why, the cell says itself."""
        with self._lock:
            self._is_busy = False
            self._hand_over()
