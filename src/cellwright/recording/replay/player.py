"""What says again what was recorded, each message at its time."""

from __future__ import annotations

from collections.abc import Iterator

from cellwright.engine.device import Device
from cellwright.middleware.bus import Bus, Publisher
from cellwright.middleware.messages import Message, from_cdr, message_type
from cellwright.recording.format.format import FRAME, PANEL, RecordedTopic
from cellwright.recording.format.reader import RecordedMessage
from cellwright.recording.replay.sight import Sight
from cellwright.recording.replay.source import Source
from cellwright.util.errors import CellwrightError, MessageError

_NOTHING = RecordedMessage("", 1 << 62, b"")  # later than any time


class Player(Device):
    """Publishes the messages of a recording as simulation time comes to them.

    A message is read only when somebody listens, or will be given it for being the newest.

    Args:
        source: what is played.
        bus: where the recorded topics are advertised and their messages published.
    """

    def __init__(self, source: Source, bus: Bus) -> None:
        super().__init__("player")
        self._source = source
        self._bus = bus
        self.sight = Sight(source)
        self._said: dict[str, _Said] = {}
        self.unknown: list[str] = []
        """Topics that cannot be played, and why."""
        self.unreadable = 0
        """How many messages could not be read so far."""
        for topic in source.topics.values():
            if not topic.is_own:
                self._advertise(topic)
        self._coming: Iterator[RecordedMessage] = iter(())
        self._next = _NOTHING

    def after_step(self) -> None:
        """Publish what is due."""
        now = self.simulation.now
        while self._next.time <= now:
            self._say(self._next)
            self._next = next(self._coming, _NOTHING)

    def seek(self, time: int) -> int:
        """Go to a time [ns], kept within the recording; the time at which playing stands then [ns].

        Listeners are told of latched messages that are others now than before; of the rest only what comes.
        """
        simulation = self.simulation
        wanted = min(max(time, self._source.begin), self._source.end_time)
        state = {"tick": simulation.clock.first_tick_at(wanted), "events": simulation.events.get_state(), "devices": {}}
        simulation.set_state(state)
        self._take_up(simulation.now)
        return simulation.now

    def _advertise(self, topic: RecordedTopic) -> None:
        try:
            publisher = self._bus.advertise(topic.name, topic.type, latch=topic.latch, rate=topic.rate, node=topic.node)
        except CellwrightError as error:  # a type of another version, or of a package that is not here
            self.unknown.append(f"{topic.name} cannot be played: {error}")
            return
        self._said[topic.name] = _Said(publisher, message_type(topic.type))

    def _take_up(self, now: int) -> None:
        """Stand at a time [ns]: latched messages and sight as of then, the rest to come."""
        for name, said in self._said.items():
            if said.publisher.latch:
                self._latch(name, said, now)
        self.sight.seek(now)
        self._coming = self._source.messages([*self._said, FRAME, PANEL], start=now + 1)
        self._next = next(self._coming, _NOTHING)

    def _latch(self, name: str, said: _Said, now: int) -> None:
        found = self._source.newest(name, now)
        if found is None:
            said.publisher.newest, said.latched = None, b""
        elif found.data != said.latched or said.publisher.newest is None:
            self._publish(said, found.data)

    def _say(self, message: RecordedMessage) -> None:
        said = self._said.get(message.topic)
        if said is None:
            self.sight.take(message)
        elif said.publisher.latch or said.publisher.listeners:
            self._publish(said, message.data)

    def _publish(self, said: _Said, data: bytes) -> None:
        try:
            message = from_cdr(data, said.message_class)
        except MessageError:
            self.unreadable += 1
            return
        said.latched = data if said.publisher.latch else b""
        said.publisher.publish(message)


class _Said:
    """What publishes on a topic, the class of its messages, and the bytes of the newest one that is latched."""

    def __init__(self, publisher: Publisher, message_class: type[Message]) -> None:
        self.publisher = publisher
        self.message_class = message_class
        self.latched = b""
