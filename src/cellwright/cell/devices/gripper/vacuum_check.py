"""When the vacuum gripper takes hold of a part, when it loses one, and why it does not.

Pure logic: a device asks `due`, brings the contacts of the cup to `check`, and carries out what comes back.

While it is switched on the gripper looks at its contacts at most every 0.1 s of simulation time; at once when it is
switched on, if the last look is that long ago. A counter rises by one at a look with a contact that counts, and falls
by one (not below zero) at a look without. A part is taken hold of at a look where the counter is above one and the
cup stands square enough on the part. Switching does not reset the counter.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from math import acos, degrees
from typing import Any, Final, Literal

from cellwright.engine.clock import NANOSECONDS
from cellwright.engine.events import NEVER

PERIOD: Final = NANOSECONDS // 10
"""Time between two looks at the contacts [ns]."""

CONTACTS_NEEDED: Final = 1
"""The counter must be above this."""

ALIGNMENT_NEEDED: Final = 0.95
"""The cosine between contact normal and cup axis must be above this (18.2 deg)."""


class Touched(Enum):
    """What the cup may be in contact with."""

    PART = "a part"
    MOVABLE = "something that moves but is no part"
    """A tray, an AGV or the belt: it counts as a contact, but the suction holds parts only."""
    FIXED = "something fixed"
    """A bin or the workcell: it does not count."""


@dataclass(frozen=True, slots=True)
class CupContact:
    """One contact of the suction face.

    Attributes:
        name: what is touched.
        kind: which kind of thing that is.
        alignment: cosine between the contact normal and the axis of the cup, 1 when the cup stands square on it.
    """

    name: str
    kind: Touched
    alignment: float


@dataclass(frozen=True, slots=True)
class Verdict:
    """What a look at the contacts comes to: take hold of `part`, lose it to a forced drop, or go on as it is."""

    action: Literal["attach", "drop", "none"] = "none"
    part: str | None = None


NOTHING: Final = Verdict()


class VacuumCheck:
    """The suction logic.

    Args:
        phase: by default a look is taken as soon as the gripper is switched on. With a phase [ns] looks are taken at
            that time after each whole 0.1 s only, as if the gripper had a clock of its own.
    """

    def __init__(self, phase: int | None = None) -> None:
        self.phase = None if phase is None else phase % PERIOD
        self.reset()

    def reset(self) -> None:
        """Begin a run: switched off, holding nothing."""
        self.enabled = False
        self.part: str | None = None
        """The part that is held."""
        self.counter = 0
        self.reason = "disabled"
        """Why nothing is held, as of the last look; empty while a part is held."""
        self.lost_reason = ""
        """Why the last part was lost: `released`, `forced drop`, or what `lose` was told; empty if none was yet."""
        self.next_look = NEVER
        """When the next look is due [ns]; `NEVER` while switched off."""
        self._last_look: int | None = None

    @property
    def attached(self) -> bool:
        """Whether a part is held."""
        return self.part is not None

    def enable(self, now: int) -> None:
        """Switch on at `now` [ns]. Nothing happens if it is on."""
        if not self.enabled:
            self.enabled = True
            self.reason = "waiting for the first check"
            self.next_look = self._look_after(now)

    def disable(self) -> str | None:
        """Switch off; the part that is to be let go, if one was held."""
        self.enabled = False
        self.next_look = NEVER
        part = self.lose("released")
        self.reason = "disabled"
        return part

    def lose(self, reason: str) -> str | None:
        """Note that the part that is held, if one is, is held no longer; which one it was."""
        part, self.part = self.part, None
        if part is not None:
            self.reason = self.lost_reason = reason
        return part

    def due(self, now: int) -> bool:
        """Whether it is time for `check` at `now` [ns]."""
        return now >= self.next_look

    def check(
        self, now: int, contacts: Sequence[CupContact], is_dropped: Callable[[str], bool] = lambda _: False
    ) -> Verdict:
        """Look at the contacts. It must be `due`.

        Args:
            now: the time [ns].
            contacts: all contacts of the cup's suction face.
            is_dropped: whether a part that is held is to be dropped where it is now.

        Returns:
            what to do; it is already noted here as done.
        """
        self._last_look = now
        self.next_look = self._look_after(now + 1)
        counted = [contact for contact in contacts if contact.kind is not Touched.FIXED]
        self.counter = self.counter + 1 if counted else max(0, self.counter - 1)
        if self.part is not None:
            return Verdict("drop", self.lose("forced drop")) if is_dropped(self.part) else NOTHING
        parts = [contact for contact in counted if contact.kind is Touched.PART]
        square = [contact for contact in parts if contact.alignment > ALIGNMENT_NEEDED]
        self.reason = _reason(contacts, counted, parts)
        if square and self.counter > CONTACTS_NEEDED:
            best = min(square, key=lambda contact: (-contact.alignment, contact.name))
            self.part, self.reason = best.name, ""
            return Verdict("attach", best.name)
        return NOTHING

    def get_state(self) -> dict[str, Any]:
        """All that is remembered, as JSON values."""
        return {
            "enabled": self.enabled,
            "part": self.part,
            "counter": self.counter,
            "reason": self.reason,
            "lost_reason": self.lost_reason,
            "next_look": self.next_look,
            "last_look": self._last_look,
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Take over what `get_state` returned."""
        self.enabled = state["enabled"]
        self.part = state["part"]
        self.counter = state["counter"]
        self.reason = state["reason"]
        self.lost_reason = state["lost_reason"]
        self.next_look = state["next_look"]
        self._last_look = state["last_look"]

    def _look_after(self, time: int) -> int:
        """When the first look at or after `time` [ns] may be taken."""
        if self.phase is not None:
            return time + (self.phase - time) % PERIOD
        return time if self._last_look is None else max(time, self._last_look + PERIOD)


def _reason(contacts: Sequence[CupContact], counted: Sequence[CupContact], parts: Sequence[CupContact]) -> str:
    """Why nothing was taken hold of, unless the counter is all that is missing."""
    if not contacts:
        return "no contact"
    if not counted:
        return f"contact with something fixed: {contacts[0].name}"
    if not parts:
        return f"contact with {counted[0].name}, which is no part"
    best = max(contact.alignment for contact in parts)
    if best <= ALIGNMENT_NEEDED:
        tilt = degrees(acos(max(-1.0, best)))
        return f"tilted: {tilt:.1f} deg > {degrees(acos(ALIGNMENT_NEEDED)):.1f}"
    return "waiting for a second check"
