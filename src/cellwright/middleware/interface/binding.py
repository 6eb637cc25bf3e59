"""Binding of an interface: every row of a table put on a bus, with the handler that it names."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus, Direction, Publisher
from cellwright.middleware.interface.sampling import R, Sampled, Streamed, advertise
from cellwright.middleware.interface.table import Kind, Row
from cellwright.middleware.messages import Message
from cellwright.middleware.messages.conversions import stamp
from cellwright.middleware.messages.standard import Clock
from cellwright.util.errors import UsageError

_CLOCK_RANK = -10  # a message never comes before the clock that it is stamped with


@dataclass(frozen=True, slots=True)
class Output:
    """A topic that is about to be published: its handler says where the messages come from, by one of the methods.

    Attributes:
        bus: where it is published.
        simulation: the time.
        row: the topic in the table.
        rank: of topics that are due together, lower ones come first: the row's place in the table, from 1.
    """

    bus: Bus
    simulation: Simulation
    row: Row
    rank: int

    def advertise(self) -> Publisher:
        """Publish whenever the handler has a message."""
        return advertise(self.bus, self.row)

    def sample(self, build: Callable[[], Message | None]) -> Sampled:
        """Publish at the row's rate; see `Sampled`."""
        return Sampled(self.bus, self.simulation, self.row, build, rank=self.rank)

    def stream(
        self,
        listen: Callable[[Callable[[R], None]], Callable[[], None]],
        build: Callable[[R], Message | None],
        *,
        is_deferred: bool = False,
    ) -> Streamed[R]:
        """Publish the readings of a sensor; see `Streamed`."""
        return Streamed(self.bus, self.row, listen, build, is_deferred=is_deferred)


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
