"""Publishing only while somebody listens."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from cellwright.bus import Bus, Publisher
from cellwright.contracts.table import Row
from cellwright.messages import Message
from cellwright.simulation.simulation import Simulation
from cellwright.simulation.watches import Watch


class Sampled:
    """A topic that has a message at its rate as long as it has a listener.

    Args:
        row: the topic in the contract's table.
        period: time between two messages [s]; None: one in each step.
        build: makes the message, from the state of this tick; None when there is nothing to say.
        rank: of topics that are due together, lower ones come first.
    """

    def __init__(
        self,
        bus: Bus,
        simulation: Simulation,
        row: Row,
        period: Fraction | None,
        build: Callable[[], Message | None],
        *,
        rank: int = 0,
    ) -> None:
        self._simulation = simulation
        self._row = row
        self._period = period
        self._build = build
        self._rank = rank
        self._watch: Watch | None = None
        self._publisher = advertise(bus, row, self._take_listeners)

    def _take_listeners(self, count: int) -> None:
        if count and self._watch is None:
            self._watch = self._simulation.watch(self._row.name, self._period, self._publish, self._rank)
        elif not count and self._watch is not None:
            self._watch.cancel()
            self._watch = None

    def publish(self) -> None:
        """A message now, if somebody listens."""
        if self._publisher.listeners:
            self._publish(0)

    def _publish(self, _index: int) -> None:
        message = self._build()
        if message is not None:
            self._publisher.publish(message)


class Streamed:
    """A topic that passes on what a sensor measures, as long as it has a listener.

    Args:
        row: the topic in the contract's table.
        listen: begins to listen to the sensor, with the function that publishes; returns what ends it.
    """

    def __init__(self, bus: Bus, row: Row, listen: Callable[[Callable[[Message], None]], Callable[[], None]]) -> None:
        self._listen = listen
        self._leave: Callable[[], None] | None = None
        self._publisher = advertise(bus, row, self._take_listeners)

    def _take_listeners(self, count: int) -> None:
        if count and self._leave is None:
            self._leave = self._listen(self._publisher.publish)
        elif not count and self._leave is not None:
            self._leave()
            self._leave = None


def advertise(bus: Bus, row: Row, on_listeners: Callable[[int], None] | None = None) -> Publisher:
    """A publisher for a topic as the contract's table has it."""
    return bus.advertise(
        row.name, row.type, latch=row.latch, rate=row.rate_text, node=row.node, on_listeners=on_listeners
    )
