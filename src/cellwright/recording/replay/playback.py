"""Playback of a recording: its messages again on a read-only bus, and its simulation time."""

from collections.abc import Callable, Iterator, Mapping
from enum import Enum
from fractions import Fraction
from itertools import islice
from typing import Any, NoReturn

import mujoco

from cellwright.engine.clock import NANOSECONDS
from cellwright.engine.device import Device
from cellwright.engine.loop import SimulationLoop
from cellwright.engine.rate_control import RateControl
from cellwright.engine.shapes import Visuals
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus, Publisher
from cellwright.middleware.messages import Message
from cellwright.middleware.messages.standard import Clock, Time
from cellwright.recording.format.format import FRAME, PANEL
from cellwright.recording.format.reader import RecordedMessage, RecordingFile
from cellwright.recording.replay.frame_cursor import FrameCursor
from cellwright.rendering.camera import Camera
from cellwright.util.errors import CellwrightError, MessageError, RecordingError, RejectedCommandError

READ_ONLY = "a recording is read-only; it accepts no commands"
_MAX_MESSAGES = 2000  # messages that are examined
_MIN_OFFSET = NANOSECONDS  # [ns]; a stamp closer to simulation time is simulation time
_NOTHING = RecordedMessage("", 1 << 62, b"")  # later than any time
CLOCK = "/clock"
REPLAY_NODE = "/cellwright_replay"
"""Publisher of topics that were not recorded."""
_CLOCK_RATE = 100  # [Hz]
_TIMESTEP = Fraction(1, 500)
_MIN_TIMESTEP, _MAX_TIMESTEP = Fraction(1, 100_000), Fraction(1, 10)  # [s]


class ReadOnlyBus(Bus):
    """Read-only bus: topics have subscribers as on any bus; every command and every call is refused."""

    def publish(self, topic: str, message: Message, *, node: str = "", is_decoded: bool = False) -> None:  # noqa: ARG002
        """Refuse a message."""
        self._refuse(topic, node)

    def call(self, service: str, request: Message, *, node: str = "", is_decoded: bool = False) -> Any:  # noqa: ARG002
        """Refuse a call."""
        self._refuse(service, node)

    def _refuse(self, name: str, node: str) -> NoReturn:
        self.refusals.refuse(f"{name} from {node}" if node else name, READ_ONLY)
        raise RejectedCommandError(READ_ONLY)


def clock_offset(source: RecordingFile) -> int:
    """Return by how much message stamps are ahead of simulation time [ns]; 0 if they are simulation time."""
    outputs = [name for name, topic in source.topics.items() if topic.direction == "out" and not topic.is_own]
    for message in islice(source.messages(outputs), _MAX_MESSAGES):
        try:
            stamp = getattr(getattr(source.decode(message), "header", None), "stamp", None)
        except RecordingError:
            continue
        if stamp is not None:
            ahead = int(stamp.sec) * NANOSECONDS + int(stamp.nanosec) - message.time
            return ahead if abs(ahead) >= _MIN_OFFSET else 0
    return 0


class Recorded(Device):
    """A recording whose time passes again: its messages are published at their times.

    It starts at its begin. A message is decoded only for subscribers, or if it is latched.

    Args:
        source: the recording.
        report: called with a line about refused input, and about topics that cannot be played.
    """

    in_competition = True
    """A recording cannot be changed."""

    def __init__(self, source: RecordingFile, *, report: Callable[[str], None] = lambda _line: None) -> None:
        super().__init__(source.header.name)
        self.source = source
        self.cursor = FrameCursor(source)
        self.cuts = 0
        """Number of seeks; frames before and after one are unrelated."""
        self.unreadable = 0
        """Number of messages so far that could not be decoded."""
        self._publishers: dict[str, tuple[Publisher, type[Message]]] = {}
        self._latched: dict[str, bytes] = {}  # data of the newest latched message, by topic
        self._messages: Iterator[RecordedMessage] = iter(())
        self._next = _NOTHING
        simulation = Simulation(mujoco.MjSpec().compile(), timestep=recorded_timestep(source))
        self.bus = ReadOnlyBus(lambda: simulation.now, report, source.types)
        simulation.clock.offset = source.header.clock_offset
        simulation.add(self)
        for name, topic in source.topics.items():
            if topic.is_own:
                continue
            try:
                publisher = self.bus.advertise(name, topic.type, latch=topic.latch, rate=topic.rate, node=topic.node)
                self._publishers[name] = publisher, source.types.message(topic.type)
            except CellwrightError as error:
                # a type of another version, or of a package that is not installed
                report(f"{name} cannot be played: {error}")
        if CLOCK not in source.topics:
            self._publish_clock(clock_offset(source))
        self.seek(source.begin)

    def after_step(self) -> None:
        """Publish the messages that are due."""
        now = self.simulation.now
        while self._next.time <= now:
            message = self._next
            if message.topic in self._publishers:
                publisher, message_class = self._publishers[message.topic]
                if publisher.latch or publisher.listeners:
                    self._publish(publisher, message_class, message)
            else:
                self.cursor.take(message)
            self._next = next(self._messages, _NOTHING)

    def seek(self, time: int) -> int:
        """Go to a time [ns] within the recording; return the time reached [ns].

        Subscribers get latched messages that differ from those before; of all other topics only later messages.
        """
        self.cuts += 1
        simulation = self.simulation
        target = min(max(time, self.source.begin), self.source.end_time)
        state = {"tick": simulation.clock.first_tick_at(target), "events": simulation.events.get_state(), "devices": {}}
        simulation.set_state(state)
        now = simulation.now
        for name, (publisher, message_class) in self._publishers.items():
            if publisher.latch:
                newest = self.source.newest(name, now)
                if newest is None:
                    publisher.newest = None
                # A viewer that stays connected should not get an unchanged scene or description at each seek.
                elif publisher.newest is None or newest.data != self._latched[name]:
                    self._publish(publisher, message_class, newest)
        self.cursor.seek(now)
        self._messages = self.source.messages([*self._publishers, FRAME, PANEL], start=now + 1)
        self._next = next(self._messages, _NOTHING)
        return now

    @property
    def drawn(self) -> tuple[mujoco.MjModel, Visuals]:
        """Model whose shapes are drawn: an empty one, as a recording has its own scene."""
        return self.simulation.model, Visuals()

    @property
    def views(self) -> Mapping[str, Camera]:
        """Named views of a cell: none."""
        return {}

    def scene_parts(self) -> tuple[()]:
        """Return the parts of a cell: none, as a recording has no bodies of the engine."""
        return ()

    def _publish(self, publisher: Publisher, message_class: type[Message], message: RecordedMessage) -> None:
        try:
            decoded = self.bus.types.from_cdr(message.data, message_class)
        except MessageError:
            self.unreadable += 1
            return
        if publisher.latch:
            self._latched[message.topic] = message.data
        publisher.publish(decoded)

    def _publish_clock(self, ahead: int) -> None:
        """Publish the time on /clock as messages are stamped: `ahead` of simulation time [ns]."""
        publisher = self.bus.advertise(CLOCK, "rosgraph_msgs/Clock", rate=f"{_CLOCK_RATE} Hz", node=REPLAY_NODE)

        def publish_time(_index: int) -> None:
            if publisher.listeners:
                second, nanosecond = divmod(self.simulation.now + ahead, NANOSECONDS)
                publisher.publish(Clock(clock=Time(sec=second, nanosec=nanosecond)))

        self.simulation.watch("clock", Fraction(1, _CLOCK_RATE), publish_time)


def recorded_timestep(source: RecordingFile) -> Fraction:
    """Return the recorded length of a tick [s]; 1/500 s if the recording does not give it."""
    value = source.header.facts.get("timestep")
    try:
        found = Fraction(*value) if isinstance(value, list) else Fraction(str(value))
    except (TypeError, ValueError, ZeroDivisionError):
        return _TIMESTEP
    return found if _MIN_TIMESTEP <= found <= _MAX_TIMESTEP else _TIMESTEP


class AtEnd(Enum):
    """Behaviour at the end of the recording."""

    STOP = "stop"
    """Playback ends."""
    HOLD = "hold"
    """Time stops. Resuming plays from the start."""
    LOOP = "loop"
    """Playback restarts."""


class Playing:
    """Playback control of a recording.

    Args:
        recorded: the recording that is played.
        rate: control of its speed and pauses.
        first, last: simulation times [ns] from which and up to which it is played; None: all of it.
        at_end: behaviour at `last`.

    Attributes:
        first, last: these times, within the recording.
    """

    def __init__(
        self,
        recorded: Recorded,
        rate: RateControl,
        *,
        first: int | None = None,
        last: int | None = None,
        at_end: AtEnd = AtEnd.STOP,
    ) -> None:
        begin, end = recorded.source.begin, recorded.source.end_time
        self.first = begin if first is None else min(max(first, begin), end)
        self.last = end if last is None else min(max(last, self.first), end)
        self.recorded, self.rate = recorded, rate
        self._at_end = at_end
        recorded.seek(self.first)

    def seek(self, time: int) -> int:
        """Go to a time [ns]; return the time reached [ns]."""
        now = self.recorded.seek(time)
        self.rate.restart_pace()
        return now

    def restart(self) -> None:
        """Go to the first time."""
        self.seek(self.first)

    def resume(self) -> None:
        """Resume; at the end, from the start."""
        if self.recorded.simulation.now >= self.last:
            self.recorded.seek(self.first)
        self.rate.resume()

    def run(self, loop: SimulationLoop) -> None:
        """Play until the end, or until the loop, which stops at `last`, is stopped on request."""
        while not loop.stop.is_requested:
            loop.run()
            if loop.stop.is_requested or self._at_end is AtEnd.STOP:
                return
            if self._at_end is AtEnd.LOOP and self.last > self.first:
                self.restart()
            else:
                self._hold(loop)

    def _hold(self, loop: SimulationLoop) -> None:
        """Serve clients while time stands at the end."""
        self.rate.pause()
        while not loop.stop.is_requested and self.recorded.simulation.now >= self.last:
            loop.tick()
            # a single step went past the end
            if self.recorded.simulation.now > self.last:
                self.seek(self.last if self.rate.is_paused else self.first)
