"""Agreement of the arms of a cell that work at once: who builds which kit, and who takes which part."""

from __future__ import annotations

from collections.abc import Iterable, Sequence, Set
from typing import TypeAlias

from cellwright.clients.agents.kitter.perception import Sighting, TrackedBeltPart, distance

SAME_PART = 0.05
"""Distance [m] within which a part that lies somewhere is the same for two arms."""

Part: TypeAlias = Sighting | TrackedBeltPart


class Agreement:
    """Kits and parts by the arm that has them.

    Args:
        locations: locations of the stations of each arm.
    """

    def __init__(self, locations: Sequence[Iterable[str]] = ((),)) -> None:
        self.locations = [frozenset(each) for each in locations]
        self.builders: dict[str, int] = {}
        """Arm by kit, those that were sent included."""
        self.open: list[set[str]] = [set() for _ in locations]
        """Kits that each arm builds now."""
        self.parts: dict[int, Part] = {}
        """Part that an arm is about to take."""
        self.gone: list[Part] = []
        """Parts that were taken off belts: the others may have seen them there."""
        self.changes = 0
        """Number of times that something was moved."""

    def share(self, number: int = 0) -> Share:
        """Return the share of an arm."""
        return Share(self, number)


class Share:
    """Share of an arm, which has a `number`, in an agreement."""

    def __init__(self, agreement: Agreement, number: int) -> None:
        self._all = agreement
        self._number = number
        self._seen = 0

    def has_kit(self, kit_type: str) -> bool:
        """Return whether this arm builds a kit or may still do so: no other one does."""
        return self._all.builders.get(kit_type, self._number) == self._number

    def reports(self, kit_type: str) -> bool:
        """Return whether this arm reports of a kit: the first one does of those that none has begun."""
        return self._all.builders.get(kit_type, 0) == self._number

    def take_kit(self, kit_type: str, allowed: Set[str]) -> bool:
        """Take a kit that may be built at some locations; False if another arm has it, or has less to do.

        An arm counts that has a tray free for it.
        """
        shares = self._all
        own = len(shares.open[self._number])
        others = [
            len(kits) < min(own, len(locations & allowed))
            for kits, locations in zip(shares.open, shares.locations, strict=True)
        ]
        if not self.has_kit(kit_type) or any(others):
            return False
        shares.builders[kit_type] = self._number
        shares.open[self._number].add(kit_type)
        return True

    def end_kit(self, kit_type: str) -> None:
        """Note that a kit was sent."""
        self._all.open[self._number].discard(kit_type)

    def is_free(self, part: Part) -> bool:
        """Return whether no other arm is about to take a part, and none has taken it off its belt."""
        others = (each for number, each in self._all.parts.items() if number != self._number)
        return not any(_is_same(part, each) for each in (*others, *self._all.gone))

    def take_part(self, part: Part) -> None:
        """Note that the arm is about to take a part."""
        self._all.parts[self._number] = part

    def end_part(self, *, is_taken: bool) -> None:
        """Note whether it has taken it; in both cases images of it are out of date."""
        part = self._all.parts.pop(self._number)
        if is_taken and isinstance(part, TrackedBeltPart):
            self._all.gone.append(part)
        self._all.changes += 1
        self._seen += 1

    def has_news(self) -> bool:
        """Return whether other arms have moved something since the last call."""
        is_new = self._seen != self._all.changes
        self._seen = self._all.changes
        return is_new


def _is_same(one: Part, other: Part) -> bool:
    if one.type != other.type:
        return False
    if isinstance(one, TrackedBeltPart) and isinstance(other, TrackedBeltPart):
        return one.belt.belt.name == other.belt.belt.name and other.is_near(one.pose(0.0), 0.0)
    if isinstance(one, Sighting) and isinstance(other, Sighting):
        return distance(one.world_T_part, other.world_T_part) < SAME_PART
    return False
