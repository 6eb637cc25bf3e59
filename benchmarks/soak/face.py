"""Subject of a long run: a cell or a robot with a program that works it in rounds."""

from __future__ import annotations

from collections import Counter
from typing import Protocol

from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus

ROUND = 36_000_000_000
"""Simulation time [ns] of a round: a hundred in an hour."""


class Face(Protocol):
    """A cell or a robot at work.

    Its program depends on time alone. After a restore at the border between two rounds it continues in a new process as
    in the old one.
    """

    simulation: Simulation
    counts: Counter[str]
    """Counts of actions and messages so far, in this process."""

    def begin(self) -> None:
        """Do the initial work, at time 0."""

    def work(self, number: int) -> None:
        """Run a round, from `number * ROUND` on."""


class MessageCounter:
    """Listens to topics and keeps only the number of messages."""

    def __init__(self, bus: Bus, counts: Counter[str]) -> None:
        self._bus = bus
        self._counts = counts

    def listen(self, topic: str) -> None:
        """Count the messages of a topic."""

        def count(_message: object) -> None:
            self._counts["messages received"] += 1

        self._bus.subscribe(topic, count, node="/endurance")
