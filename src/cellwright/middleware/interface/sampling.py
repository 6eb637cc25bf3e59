"""Topics at a rate, and topics that pass on what a sensor measures.

A topic without latch is sampled only while somebody listens. A latched one is sampled always, as in the original: its
newest message is the same whoever has listened before. Where building it costs much, it is built when it is needed.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Generic, TypeVar

from cellwright.engine.clock import Watch
from cellwright.engine.sensor import Reading
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus, Publisher
from cellwright.middleware.interface.table import Row
from cellwright.middleware.messages import Message

R = TypeVar("R", bound=Reading)


class Sampled:
    """A topic that has a message at its rate: always if it is latched, else while it has a listener.

    Args:
        row: the topic in the contract's table. It has a message in each step if it has no period.
        build: makes the message, from the state of this tick; None when there is nothing to say.
        rank: of topics that are due together, lower ones come first; each has a rank of its own, so that their order
            does not depend on who came when.
    """

    def __init__(
        self, bus: Bus, simulation: Simulation, row: Row, build: Callable[[], Message | None], *, rank: int = 0
    ) -> None:
        self._simulation = simulation
        self._row = row
        self._build = build
        self._rank = rank
        self._watch: Watch | None = None
        if row.latch:
            self._watch = simulation.watch(row.name, row.period, self._publish, rank)
        self._publisher = advertise(bus, row, None if row.latch else self._take_listeners)

    def _take_listeners(self, count: int) -> None:
        if count and self._watch is None:
            self._watch = self._simulation.watch(self._row.name, self._row.period, self._publish, self._rank)
        elif not count and self._watch is not None:
            self._watch.cancel()
            self._watch = None

    def publish(self) -> None:
        """A message now, besides those at the rate."""
        if self._watch is not None:
            self._publish(0)

    def _publish(self, _index: int) -> None:
        message = self._build()
        if message is not None:
            self._publisher.publish(message)


class Streamed(Generic[R]):
    """A topic that passes on what a sensor measures: always if it is latched, else while it has a listener.

    Args:
        row: the topic in the contract's table.
        listen: begins to listen to the sensor, with a function that takes readings; returns what ends it.
        build: makes the message of a reading; None when there is nothing to say.
        is_deferred: on a latched topic that nobody listens to, build when the message is needed. The reading alone
            must determine the message then.
    """

    def __init__(
        self,
        bus: Bus,
        row: Row,
        listen: Callable[[Callable[[R], None]], Callable[[], None]],
        build: Callable[[R], Message | None],
        *,
        is_deferred: bool = False,
    ) -> None:
        self._listen = listen
        self._build = build
        self._leave: Callable[[], None] | None = None
        self._publisher = advertise(bus, row, None if row.latch else self._take_listeners)
        if row.latch:
            self._leave = listen(self._offer if is_deferred else self._publish)

    def _take_listeners(self, count: int) -> None:
        if count and self._leave is None:
            self._leave = self._listen(self._publish)
        elif not count and self._leave is not None:
            self._leave()
            self._leave = None

    def _publish(self, reading: R) -> None:
        message = self._build(reading)
        if message is not None:
            self._publisher.publish(message, measured=reading.time_ns)

    def _offer(self, reading: R) -> None:
        self._publisher.offer(partial(self._build, reading))


def advertise(bus: Bus, row: Row, on_listeners: Callable[[int], None] | None = None) -> Publisher:
    """A publisher for a topic as the contract's table has it."""
    return bus.advertise(
        row.name, row.type, latch=row.latch, rate=row.rate_text, node=row.node, on_listeners=on_listeners
    )
