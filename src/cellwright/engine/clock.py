"""Simulation time: whole ticks, read as whole nanoseconds, never accumulated."""

from fractions import Fraction

from cellwright.util.errors import UsageError

NANOSECONDS = 1_000_000_000


def nanoseconds(seconds: float | Fraction) -> int:
    """Seconds as whole nanoseconds, rounded to nearest."""
    return round(Fraction(seconds) * NANOSECONDS)


def seconds(time: int) -> float:
    """Whole nanoseconds as seconds."""
    return time / NANOSECONDS


class Cadence:
    """The due times of something periodic: sample n is due at `round(n * 10^9 * period)` [ns]."""

    def __init__(self, period: Fraction, kind: str = "period") -> None:
        if period <= 0:
            raise UsageError(f"a {kind} must be above 0 s, not {period}")
        self.period = period
        self._numerator = period.numerator * NANOSECONDS
        self._denominator = period.denominator
        self._half = self._denominator // 2

    def due(self, index: int) -> int:
        """When sample `index` is due [ns]."""
        return (index * self._numerator + self._half) // self._denominator

    def first_at(self, time: int) -> int:
        """Number of the first sample due at or after `time` [ns]."""
        index = max(0, time * self._denominator // self._numerator - 1)
        while self.due(index) < time:
            index += 1
        return index


class Clock:
    """Counts ticks of a rational length; `now` is always `round(tick * 10^9 * timestep)` [ns]."""

    def __init__(self, timestep: Fraction) -> None:
        self.timestep = timestep
        self._ticks = Cadence(timestep, "timestep")
        self.tick = 0
        self.now = 0

    def advance(self) -> int:
        """One tick on; the new time [ns]."""
        self.tick += 1
        self.now = self._ticks.due(self.tick)
        return self.now

    def set_tick(self, tick: int) -> None:
        """Stand at a given tick, as after a restore."""
        self.tick = tick
        self.now = self.time_of(tick)

    def time_of(self, tick: int) -> int:
        """Time [ns] at a tick."""
        return self._ticks.due(tick)

    def first_tick_at(self, time: int) -> int:
        """The first tick whose time is at or after `time` [ns]."""
        return self._ticks.first_at(time)
