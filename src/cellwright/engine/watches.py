"""Looking on: periodic calls that see the simulation and leave it as it is.

A watch is not an event. It belongs to whoever listens, is neither in the state hash nor in a snapshot, and exists only
while somebody wants it, so that nothing is computed for nobody.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from fractions import Fraction

from cellwright.engine.clock import Cadence
from cellwright.engine.events import NEVER


class Watch:
    """A periodic call. `action(index)` gets the sample number; sample n is due at n times the period."""

    def __init__(self, name: str, cadence: Cadence | None, action: Callable[[int], None], rank: int) -> None:
        self.name = name
        self.cadence = cadence
        self.action = action
        self.rank = rank
        self.active = True

    def cancel(self) -> None:
        """Stop for good."""
        self.active = False


class Watches:
    """All watches of a simulation, in the order of (due time, rank, order of creation).

    Those for each tick come after the periodic ones of that tick, or before them if their rank is below 0.
    """

    def __init__(self) -> None:
        self._heap: list[tuple[int, int, int, int, Watch]] = []
        self._serial = 0
        # of each tick: those before the periodic ones, and those after them
        self._early: list[Watch] = []
        self._late: list[Watch] = []
        self.next_due = NEVER

    def add(self, name: str, period: Fraction | None, action: Callable[[int], None], now: int, rank: int = 0) -> Watch:
        """Begin to call `action` each `period` [s], from the first due time after `now` [ns]; None: each tick."""
        if period is None:
            watch = Watch(name, None, action, rank)
            each_tick = sorted([*self._early, *self._late, watch], key=lambda each: each.rank)
            self._early = [each for each in each_tick if each.rank < 0]
            self._late = [each for each in each_tick if each.rank >= 0]
        else:
            watch = Watch(name, Cadence(period), action, rank)
            self._push(watch, now)
        self._refresh()
        return watch

    def run_due(self, now: int, tick: int) -> None:
        """Call every watch due at or before `now`."""
        late, some_left = self._late, False  # who comes in this tick has its turn in the next
        for watch in self._early:
            if watch.active:
                watch.action(tick)
            else:
                some_left = True
        heap = self._heap
        while heap and heap[0][0] <= now:
            _due, rank, serial, index, watch = heapq.heappop(heap)
            if not watch.active or watch.cadence is None:
                continue
            following = watch.cadence.due(index + 1)
            if following <= now:  # a period shorter than a tick: one sample a tick
                index = watch.cadence.first_at(now + 1) - 1
                following = watch.cadence.due(index + 1)
            heapq.heappush(heap, (following, rank, serial, index + 1, watch))
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

    def retime(self, now: int) -> None:
        """Take up again after time has jumped (reset or restore)."""
        watches = [entry[4] for entry in sorted(self._heap, key=lambda entry: entry[2])]
        self._heap = []
        for watch in watches:
            if watch.active:
                self._push(watch, now)
        self._refresh()

    def _push(self, watch: Watch, now: int) -> None:
        if watch.cadence is not None:
            index = watch.cadence.first_at(now + 1)
            heapq.heappush(self._heap, (watch.cadence.due(index), watch.rank, self._serial, index, watch))
            self._serial += 1

    def _refresh(self) -> None:
        if self._early or self._late:
            self.next_due = 0
        else:
            self.next_due = self._heap[0][0] if self._heap else NEVER
