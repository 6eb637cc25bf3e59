"""Binding of an interface: every row of a table put on a bus, with the handler that it names.

A topic without latch is sampled only while somebody listens. A latched one is sampled always, as in the original: its
newest message is the same whoever has listened before. Where building it costs much, it is built when it is needed.
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
from cellwright.middleware.interface.table import Kind, Row
from cellwright.middleware.messages import Message
from cellwright.middleware.messages.conversions import stamp
from cellwright.middleware.messages.standard import Clock
from cellwright.util.errors import UsageError

_CLOCK_RANK = -10  # a message never comes before the clock that it is stamped with

R = TypeVar("R", bound=Reading)


@dataclass(frozen=True, slots=True)
class Output:
    """A topic that is about to be published: its handler says where the messages come from, by one of the methods.

    Attributes:
        rank: of topics that are due together, lower ones come first: the row's place in the table, from 1. Each has a
            rank of its own, so that their order does not depend on who came when.
    """

    bus: Bus
    simulation: Simulation
    row: Row
    rank: int = 0

    def advertise(self, on_listeners: Callable[[int], None] | None = None) -> Publisher:
        """Publish whenever the handler has a message."""
        row = self.row
        return self.bus.advertise(
            row.name, row.type, latch=row.latch, rate=row.rate_text, node=row.node, on_listeners=on_listeners
        )

    def sample(self, build: Callable[[], Message | None]) -> Sampled:
        """Publish at the row's rate, in each step if it has no period, what `build` makes of the state of this tick.

        It returns None when there is nothing to say.
        """
        return Sampled(self, build)

    def stream(
        self,
        listen: Callable[[Callable[[R], None]], Callable[[], None]],
        build: Callable[[R], Message | None],
        *,
        is_deferred: bool = False,
    ) -> None:
        """Publish the readings of a sensor.

        Args:
            listen: begins to listen to the sensor, with a function that takes readings; returns what ends it.
            build: makes the message of a reading; None when there is nothing to say.
            is_deferred: on a latched topic that nobody listens to, build when the message is needed. The reading alone
                must determine the message then.
        """
        _Streamed(self, listen, build, is_deferred=is_deferred)


class _OnDemand(ABC):
    """A topic whose source is listened to always if it is latched, else while the topic has a listener."""

    def __init__(self, output: Output) -> None:
        self._output = output
        self._end: Callable[[], None] | None = None
        self._publisher = output.advertise(None if output.row.latch else self._take_listeners)
        if output.row.latch:
            self._end = self._begin()

    @abstractmethod
    def _begin(self) -> Callable[[], None]:
        """Listen to the source; what ends that."""

    def _take_listeners(self, count: int) -> None:
        if count and self._end is None:
            self._end = self._begin()
        elif not count and self._end is not None:
            self._end()
            self._end = None


class Sampled(_OnDemand):
    """A topic that has a message at its rate."""

    def __init__(self, output: Output, build: Callable[[], Message | None]) -> None:
        self._build = build
        super().__init__(output)

    def _begin(self) -> Callable[[], None]:
        row, simulation = self._output.row, self._output.simulation
        return simulation.watch(row.name, row.period, self._publish, self._output.rank).cancel

    def publish(self) -> None:
        """A message now, besides those at the rate."""
        if self._end is not None:
            self._publish(0)

    def _publish(self, _index: int) -> None:
        message = self._build()
        if message is not None:
            self._publisher.publish(message)


class _Streamed(_OnDemand):
    """A topic that passes on what a sensor measures."""

    def __init__(
        self,
        output: Output,
        listen: Callable[..., Callable[[], None]],
        build: Callable[[Any], Message | None],
        *,
        is_deferred: bool,
    ) -> None:
        self._listen, self._build = listen, build
        self._take = self._offer if is_deferred and output.row.latch else self._publish
        super().__init__(output)

    def _begin(self) -> Callable[[], None]:
        return self._listen(self._take)

    def _publish(self, reading: Reading) -> None:
        message = self._build(reading)
        if message is not None:
            self._publisher.publish(message, measured=reading.time_ns)

    def _offer(self, reading: Reading) -> None:
        self._publisher.offer(partial(self._build, reading))


def bind(bus: Bus, simulation: Simulation, table: Sequence[Row], handlers: Iterable[object]) -> None:
    """Put every row of a table on a bus.

    A row's handler is a method of one of the `handlers`. Of a service or a topic to the node it is called with each
    request or message: `handler(row, message, node)`. Of a topic from the node it is called once: `handler(output)`.

    Raises:
        UsageError: a row names a handler that there is not.
    """
    found = tuple(handlers)
    for rank, row in enumerate(table, 1):
        if row.kind is Kind.ACTION:
            continue  # its topics have rows of their own
        handler = next((getattr(each, row.handler) for each in found if hasattr(each, row.handler)), None)
        if handler is None:
            raise UsageError(f"{row.name}: no handler is named {row.handler!r}")
        if row.direction is Direction.OUT:
            handler(Output(bus, simulation, row, rank))
        else:
            begin = bus.serve if row.kind is Kind.SERVICE else bus.listen
            begin(row.name, row.type, partial(handler, row), node=row.node)


def publish_clock(output: Output) -> None:
    """Handler of /clock: simulation time, before all messages that are stamped with it."""
    simulation = output.simulation
    replace(output, rank=_CLOCK_RANK).sample(lambda: Clock(stamp(simulation.now)))
