"""A cell or a robot made again from what a recording carries, that does what was done to it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from cellwright.middleware.bus.served import Served
from cellwright.recording.format.commands import Command, Extras


class Stamps:
    """The wall clock of a run that is over: it says what it said when the newest command came."""

    def __init__(self) -> None:
        self.now = 0
        """Its time [ns]."""

    def __call__(self) -> int:
        """Its time [ns]."""
        return self.now


@dataclass(frozen=True)
class Rebuilt:
    """What runs again.

    Attributes:
        served: the cell or the robot's node.
        stamps: the clock that its messages are stamped by, where that was the wall's.
        extras: what can be done to it past the bus, by name.
        close: lets go of it.
    """

    served: Served
    stamps: Stamps = field(default_factory=Stamps)
    extras: Extras = field(default_factory=dict)
    close: Callable[[], None] = lambda: None

    def carry_out(self, command: Command) -> None:
        """Do what was done; what was refused then is refused again.

        Raises:
            RecordingError: the command makes no sense.
        """
        if command.stamp is not None:
            self.stamps.now = command.stamp
        command.carry_out(self.served.bus, self.extras)
