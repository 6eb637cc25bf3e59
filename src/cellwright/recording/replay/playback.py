"""Playback of a recording: its messages once more on a read-only bus, and how its time passes and ends."""

from collections.abc import Callable, Iterator
from enum import Enum
from fractions import Fraction
from itertools import islice
from typing import Any, NoReturn

import mujoco

from cellwright.engine.clock import NANOSECONDS
from cellwright.engine.loop import Loop
from cellwright.engine.rate_control import RateControl
from cellwright.engine.simulation import Device, Simulation
from cellwright.middleware.bus import Bus, Publisher
from cellwright.middleware.messages import Message, from_cdr, message_type
from cellwright.middleware.messages.standard import Clock, Time
from cellwright.recording.format.format import FRAME, PANEL
from cellwright.recording.format.reader import RecordedMessage, Recording
from cellwright.recording.replay.frame_cursor import Sight
from cellwright.util.errors import CellwrightError, MessageError, RecordingError, RejectedCommandError

WHY_NOT = "this is a recording: it plays what was, and hears no commands"


class DeafBus(Bus):
    """Topics that are listened to, as those of any bus; every command and every call is refused."""

    def publish(self, topic: str, message: Message, *, node: str = "", is_decoded: bool = False) -> None:  # noqa: ARG002
        """Refuse a message."""
        self._refuse(topic, node)

    def call(self, service: str, request: Message, *, node: str = "", is_decoded: bool = False) -> Any:  # noqa: ARG002
        """Refuse a call."""
        self._refuse(service, node)

    def _refuse(self, name: str, node: str) -> NoReturn:
        self.refusals.refuse(f"{name} from {node}" if node else name, WHY_NOT)
        raise RejectedCommandError(WHY_NOT)


_MAX_MESSAGES = 2000  # messages that are looked at
_LEAST_OFFSET = NANOSECONDS  # a stamp that is nearer to simulation time than this [ns] is simulation time


def clock_offset(source: Recording) -> int:
    """By how much the stamps of what was said are ahead of simulation time [ns]; 0 where they tell that time."""
    said = [name for name, topic in source.topics.items() if topic.direction == "out" and not topic.is_own]
    for message in islice(source.messages(said), _MAX_MESSAGES):
        try:
            stamp = getattr(getattr(source.decode(message), "header", None), "stamp", None)
        except RecordingError:
            continue
        if stamp is not None:
            ahead = int(stamp.sec) * NANOSECONDS + int(stamp.nanosec) - message.time
            return ahead if abs(ahead) >= _LEAST_OFFSET else 0
    return 0


_NOTHING = RecordedMessage("", 1 << 62, b"")  # later than any time

CLOCK = "/clock"
REPLAY_NODE = "/cellwright_replay"
"""Who says what was not recorded."""

_CLOCK_RATE = 100  # [Hz]
_TIMESTEP = Fraction(1, 500)
_MIN_TIMESTEP, _MAX_TIMESTEP = Fraction(1, 100_000), Fraction(1, 10)  # [s]


class Recorded(Device):
    """Something recorded whose time passes again: its messages are published as time comes to them.

    It stands at its begin. A message is read only when somebody listens, or will be given it for being the newest.

    Args:
        source: what was recorded.
        report: takes a line about what is refused, and about what cannot be played.
    """

    in_competition = True
    """Nothing can be changed of what has been."""

    def __init__(self, source: Recording, *, report: Callable[[str], None] = lambda _line: None) -> None:
        super().__init__(source.header.name)
        self.source = source
        self.sight = Sight(source)
        self.cuts = 0
        """How often its time has been set: what comes then does not follow from what was before."""
        self.unreadable = 0
        """How many messages could not be read so far."""
        self._publishers: dict[str, tuple[Publisher, type[Message]]] = {}
        self._latched: dict[str, bytes] = {}  # what was latched last, by topic
        self._coming: Iterator[RecordedMessage] = iter(())
        self._next = _NOTHING
        simulation = Simulation(mujoco.MjSpec().compile(), timestep=recorded_timestep(source))
        self.bus = DeafBus(lambda: simulation.now, report)
        simulation.add(self)
        for name, topic in source.topics.items():
            if topic.is_own:
                continue
            try:
                publisher = self.bus.advertise(name, topic.type, latch=topic.latch, rate=topic.rate, node=topic.node)
                self._publishers[name] = publisher, message_type(topic.type)
            except CellwrightError as error:  # a type of another version, or of a package that is not here
                report(f"{name} cannot be played: {error}")
        if CLOCK not in source.topics:
            self._tell_time(clock_offset(source))
        self.seek(source.begin)

    def after_step(self) -> None:
        """Publish what is due."""
        now = self.simulation.now
        while self._next.time <= now:
            message = self._next
            if message.topic in self._publishers:
                publisher, message_class = self._publishers[message.topic]
                if publisher.latch or publisher.listeners:
                    self._publish(publisher, message_class, message)
            else:
                self.sight.take(message)
            self._next = next(self._coming, _NOTHING)

    def seek(self, time: int) -> int:
        """Go to a time [ns], kept within the recording; the time at which it stands then [ns].

        Listeners are told of latched messages that are others now than before; of the rest only what comes.
        """
        self.cuts += 1
        simulation = self.simulation
        wanted = min(max(time, self.source.begin), self.source.end_time)
        state = {"tick": simulation.clock.first_tick_at(wanted), "events": simulation.events.get_state(), "devices": {}}
        simulation.set_state(state)
        now = simulation.now
        for name, (publisher, message_class) in self._publishers.items():
            if publisher.latch:
                newest = self.source.newest(name, now)
                if newest is None:
                    publisher.newest = None
                elif publisher.newest is None or newest.data != self._latched[name]:
                    self._publish(publisher, message_class, newest)
        self.sight.seek(now)
        self._coming = self.source.messages([*self._publishers, FRAME, PANEL], start=now + 1)
        self._next = next(self._coming, _NOTHING)
        return now

    def out_of_sight(self) -> tuple[int, ...]:
        """Ids of bodies that are not there to be seen: what is played has none of the engine's."""
        return ()

    def _publish(self, publisher: Publisher, message_class: type[Message], message: RecordedMessage) -> None:
        try:
            decoded = from_cdr(message.data, message_class)
        except MessageError:
            self.unreadable += 1
            return
        if publisher.latch:
            self._latched[message.topic] = message.data
        publisher.publish(decoded)

    def _tell_time(self, ahead: int) -> None:
        """Tell the time on /clock, as messages are stamped: `ahead` of simulation time [ns], where they are."""
        publisher = self.bus.advertise(CLOCK, "rosgraph_msgs/Clock", rate=f"{_CLOCK_RATE} Hz", node=REPLAY_NODE)

        def tell(_index: int) -> None:
            if publisher.listeners:
                second, nanosecond = divmod(self.simulation.now + ahead, NANOSECONDS)
                publisher.publish(Clock(clock=Time(sec=second, nanosec=nanosecond)))

        self.simulation.watch("clock", Fraction(1, _CLOCK_RATE), tell)


def recorded_timestep(source: Recording) -> Fraction:
    """Length of a tick [s] of what was recorded; 1/500 s where the recording does not say it."""
    told = source.header.facts.get("timestep")
    try:
        found = Fraction(*told) if isinstance(told, list) else Fraction(str(told))
    except (TypeError, ValueError, ZeroDivisionError):
        return _TIMESTEP
    return found if _MIN_TIMESTEP <= found <= _MAX_TIMESTEP else _TIMESTEP


class AtEnd(Enum):
    """What becomes of time when all has been played."""

    STOP = "stop"
    """Playing is over."""
    HOLD = "hold"
    """Time stands. Whoever lets it pass again sees all from the start."""
    LOOP = "loop"
    """It begins again."""


class Playing:
    """How the time of a recording passes.

    Args:
        recorded: what is played.
        rate: how its time passes.
        first, last: simulation times [ns] from which and up to which it is played; None: all of it.
        at_end: what becomes of time then.

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
        """Go to a time [ns]; the time at which it stands then [ns]."""
        now = self.recorded.seek(time)
        self.rate.begin_anew()
        return now

    def begin_anew(self) -> None:
        """Go to where it begins."""
        self.seek(self.first)

    def resume(self) -> None:
        """Let time pass again: from the start, where it stands at the end."""
        if self.recorded.simulation.now >= self.last:
            self.recorded.seek(self.first)
        self.rate.resume()

    def run(self, loop: Loop) -> None:
        """Play until it is over, or the loop, which stops at `last`, is to stop on request."""
        while not loop.stop.is_requested:
            loop.run()
            if loop.stop.is_requested or self._at_end is AtEnd.STOP:
                return
            if self._at_end is AtEnd.LOOP and self.last > self.first:
                self.begin_anew()
            else:
                self._hold(loop)

    def _hold(self, loop: Loop) -> None:
        """Serve clients while time stands at the end."""
        self.rate.pause()
        while not loop.stop.is_requested and self.recorded.simulation.now >= self.last:
            loop.tick()
            if self.recorded.simulation.now > self.last:  # a step past the end leads nowhere
                self.seek(self.last if self.rate.is_paused else self.first)
