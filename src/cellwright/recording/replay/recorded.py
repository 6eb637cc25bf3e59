"""A recording in the place of a cell or a robot: it is served, bridged and looked at like one."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import mujoco

from cellwright.engine.clock import NANOSECONDS
from cellwright.engine.simulation import Simulation
from cellwright.middleware.messages.standard import Clock, Time
from cellwright.recording.replay.deaf_bus import DeafBus
from cellwright.recording.replay.player import Player
from cellwright.recording.replay.source import Source
from cellwright.recording.replay.wall import stamps_ahead

CLOCK = "/clock"
NODE = "/cellwright_replay"
"""Who says what was not recorded."""

_CLOCK_RATE = 100  # [Hz]
_TIMESTEP = Fraction(1, 500)
_LEAST, _MOST = Fraction(1, 100_000), Fraction(1, 10)  # [s]


class Recorded:
    """Something recorded whose time passes again. It stands at its begin.

    Args:
        source: what was recorded.
        report: takes a line about what is refused, and about what cannot be played.
    """

    in_competition = True
    """Nothing can be changed of what has been."""

    def __init__(self, source: Source, *, report: Callable[[str], None] = lambda _line: None) -> None:
        self.source = source
        self.name = source.header.name
        self.simulation = Simulation(mujoco.MjSpec().compile(), timestep=timestep(source))
        self.bus = DeafBus(lambda: self.simulation.now, report)
        self.player = Player(source, self.bus)
        self.simulation.add(self.player)
        if CLOCK not in source.topics:
            self._tell_time(stamps_ahead(source))
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
        publisher = self.bus.advertise(CLOCK, "rosgraph_msgs/Clock", rate=f"{_CLOCK_RATE} Hz", node=NODE)

        def tell(_index: int) -> None:
            if publisher.listeners:
                second, nanosecond = divmod(self.simulation.now + ahead, NANOSECONDS)
                publisher.publish(Clock(clock=Time(sec=second, nanosec=nanosecond)))

        self.simulation.watch("clock", Fraction(1, _CLOCK_RATE), tell)

    @property
    def is_over(self) -> bool:
        """Whether all has been played."""
        return self.simulation.now >= self.source.end_time

    def seek(self, time: int) -> int:
        """Go to a time [ns], kept within the recording; the time at which it stands then [ns]."""
        self.cuts += 1
        return self.player.seek(time)

    def out_of_sight(self) -> tuple[int, ...]:
        """Ids of bodies that are not there to be seen: what is played has none of the engine's."""
        return ()


def timestep(source: Source) -> Fraction:
    """Length of a tick [s] of what was recorded; 1/500 s where the recording does not say it."""
    told = source.header.facts.get("timestep")
    try:
        found = Fraction(*told) if isinstance(told, list) else Fraction(str(told))
    except (TypeError, ValueError, ZeroDivisionError):
        return _TIMESTEP
    return found if _LEAST <= found <= _MOST else _TIMESTEP
