"""Playback of a recording: a read-only bus, a player of its messages, its clock, and its end."""

from __future__ import annotations

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
from cellwright.recording.format.format import FRAME, PANEL, RecordedTopic
from cellwright.recording.format.reader import RecordedMessage, Recording
from cellwright.recording.replay.frame_cursor import Sight
from cellwright.util.errors import CellwrightError, MessageError, RejectedCommandError

WHY_NOT = "this is a recording: it plays what was, and hears no commands"


class DeafBus(Bus):
    """Topics that are listened to, as those of any bus; every command and every call is refused."""

    def publish(self, topic: str, message: Message, *, node: str = "", is_decoded: bool = False) -> None:  # noqa: ARG002
        """Refuse a message.

        Raises:
            RejectedCommandError: always.
        """
        self._refuse(topic, node)

    def call(self, service: str, request: Message, *, node: str = "", is_decoded: bool = False) -> Any:  # noqa: ARG002
        """Refuse a call.

        Raises:
            RejectedCommandError: always.
        """
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
            found: Any = from_cdr(message.data, message_type(source.topics[message.topic].type))
        except CellwrightError:
            continue
        stamp = getattr(getattr(found, "header", None), "stamp", None)
        if stamp is not None:
            ahead = int(stamp.sec) * NANOSECONDS + int(stamp.nanosec) - message.time
            return ahead if abs(ahead) >= _LEAST_OFFSET else 0
    return 0


_NOTHING = RecordedMessage("", 1 << 62, b"")  # later than any time


class Player(Device):
    """Publishes the messages of a recording as simulation time comes to them.

    A message is read only when somebody listens, or will be given it for being the newest.

    Args:
        source: what is played.
        bus: where the recorded topics are advertised and their messages published.
    """

    def __init__(self, source: Recording, bus: Bus) -> None:
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


CLOCK = "/clock"
REPLAY_NODE = "/cellwright_replay"
"""Who says what was not recorded."""

_CLOCK_RATE = 100  # [Hz]
_TIMESTEP = Fraction(1, 500)
_MIN_TIMESTEP, _MAX_TIMESTEP = Fraction(1, 100_000), Fraction(1, 10)  # [s]


class Recorded:
    """Something recorded whose time passes again. It stands at its begin.

    Args:
        source: what was recorded.
        report: takes a line about what is refused, and about what cannot be played.
    """

    in_competition = True
    """Nothing can be changed of what has been."""

    def __init__(self, source: Recording, *, report: Callable[[str], None] = lambda _line: None) -> None:
        self.source = source
        self.name = source.header.name
        self.simulation = Simulation(mujoco.MjSpec().compile(), timestep=recorded_timestep(source))
        self.bus = DeafBus(lambda: self.simulation.now, report)
        self.player = Player(source, self.bus)
        self.simulation.add(self.player)
        if CLOCK not in source.topics:
            self._tell_time(clock_offset(source))
        self.cuts = 0
        """How often its time has been set: what comes then does not follow from what was before."""
        self.seek(source.begin)
        for line in self.player.unknown:
            report(line)

    def _tell_time(self, ahead: int) -> None:
        """Tell the time on /clock, as messages are stamped: as the wall's, where a robot's node lived by it.

        Args:
            ahead: by how much they are ahead of simulation time [ns].
        """
        publisher = self.bus.advertise(CLOCK, "rosgraph_msgs/Clock", rate=f"{_CLOCK_RATE} Hz", node=REPLAY_NODE)

        def tell(_index: int) -> None:
            if publisher.listeners:
                second, nanosecond = divmod(self.simulation.now + ahead, NANOSECONDS)
                publisher.publish(Clock(clock=Time(sec=second, nanosec=nanosecond)))

        self.simulation.watch("clock", Fraction(1, _CLOCK_RATE), tell)

    def seek(self, time: int) -> int:
        """Go to a time [ns], kept within the recording; the time at which it stands then [ns]."""
        self.cuts += 1
        return self.player.seek(time)

    def out_of_sight(self) -> tuple[int, ...]:
        """Ids of bodies that are not there to be seen: what is played has none of the engine's."""
        return ()


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
        """Simulation time [ns] from which it is played."""
        self.last = end if last is None else min(max(last, self.first), end)
        """Simulation time [ns] up to which it is played."""
        self.recorded = recorded
        """What is played."""
        self.rate = rate
        """How its time passes."""
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
        """Play until it is over, or the loop is to stop on request.

        Args:
            loop: steps what is played; it stops at `last`.
        """
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
