"""Topics of the bridge: publications of the cell in ROS, and ROS commands to the cell.

The bridge subscribes to a topic of the cell only while it has a subscriber in ROS, since building messages costs time.
To topics with single events, such as orders, it subscribes all the time. All of this belongs to the loop's thread:
there is no race between new subscribers and messages, so that each gets the latched message once, and nothing twice.

A subscriber's handshake is answered when the cell has answered the bridge's own subscription, and so after latched
messages have come. In lockstep a program connects to one topic after another, and gets latched messages in that order,
even if a topic had other subscribers before.
"""

from __future__ import annotations

import itertools
import socket
import struct
from typing import Any

import rospy
from rospy.impl.registration import Registration

from cellwright.middleware.ros1.bridge.message_bytes import DeliveryCounter, has_header
from cellwright.middleware.ros1.bridge.node import ManagedTopic
from cellwright.middleware.ros1.bridge.tcpros import ANY, Header, handshake_bytes, raw_type
from cellwright.middleware.wire.command_queue import CommandQueue
from cellwright.middleware.wire.connection import BufferedConnection, LinkClient
from cellwright.middleware.wire.event_loop import EventLoop, ThrottledLog
from cellwright.middleware.wire.frames import Frame
from cellwright.middleware.wire.quiet_clock import QuietClock

PUBLICATION_QUEUE = 1000
"""Messages that may wait for a subscriber that does not read; then the oldest is dropped."""
MAX_PUBLICATION_BYTES = 64 << 20  # bytes of them: pictures are large
LOCKSTEP_QUEUE = 1_000_000  # the same number in lockstep, where nothing must be lost
_PREFIX, _STAMP = struct.Struct("<I"), struct.Struct("<II")
_COUNTED = struct.Struct("<II")
_identities = itertools.count(1)


class Publication(ManagedTopic):
    """Published topic from WELCOME, for rospy's topic manager and the TCPROS server.

    With a `node` it carries only messages of that node in the cell. In lockstep `sent` counts messages to callers.
    """

    def __init__(
        self,
        loop: EventLoop,
        link: LinkClient,
        topic: dict[str, Any],
        *,
        node: str = "",
        sent: DeliveryCounter | None = None,
    ) -> None:
        super().__init__(Registration.PUB, topic["name"], topic["type"])
        self._loop = loop
        self._link = link
        self._node = node
        self._sent = sent
        self._has_header = has_header(topic["definition"])
        self._always = bool(topic["on_event"] and topic["latch"])
        self._latch = bool(topic["latch"])
        self._newest: bytes | None = None
        self._count = 0
        self._peers: list[Peer] = []
        self._waiting: list[Peer] = []  # without an answer to their handshakes yet
        self._subscription: int | None = None
        self._is_answered = False  # true if the cell has answered the subscription
        self._drops = ThrottledLog(loop, "subscriber {subject} is too slow: {count} messages dropped")
        self.md5sum = topic["md5"]
        self.definition = topic["definition"]
        if self._always:
            self._listen()

    def take(self, connection: socket.socket, header: Header) -> str | None:
        """Accept a subscriber, which gets a latched message at once; else return the reason."""
        for field, mine in (("type", self.type), ("md5sum", self.md5sum)):
            theirs = header.get(field, ANY)
            if theirs not in (ANY, mine):
                return f"{self.name} has {field} {mine}, not {theirs}"
        peer = Peer(
            self,
            self._loop,
            connection,
            header["callerid"],
            PUBLICATION_QUEUE if self._sent is None else LOCKSTEP_QUEUE,
        )
        if self._subscription is None:
            self._listen()
        self._waiting.append(peer)
        if self._is_answered:
            self._welcome()
        return None

    @property
    def is_behind(self) -> bool:
        """True if messages wait for a subscriber that reads."""
        return any(peer.connection.is_behind for peer in self._peers)

    def lost(self, peer: Peer) -> None:
        """Forget a subscriber that has gone."""
        if peer in self._waiting:
            self._waiting.remove(peer)
        elif peer in self._peers:
            self._peers.remove(peer)
            if self._sent is not None and all(other.caller != peer.caller for other in self._peers):
                self._sent.end(peer.caller, self.name)
        if not (self._peers or self._waiting or self._always) and self._subscription is not None:
            self._link.unsubscribe(self._subscription)
            self._subscription = None
            self._newest = None  # it would be outdated for the next subscriber

    def dropped(self, peer: Peer) -> None:
        """Count a message that was dropped because a subscriber is too slow."""
        self._drops.count(f"{peer.caller} on {self.name}")

    def _listen(self) -> None:
        self._is_answered = False
        self._subscription = self._link.subscribe(self.name, self._node, self._publish, self._answered)

    def _answered(self, answer: Frame) -> None:
        # The answer of an ended subscription has another number.
        if answer.number == self._subscription:
            self._is_answered = True
            self._welcome()

    def _welcome(self) -> None:
        """Answer the handshakes of waiting subscribers; each gets a latched message at once."""
        waiting, self._waiting = self._waiting, []
        header = {
            "topic": self.name,
            "type": self.type,
            "md5sum": self.md5sum,
            "message_definition": self.definition,
            "latching": "1" if self._latch else "0",
            "callerid": rospy.get_name(),
        }
        for peer in waiting:
            self._peers.append(peer)
            if self._sent is not None:
                self._sent.begin(peer.caller, self.name)
            peer.connection.send(handshake_bytes(header))
            if self._newest is not None:
                self._give(peer, self._newest)

    def _publish(self, payload: bytes) -> None:
        if self._has_header:  # it begins with the message's number, which only its publisher knows
            data = _COUNTED.pack(len(payload), self._count) + payload[4:]
            self._count = (self._count + 1) & 0xFFFFFFFF
        else:
            data = _PREFIX.pack(len(payload)) + payload
        if self._latch:
            self._newest = data
        for peer in self._peers:
            self._give(peer, data)

    def _give(self, peer: Peer, data: bytes) -> None:
        peer.connection.send(data)
        peer.messages += 1
        peer.bytes += len(data)
        if self._sent is not None:
            self._sent.count(peer.caller, self.name)

    def get_stats_info(self) -> list[Any]:
        """Return the connections, for `rosnode info`."""
        return [
            (peer.identity, peer.caller, "o", "TCPROS", self.name, True, peer.description)
            for peer in tuple(self._peers)
        ]

    def get_stats(self) -> Any:
        """Return the amount of sent data, for the slave API's getBusStats."""
        peers = tuple(self._peers)
        total = sum(peer.bytes for peer in peers)
        return self.name, total, [(peer.identity, peer.bytes, peer.messages, True) for peer in peers]


class ClockPublication(Publication):
    """Simulation time, again and again while it stands; in lockstep a plain `Publication` has each tick's."""

    def __init__(self, loop: EventLoop, link: LinkClient, topic: dict[str, Any], **more: Any) -> None:
        super().__init__(loop, link, topic, **more)
        self._quiet = QuietClock(link, self._repeat, lambda: bool(self._peers))

    def _publish(self, payload: bytes) -> None:
        self._quiet.note()
        super()._publish(payload)

    def _repeat(self, time: int) -> None:
        super()._publish(_STAMP.pack(*divmod(time, 1_000_000_000)))


class Peer:
    """Connection of a subscriber, for which `queue` messages may wait."""

    def __init__(
        self, publication: Publication, loop: EventLoop, connection: socket.socket, caller: str, queue: int
    ) -> None:
        self.caller = caller
        self.identity = next(_identities)
        self.messages = 0
        self.bytes = 0
        self.description = _describe_connection(connection)
        # A subscriber sends nothing and only hangs up.
        self.connection = BufferedConnection(
            loop,
            connection,
            on_end=lambda: publication.lost(self),
            limit=queue,
            max_bytes=MAX_PUBLICATION_BYTES if queue == PUBLICATION_QUEUE else None,
            on_drop=lambda: publication.dropped(self),
        )


def _describe_connection(connection: socket.socket) -> str:
    """Return the text of a connection that `rosnode info` reads."""
    try:
        here, there = connection.getsockname(), connection.getpeername()
    except OSError:
        return ""
    return f"TCPROS connection on port {here[1]} to [{there[0]}:{there[1]} on socket {connection.fileno()}]"


class CommandTopic(CommandQueue):
    """Command topic from WELCOME, subscribed to in ROS. Messages come in rospy's threads, one for each publisher."""

    def __init__(self, loop: EventLoop, link: LinkClient, topic: dict[str, Any], **more: Any) -> None:
        super().__init__(loop, link, topic["name"], topic["type"], **more)
        data_class = raw_type(topic["type"], topic["md5"], topic["definition"])
        self._subscriber = rospy.Subscriber(self.name, data_class, self._take, tcp_nodelay=True)

    def _take(self, message: Any) -> None:
        header: Header = message._connection_header
        self.take(header.get("callerid", ""), message.data, header)
