"""Binding of an interface: puts every row of a table on a bus, with the handler that it names.

A topic without latch is sampled only while it has a listener. A latched one is always sampled, as in the original: its
newest message does not depend on listeners. If building a message is expensive, it is built when it is needed.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeVar

from cellwright.engine.sensor import Reading
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus, Direction, Publisher
from cellwright.middleware.interface.table import Endpoint, EndpointKind
from cellwright.middleware.messages import Message
from cellwright.middleware.messages.conversions import stamp
from cellwright.middleware.messages.standard import Clock
from cellwright.middleware.messages.template import stamp_cdr
from cellwright.util.errors import UsageError

_CLOCK_RANK = -10  # no message comes before the clock of its stamp

R = TypeVar("R", bound=Reading)


@dataclass(frozen=True, slots=True)
class Output:
    """Topic that is about to be published; its handler selects the source of the messages by one of the methods.

    Attributes:
        rank: the row's place in the table, from 1. Of topics that are due together, lower ranks come first. Ranks are
            unique, so that this order does not depend on the order of subscription.
    """

    bus: Bus
    simulation: Simulation
    row: Endpoint
    rank: int = 0

    def advertise(self, on_listeners: Callable[[int], None] | None = None) -> Publisher:
        """Return a publisher, for messages at any time."""
        row = self.row
        return self.bus.advertise(
            row.name,
            row.type,
            latch=row.latch,
            rate=row.rate_text,
            node=row.node,
            on_listeners=on_listeners,
            qos=row.qos,
        )

    def sample(self, build: Callable[[], Message | None], encode: Callable[[], bytes] | None = None) -> Sampled:
        """Publish at the row's rate, or in each step if it has no period, a message of this tick's state.

        Args:
            build: returns the message, or None for no message.
            encode: returns its CDR, for a topic without latch; called in place of `build` if all listeners take that.
        """
        return Sampled(self, build, encode)

    def stream(
        self,
        listen: Callable[[Callable[[R], None]], Callable[[], None]],
        build: Callable[[R], Message | None],
        *,
        encode: Callable[[R], bytes] | None = None,
        is_deferred: bool = False,
    ) -> None:
        """Publish the readings of a sensor.

        Args:
            listen: subscribes a function that takes readings to the sensor; returns a function that ends this.
            build: returns the message of a reading, whose `time_ns` is in message time; None for no message.
            encode: returns its CDR; called in place of `build` if all listeners take that.
            is_deferred: on a latched topic without listeners, build when the message is needed. The reading alone
                must determine the message then.
        """
        _Streamed(self, listen, build, encode, is_deferred=is_deferred)


class _OnDemand(ABC):
    """Topic that listens to its source always if it is latched, else while it has a listener."""

    def __init__(self, output: Output) -> None:
        self._output = output
        self._end: Callable[[], None] | None = None
        self._publisher = output.advertise(None if output.row.latch else self._take_listeners)
        # The original samples latched topics without listeners, too, so that a late one gets the newest message.
        if output.row.latch:
            self._end = self._begin()

    @abstractmethod
    def _begin(self) -> Callable[[], None]:
        """Listen to the source; return a function that ends this."""

    def _take_listeners(self, count: int) -> None:
        if count and self._end is None:
            self._end = self._begin()
        elif not count and self._end is not None:
            self._end()
            self._end = None


class Sampled(_OnDemand):
    """Topic with a message at its rate."""

    def __init__(self, output: Output, build: Callable[[], Message | None], encode: Callable[[], bytes] | None) -> None:
        self._build, self._encode = build, encode
        super().__init__(output)

    def _begin(self) -> Callable[[], None]:
        row, simulation = self._output.row, self._output.simulation
        return simulation.watch(row.name, row.period, self._publish, self._output.rank).cancel

    def publish(self) -> None:
        """Publish a message now, in addition to those at the rate."""
        if self._end is not None:
            self._publish(0)

    def _publish(self, _index: int) -> None:
        if self._encode is not None and (takers := self._publisher.cdr_takers):
            data = self._encode()
            for take in takers:
                take(data)
            return
        message = self._build()
        if message is not None:
            self._publisher.publish(message)


class _Streamed(_OnDemand):
    """Topic of a sensor's readings."""

    def __init__(
        self,
        output: Output,
        listen: Callable[..., Callable[[], None]],
        build: Callable[[Any], Message | None],
        encode: Callable[[Any], bytes] | None,
        *,
        is_deferred: bool,
    ) -> None:
        self._listen, self._build, self._encode = listen, build, encode
        self._clock = output.simulation.clock
        self._take = self._offer if is_deferred and output.row.latch else self._publish
        super().__init__(output)

    def _begin(self) -> Callable[[], None]:
        return self._listen(self._take)

    def _publish(self, reading: Reading) -> None:
        stamped = self._stamped(reading)
        if self._is_encoded(stamped, reading.time_ns):
            return
        message = self._build(stamped)
        if message is not None:
            self._publisher.publish(message, measured=reading.time_ns)

    def _offer(self, reading: Reading) -> None:
        stamped = self._stamped(reading)
        if not self._is_encoded(stamped, reading.time_ns):
            self._publisher.offer(partial(self._build, stamped))

    def _is_encoded(self, stamped: Reading, measured: int) -> bool:
        """Publish a reading as CDR if that suits all listeners; return whether it did."""
        return self._encode is not None and self._publisher.publish_cdr(
            partial(self._encode, stamped), partial(self._build, stamped), measured
        )

    def _stamped(self, reading: Reading) -> Reading:
        """Return a reading with the message time of its measurement, or 0 if message time has begun since."""
        offset = self._clock.offset
        return reading.restamped(max(0, reading.time_ns + offset)) if offset else reading


def bind(
    bus: Bus, simulation: Simulation, table: Sequence[Endpoint], handlers: Iterable[object], *, first: int = 1
) -> None:
    """Put every row of a table on a bus.

    A row's handler is a method of one of the `handlers`. For a service or an incoming topic it is called with each
    request or message: `handler(row, message, node)`. For an outgoing topic it is called once: `handler(output)`. An
    object with an attribute `subject` handles rows of that subject alone, and one with an attribute `topics` those
    whose names begin so. The rows have ranks from `first` on.

    Raises:
        UsageError: a row names a handler that does not exist.
    """
    found = tuple(handlers)
    for rank, row in enumerate(table, first):
        if row.kind is EndpointKind.ACTION:
            bus.actions[row.name] = row.type  # its topics have rows of their own
            continue
        handler = next(
            (
                getattr(each, row.handler)
                for each in found
                if hasattr(each, row.handler)
                and getattr(each, "subject", row.subject) == row.subject
                and row.name.startswith(getattr(each, "topics", ""))
            ),
            None,
        )
        if handler is None:
            raise UsageError(f"{row.name}: no handler is named {row.handler!r}")
        if row.direction is Direction.OUT:
            handler(Output(bus, simulation, row, rank))
        else:
            if row.kind is EndpointKind.SERVICE:
                bus.serve(row.name, row.type, partial(handler, row), node=row.node)
            else:
                bus.listen(row.name, row.type, partial(handler, row), node=row.node, qos=row.qos)


def publish_clock(output: Output) -> None:
    """Handler of /clock: publish message time before all messages that are stamped with it."""
    message_time = output.simulation.clock.message_time
    replace(output, rank=_CLOCK_RANK).sample(lambda: Clock(stamp(message_time())), lambda: stamp_cdr(message_time()))
