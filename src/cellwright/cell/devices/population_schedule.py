"""When which part appears on the conveyor.

Pure logic, exact: times are whole nanoseconds and the belt's progress is a fraction of them, so it makes no difference
whether somebody asks at every step or only when the next part is due.

The list of parts is gone through by time at full power; at half power everything takes twice as long. A change of
power leaves what has passed as it is, so that parts keep their distance on the belt. When the last part has appeared
the list begins anew, at once. Clones of a type are counted on through all rounds; only as many as the pool has are
there.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import ceil
from typing import Any

from cellwright.config.trial.trial import BeltPart
from cellwright.engine.clock import nanoseconds
from cellwright.engine.events import NEVER
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose


@dataclass(frozen=True, slots=True)
class Appearance:
    """A part that is to appear: clone number `clone` of its type, at `pose` in the spawn frame.

    Where `in_pool` is false the pool has no such clone any more, and nothing appears.
    """

    type: str
    clone: int
    pose: Pose
    in_pool: bool

    @property
    def name(self) -> str:
        """The name of its model."""
        return f"populate_conveyor|{self.type}_clone_{self.clone}"


class PopulationSchedule:
    """The list of parts, and how far it has been gone through.

    Args:
        parts: what is to appear and when [s after the start, at full power].
        cycles: how many rounds the pool of parts is enough for.
        delay: how much later [s at full power] the first round begins, each time somebody starts the list.
    """

    def __init__(self, parts: Sequence[BeltPart], cycles: int = 1, delay: float = 0.0) -> None:
        self._start = Fraction(-nanoseconds(delay))
        self.parts = tuple(sorted(parts, key=lambda part: part.time))
        self._due = [nanoseconds(part.time) for part in self.parts]
        self._pool = Counter({type_: count * cycles for type_, count in Counter(p.type for p in self.parts).items()})
        self.reset()

    def reset(self) -> None:
        """Begin a run: paused at the beginning of the list, at full power, no clone used."""
        self.running = False
        self._rate = Fraction(1)
        self._anchor = 0
        self._progress = self._start
        self._index = 0
        self._clones: Counter[str] = Counter()
        self._last_pop = -1

    def progress(self, now: int) -> Fraction:
        """How far into the list it is at `now` [ns], in nanoseconds at full power."""
        return self._progress + (now - self._anchor) * self._rate if self.running else self._progress

    def restart(self, now: int) -> None:
        """Go through the list from its beginning, from `now` [ns] on. Clones are counted on."""
        self.running = True
        self._index, self._anchor, self._progress = 0, now, self._start

    def pause(self, now: int) -> None:
        """Stand still from `now` [ns] on."""
        self._anchor, self._progress = now, self.progress(now)
        self.running = False

    def resume(self, now: int) -> None:
        """Go on from `now` [ns] on where it stood still."""
        self._anchor, self._progress = now, self.progress(now)
        self.running = True

    def set_power(self, power: float, now: int) -> None:
        """Go on at the pace of the belt from `now` [ns] on.

        Args:
            power: power of the belt, 0 to 100.
            now: the time [ns].

        Raises:
            UsageError: no such power.
        """
        if not 0.0 <= power <= 100.0:
            raise UsageError(f"a belt's power is 0 to 100, not {power}")
        self._anchor, self._progress = now, self.progress(now)
        self._rate = Fraction(power) / 100

    def next_due(self) -> int:
        """When the next part is due [ns], unless something is changed before; `NEVER` if none is.

        It is always later than the last part's appearance: at most one appears in a step.
        """
        if not self.running or not self.parts:
            return NEVER
        missing = self._due[self._index] - self._progress
        if missing <= 0:
            due = self._anchor
        elif self._rate == 0:
            return NEVER
        else:
            due = self._anchor + ceil(missing / self._rate)
        return min(max(due, self._last_pop + 1), NEVER)

    def pop(self, now: int) -> Appearance | None:
        """The part that appears at `now` [ns], if one is due."""
        if now < self.next_due():
            return None
        part = self.parts[self._index]
        clone = self._clones[part.type]
        self._clones[part.type] += 1
        self._index += 1
        self._last_pop = now
        if self._index == len(self.parts):
            self._index, self._anchor, self._progress = 0, now, Fraction(0)
        return Appearance(part.type, clone, part.pose, clone < self._pool[part.type])

    def get_state(self) -> dict[str, Any]:
        """All that is remembered, as JSON values."""
        return {
            "running": self.running,
            "rate": list(self._rate.as_integer_ratio()),
            "anchor": self._anchor,
            "progress": list(self._progress.as_integer_ratio()),
            "index": self._index,
            "clones": dict(self._clones),
            "last_pop": self._last_pop,
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Take over what `get_state` returned."""
        self.running = state["running"]
        self._rate = Fraction(*state["rate"])
        self._anchor = state["anchor"]
        self._progress = Fraction(*state["progress"])
        self._index = state["index"]
        self._clones = Counter(state["clones"])
        self._last_pop = state["last_pop"]
