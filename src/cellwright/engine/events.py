"""One queue of what is to happen, ordered by (time, priority, serial). Events are data, so a queue can be saved."""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True, order=True)
class Event:
    """Something a device wants to be told at a time.

    Attributes:
        time: when it is due [ns]; it happens at the first tick at or after that.
        priority: lower goes first among events of one time.
        serial: order of scheduling; breaks what ties are left.
        device: name of the device that handles it.
        kind: what is to happen, in the device's own words.
        arguments: JSON values.
    """

    time: int
    priority: int
    serial: int
    device: str
    kind: str
    arguments: tuple[Any, ...]


NEVER = 1 << 62
"""A time [ns] that no run reaches (146 years)."""


class EventQueue:
    """Events by (time, priority, serial)."""

    def __init__(self) -> None:
        self._heap: list[tuple[int, int, int, Event]] = []
        self._serial = 0
        self.next_due = NEVER
        """Time of the earliest event [ns], or `NEVER`: an attribute, because every tick looks at it."""

    def __len__(self) -> int:
        return len(self._heap)

    def schedule(self, time: int, device: str, kind: str, arguments: tuple[Any, ...], priority: int) -> Event:
        """Put an event into the queue."""
        event = Event(time, priority, self._serial, device, kind, arguments)
        self._serial += 1
        heapq.heappush(self._heap, (time, priority, event.serial, event))
        self.next_due = self._heap[0][0]
        return event

    def pop_due(self, now: int) -> Event | None:
        """Take the first event due at or before `now` [ns], if there is one."""
        if self.next_due > now or not self._heap:
            return None
        event = heapq.heappop(self._heap)[3]
        self._refresh()
        return event

    def cancel(self, device: str, kind: str) -> int:
        """Take out every event of one kind that a device is waiting for; how many there were."""
        kept = [entry for entry in self._heap if not (entry[3].device == device and entry[3].kind == kind)]
        removed = len(self._heap) - len(kept)
        if removed:
            heapq.heapify(kept)
            self._heap = kept
            self._refresh()
        return removed

    def clear(self) -> None:
        """Forget everything, the serial number too."""
        self._heap.clear()
        self._serial = 0
        self._refresh()

    def get_state(self) -> dict[str, Any]:
        """The queue as JSON values, in order."""
        return {
            "serial": self._serial,
            "events": [
                [e.time, e.priority, e.serial, e.device, e.kind, list(e.arguments)]
                for *_, e in sorted(self._heap, key=lambda entry: entry[:3])
            ],
        }

    def set_state(self, state: dict[str, Any]) -> None:
        """Take over what `get_state` returned."""
        self._serial = state["serial"]
        events = (
            Event(time, priority, serial, device, kind, tuple(arguments))
            for time, priority, serial, device, kind, arguments in state["events"]
        )
        self._heap = [(event.time, event.priority, event.serial, event) for event in events]
        heapq.heapify(self._heap)
        self._refresh()

    def _refresh(self) -> None:
        self.next_due = self._heap[0][0] if self._heap else NEVER
