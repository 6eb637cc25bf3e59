"""What a client does to a cell, noted down, and played into another cell that nobody listens to."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from cellwright.cell import Cell
from cellwright.client.transports.in_process import InProcess
from cellwright.client.transports.transport import Callback
from cellwright.errors import CellwrightError


@dataclass(frozen=True)
class Command:
    """Something that a client did.

    Attributes:
        tick: how many ticks had passed.
        name: of the topic or service.
        message: what was published, or the request.
        is_call: whether a service was called.
    """

    tick: int
    name: str
    message: Any
    is_call: bool


class NotingTransport:
    """A client's way to a cell in this process, that notes what the client does."""

    def __init__(self, inner: InProcess) -> None:
        self._inner = inner
        self.node = inner.node
        self.commands: list[Command] = []

    def now(self) -> int:
        """Simulation time [ns]."""
        return self._inner.now()

    def advance(self, until: int | None, finished: Callable[[], bool] | None = None) -> None:
        """Let time pass."""
        self._inner.advance(until, finished)

    def subscribe(self, topic: str, callback: Callback, *, passive: bool = False) -> Callable[[], None]:
        """Listen, which leaves the cell as it is and is not noted."""
        return self._inner.subscribe(topic, callback, passive=passive)

    def publish(self, topic: str, message: Any) -> None:
        """Send a message, and note it."""
        self._note(topic, message, is_call=False)
        self._inner.publish(topic, message)

    def call(self, service: str, request: Any) -> Any:
        """Call a service, and note it."""
        self._note(service, request, is_call=True)
        return self._inner.call(service, request)

    knows_all_topics = True

    def topics(self) -> dict[str, str]:
        """Types of the topics that the cell publishes, by name."""
        return self._inner.topics()

    def close(self) -> None:
        """Leave every topic."""
        self._inner.close()

    def _note(self, name: str, message: Any, *, is_call: bool) -> None:
        self.commands.append(Command(self._inner.cell.simulation.clock.tick, name, message, is_call))


def play(cell: Cell, commands: Iterable[Command], until: int, *, node: str) -> None:
    """Let a cell run until a time [ns], and do to it what was noted; what was refused then is refused again."""
    simulation, bus = cell.simulation, cell.bus
    for command in commands:
        simulation.step_until(simulation.clock.time_of(command.tick))
        with suppress(CellwrightError):
            (bus.call if command.is_call else bus.publish)(command.name, command.message, node=node)
    simulation.step_until(until)
