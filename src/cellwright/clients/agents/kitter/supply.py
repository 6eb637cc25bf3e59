"""Where the next part of a type is best taken from."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from cellwright.clients.agents.kitter.arm import Arm
from cellwright.clients.agents.kitter.belt_watch import BeltPart
from cellwright.clients.agents.kitter.cellview import CellView
from cellwright.clients.agents.kitter.eyes import Sighting
from cellwright.clients.agents.kitter.picking import Picker
from cellwright.clients.client import Client
from cellwright.util.pose import Pose

ATTEMPTS = 4
"""How often a part in one place is tried."""

SOON = 12.0
"""A part that the belt brings within this time [s] goes before those that lie somewhere."""

FIRST_Y, LAST_Y = 1.7, -1.8
"""World y [m] between which parts are taken from the belt."""


@dataclass(frozen=True, slots=True)
class Meeting:
    """A part on the belt that can be met, and world y [m] where."""

    part: BeltPart
    y: float


class Supply:
    """What is there to be taken, and what was tried in vain.

    Args:
        client: whose time.
        view: what is seen of the cell.
        arm: which is somewhere.
        picker: which knows what it can meet.
    """

    def __init__(self, client: Client, view: CellView, arm: Arm, picker: Picker) -> None:
        self._client = client
        self._view = view
        self._arm = arm
        self._picker = picker
        self._failures: Counter[tuple[int, int]] = Counter()
        self._tried: Counter[str] = Counter()
        self._too_far: Counter[str] = Counter()

    def on_belt(self, part_type: str) -> Meeting | None:
        """The first part of a type on the belt that can be met soon."""
        now = self._client.time
        for part in self._view.belt.coming(part_type, now, LAST_Y):
            y = self._picker.meeting_place(part, FIRST_Y, LAST_Y)
            if y is not None and part.time_at(y) < now + SOON:
                return Meeting(part, y)
        return None

    def best(self, part_type: str, lying: Iterable[Sighting]) -> Sighting | None:
        """The part of a type to take: seldom tried, near the rail's place, with much room around it."""
        candidates = [part for part in lying if part.type == part_type and self.failures(part.world_T_part) < ATTEMPTS]
        return min(
            candidates,
            key=lambda part: (
                self.failures(part.world_T_part),
                round(abs(part.world_T_part.position[1] - self._arm.rail), 1),
                -part.world_T_part.position[0],
            ),
            default=None,
        )

    def failures(self, world_T_part: Pose) -> int:
        """How often a part in a place was tried in vain."""
        return self._failures[spot(world_T_part)]

    def note_failure(self, part_type: str, world_T_part: Pose, *, is_in_reach: bool = True) -> None:
        """A part of a type in a place was tried in vain: the cup got no hold of it, or the arm does not reach there."""
        self._failures[spot(world_T_part)] += 1
        (self._tried if is_in_reach else self._too_far)[part_type] += 1

    def why_none(self, part_type: str) -> str:
        """Why no part of a type was to be had."""
        if tried := self._tried[part_type]:
            return f"the cup got no hold of any, in {tried} attempt{'s' if tried > 1 else ''}"
        if self._too_far[part_type]:
            return "those that were seen lie out of the arm's reach"
        if part_type in self._view.not_upright:
            return "those that were seen lie with another side up than ordered, or on something else"
        return "none was seen"


def spot(world_T_part: Pose) -> tuple[int, int]:
    """A place in a bin, as a name for it: to 5 cm."""
    x, y, _ = world_T_part.position
    return round(x / 0.05), round(y / 0.05)
