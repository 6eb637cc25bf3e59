"""Supply of parts for the kitter: which part of a type to fetch, from the belt or at rest, and why there is none."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from cellwright.clients.agents.kitter.agreement import Share
from cellwright.clients.agents.kitter.arm import KitterArm
from cellwright.clients.agents.kitter.cell_view import CellView
from cellwright.clients.agents.kitter.kits import KitTask
from cellwright.clients.agents.kitter.perception import Sighting, TrackedBeltPart
from cellwright.clients.agents.kitter.pick_and_place import Manipulator
from cellwright.clients.client import Client
from cellwright.util.pose import Pose

ATTEMPTS = 4
"""Attempts at a part in one place."""

BELT_HORIZON = 12.0
"""A part that the belt brings within this time [s] is preferred to parts at rest."""


class Supply:
    """Available parts, and failed attempts at them."""

    def __init__(
        self,
        client: Client,
        view: CellView,
        arm: KitterArm,
        hand: Manipulator,
        share: Share,
        belt_types: Iterable[str] = (),
    ) -> None:
        self._client = client
        self._view = view
        self._arm = arm
        self._hand = hand
        self._share = share
        self._failures: Counter[tuple[int, int]] = Counter()
        self._tried: Counter[str] = Counter()
        self._too_far: Counter[str] = Counter()
        self._belt_types = tuple(belt_types)
        self._belts = {each.belt.name for each in view.workplace.belts}
        self.kept: set[str] = set()
        """Types of which a part was kept for later."""

    def is_on_belt(self, part_type: str) -> bool:
        """Return whether a belt brings a type."""
        return not self._belts.isdisjoint(self._client.material_locations(part_type))

    def is_on_belt_alone(self, part_type: str) -> bool:
        """Return whether belts bring a type, and no bin has it."""
        locations = self._client.material_locations(part_type)
        return bool(locations) and self._belts.issuperset(locations)

    def unordered(self, kits: Iterable[KitTask]) -> list[str]:
        """Return the types that belts alone bring, that no kit has, and of which none was kept."""
        ordered = {task.type for kit in kits for task in kit.tasks}
        wanted = (each for each in self._belt_types if each not in ordered | self.kept)
        return [each for each in wanted if self.is_on_belt_alone(each)]

    def on_belt(self, part_type: str, horizon: float = BELT_HORIZON) -> tuple[TrackedBeltPart, float] | None:
        """Return the first reachable belt part of a type, and the place along the belt [m] at which the arm meets it.

        Parts that the arm meets later than `horizon` [s] from now do not count.
        """
        now = self._client.time
        found = []
        for belt in self._view.belts:
            for part in filter(self._share.is_free, belt.coming(part_type, now)):
                along = self._hand.meeting_place(part)
                if along is not None and part.time_at(along) < now + horizon:
                    found.append((part, along))
                    break
        return min(found, key=lambda each: each[0].time_at(each[1]), default=None)

    def best(self, part_type: str, lying: Iterable[Sighting], *, is_turned: bool = False) -> Sighting | None:
        """Return the best part of a type: few failed attempts, the right side up, near the rail's place, with room."""
        candidates = [
            part
            for part in filter(self._share.is_free, lying)
            if part.type == part_type and self.failures(part.world_T_part) < ATTEMPTS
        ]
        return min(
            candidates,
            key=lambda part: (
                self.failures(part.world_T_part),
                part.is_turned != is_turned,
                self._arm.postures.way_to(self._arm.joints, *part.world_T_part.position[:2]),
            ),
            default=None,
        )

    def failures(self, world_T_part: Pose) -> int:
        """Return the number of failed attempts at a part in a place."""
        return self._failures[bin_cell(world_T_part)]

    def note_failure(self, part_type: str, world_T_part: Pose, *, is_in_reach: bool = True) -> None:
        """Count a failed attempt at a part in a place: the cup did not hold it, or it is out of reach."""
        self._failures[bin_cell(world_T_part)] += 1
        (self._tried if is_in_reach else self._too_far)[part_type] += 1

    def why_none(self, part_type: str) -> str:
        """Return the reason why no part of a type was available."""
        if tried := self._tried[part_type]:
            return f"the cup gripped none in {tried} attempt{'s' if tried > 1 else ''}"
        if self._too_far[part_type]:
            return "all visible ones are out of the arm's reach"
        if part_type in self._view.not_upright:
            return "all visible ones lie with the wrong side up, or on something else"
        return "none was seen"


def bin_cell(world_T_part: Pose) -> tuple[int, int]:
    """Return a place in a bin, rounded to 5 cm, as a key."""
    x, y, _ = world_T_part.position
    return round(x / 0.05), round(y / 0.05)
