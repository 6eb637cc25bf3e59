"""Simulation time: the clock, the inbox of commands, the event queue and periodic callbacks.

Time is a whole number of ticks, read as whole nanoseconds and never accumulated. A watch is not an event: it belongs to
a listener and exists only as long as that needs it. It is neither in the state hash nor in a snapshot.
"""

import heapq
from collections import deque
from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

from cellwright.util.errors import UsageError

NANOSECONDS = 1_000_000_000
NEVER = 1 << 62
"""A time [ns] that no run reaches (146 years)."""


def nanoseconds(seconds: float | Fraction) -> int:
    """Convert seconds to whole nanoseconds, rounded to nearest."""
    return round(Fraction(seconds) * NANOSECONDS)


def seconds(time: int) -> float:
    """Convert whole nanoseconds to seconds."""
    return time / NANOSECONDS


class Cadence:
    """Due times of periodic samples: sample n is due at `round(n * 10^9 * period)` [ns].

    Args:
        period: time between two samples [s], above 0.
        kind: name of the period in errors.

    Raises:
        UsageError: the period is not above 0.
    """

    def __init__(self, period: Fraction, kind: str = "period") -> None:
        if period <= 0:
            raise UsageError(f"{kind} must be above 0 s (got {period})")
        self.period = period
        self._numerator = period.numerator * NANOSECONDS
        self._denominator = period.denominator
        self._half = self._denominator // 2

    @property
    def ratio(self) -> tuple[int, int, int]:
        """Numbers a, b, c with which sample n is due at `(n * a + b) // c` [ns]."""
        return self._numerator, self._half, self._denominator

    def due(self, index: int) -> int:
        """Return the due time of sample `index` [ns]."""
        return (index * self._numerator + self._half) // self._denominator

    def first_at(self, time: int) -> int:
        """Return the number of the first sample due at or after `time` [ns]."""
        index = max(0, time * self._denominator // self._numerator - 1)
        while self.due(index) < time:
            index += 1
        return index


class Clock:
    """Clock that counts ticks of a rational length; `now` is always `round(tick * 10^9 * timestep)` [ns].

    Devices schedule by `now`, the time of the run. Clients see message time, which is `offset` ahead of `now`: a reset
    of the state alone leaves it going on, and one of the time alone sets it to 0.

    Args:
        timestep: length of a tick [s].
    """

    def __init__(self, timestep: Fraction) -> None:
        self.timestep = timestep
        ticks = Cadence(timestep, "timestep")
        self.time_of = ticks.due
        """Time [ns] at a tick."""
        self.first_tick_at = ticks.first_at
        """The first tick whose time is at or after a time [ns]."""
        self._ratio = ticks.ratio
        self.tick = 0
        self.now = 0
        self.offset = 0
        """Message time [ns] at tick 0: above 0 after a reset of the state alone, below after one of the time alone.
        It is no part of the state."""

    def read(self) -> int:
        """Return `now` [ns], for callers that take a function."""
        return self.now

    def message_time(self) -> int:
        """Return the time that messages carry [ns]: stamps, /clock, and the time of clients."""
        return self.now + self.offset

    def restart_message_time(self) -> None:
        """Let message time begin at 0 now, while the run goes on."""
        self.offset = -self.now

    def advance(self) -> int:
        """Advance by one tick; return the new time [ns]."""
        self.tick = tick = self.tick + 1
        numerator, half, denominator = self._ratio
        # `time_of`, without the call: each tick does this
        self.now = now = (tick * numerator + half) // denominator
        return now

    def times(self, tick: int, count: int, ahead: int = 0) -> list[int]:
        """Return the times of `count` ticks [ns] from `tick` on, each `ahead` [ns] of the time of the run."""
        numerator, half, denominator = self._ratio
        length, rest = divmod(numerator, denominator)
        if not rest:  # whole nanoseconds, as nearly always
            return list(range(tick * length + ahead, (tick + count) * length + ahead, length))
        return [(each * numerator + half) // denominator + ahead for each in range(tick, tick + count)]

    def set_tick(self, tick: int) -> None:
        """Set the tick, as after a restore."""
        self.tick = tick
        self.now = self.time_of(tick)


class Inbox:
    """Queue of commands from any thread, executed in order by the thread that steps the simulation.

    A command from any transport thus takes effect at one well-defined tick: before the next step.
    """

    def __init__(self) -> None:
        self.waiting: deque[Callable[[], None]] = deque()  # append and popleft are atomic
        """Commands to execute, the oldest first; an attribute, because every tick looks whether there are any."""

    def __len__(self) -> int:
        return len(self.waiting)

    def put(self, command: Callable[[], None]) -> None:
        """Add a command, from any thread."""
        self.waiting.append(command)

    def empty(self) -> None:
        """Execute the commands that were waiting at the start of the call.

        Later ones wait for the next tick, so that a flood of commands cannot stop time.
        """
        for _ in range(len(self.waiting)):
            self.waiting.popleft()()


class Event(NamedTuple):
    """A device's scheduled event: it happens at the first tick at or after `time` [ns].

    Events at the same time happen by priority, the lower first, then in the order of scheduling. The arguments are JSON
    values.
    """

    time: int
    priority: int
    serial: int
    device: str
    kind: str
    arguments: tuple[Any, ...]


class EventQueue:
    """Queue of events, sorted by (time, priority, serial)."""

    def __init__(self) -> None:
        self._heap: list[Event] = []
        self._serial = 0
        self.next_due = NEVER
        """Time of the earliest event [ns], or `NEVER`; an attribute, because every tick reads it."""

    def schedule(self, time: int, device: str, kind: str, arguments: tuple[Any, ...], priority: int) -> None:
        """Add an event at `time` [ns]; see `Event`."""
        heapq.heappush(self._heap, Event(time, priority, self._serial, device, kind, arguments))
        self._serial += 1
        self._refresh()

    def pop_due(self, now: int) -> Event | None:
        """Remove and return the first event due at or before `now` [ns], or None."""
        if self.next_due > now or not self._heap:
            return None
        event = heapq.heappop(self._heap)
        self._refresh()
        return event

    def cancel(self, device: str, kind: str) -> None:
        """Remove all events of one kind that a device has scheduled."""
        self._put([event for event in self._heap if (event.device, event.kind) != (device, kind)])

    def clear(self) -> None:
        """Remove all events and reset the serial number."""
        self._serial = 0
        self._put([])

    def get_state(self) -> dict[str, Any]:
        """Return the queue as JSON values, in order."""
        return {
            "serial": self._serial,
            "events": [[*event[:-1], list(event.arguments)] for event in sorted(self._heap)],
        }

    def set_state(self, state: dict[str, Any]) -> None:
        """Restore the state that `get_state` returned."""
        self._serial = state["serial"]
        self._put([Event._make([*event[:-1], tuple(event[-1])]) for event in state["events"]])

    def _put(self, events: list[Event]) -> None:
        heapq.heapify(events)
        self._heap = events
        self._refresh()

    def _refresh(self) -> None:
        self.next_due = self._heap[0].time if self._heap else NEVER


class PeriodicCallback:
    """Periodic callback `action(index)` with the sample number; sample n is due at n times the period."""

    def __init__(self, name: str, cadence: Cadence | None, action: Callable[[int], None], rank: int) -> None:
        self.name = name
        self.cadence = cadence
        self.action = action
        self.rank = rank
        self.active = True

    def cancel(self) -> None:
        """Stop the calls for good."""
        self.active = False


class PeriodicCallbacks:
    """All watches of a simulation, in the order of (due time, rank, order of creation).

    Watches of each tick run after the periodic ones of that tick, or before them if their rank is below 0.
    """

    def __init__(self) -> None:
        self._heap: list[tuple[int, int, int, int, PeriodicCallback]] = []
        self._serial = 0
        # of each tick: those before the periodic ones, and those after them
        self._early: list[PeriodicCallback] = []
        self._late: list[PeriodicCallback] = []
        self.next_due = NEVER

    def add(
        self, name: str, period: Fraction | None, action: Callable[[int], None], now: int, rank: int = 0
    ) -> PeriodicCallback:
        """Add a periodic callback.

        Args:
            name: name of the watch.
            period: time between two calls [s]; None: each tick.
            action: called with the sample number.
            now: present time [ns]; the first call comes at the first due time after it.
            rank: order among watches that are due at the same time, the lower first.

        Returns:
            The watch, to cancel it.
        """
        if period is None:
            watch = PeriodicCallback(name, None, action, rank)
            each_tick = sorted([*self._early, *self._late, watch], key=lambda each: each.rank)
            self._early = [each for each in each_tick if each.rank < 0]
            self._late = [each for each in each_tick if each.rank >= 0]
        else:
            watch = PeriodicCallback(name, Cadence(period), action, rank)
            self._push(watch, now)
        self._refresh()
        return watch

    def run_due(self, now: int, tick: int) -> None:
        """Call every watch due at or before `now` [ns]."""
        # a watch added in this tick runs from the next one on
        late, some_left = self._late, False
        for watch in self._early:
            if watch.active:
                watch.action(tick)
            else:
                some_left = True
        heap = self._heap
        while heap and heap[0][0] <= now:
            _due, rank, serial, index, watch = heap[0]
            if not watch.active or watch.cadence is None:
                heapq.heappop(heap)
                continue
            following = watch.cadence.due(index + 1)
            # a period shorter than a tick: one sample a tick
            if following <= now:
                index = watch.cadence.first_at(now + 1) - 1
                following = watch.cadence.due(index + 1)
            heapq.heapreplace(heap, (following, rank, serial, index + 1, watch))
            watch.action(index)
        for watch in late:
            if watch.active:
                watch.action(tick)
            else:
                some_left = True
        if some_left:
            self._early = [watch for watch in self._early if watch.active]
            self._late = [watch for watch in self._late if watch.active]
        self._refresh()

    def reschedule(self, now: int) -> None:
        """Reschedule all watches after a jump of time (reset or restore)."""
        watches = [entry[4] for entry in sorted(self._heap, key=lambda entry: entry[2])]
        self._heap = []
        for watch in watches:
            if watch.active:
                self._push(watch, now)
        self._refresh()

    def _push(self, watch: PeriodicCallback, now: int) -> None:
        if watch.cadence is not None:
            index = watch.cadence.first_at(now + 1)
            heapq.heappush(self._heap, (watch.cadence.due(index), watch.rank, self._serial, index, watch))
            self._serial += 1

    def _refresh(self) -> None:
        if self._early or self._late:
            self.next_due = 0
        else:
            self.next_due = self._heap[0][0] if self._heap else NEVER
