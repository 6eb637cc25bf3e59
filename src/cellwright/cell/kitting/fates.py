"""Fates of parts that a kit needed and its tray lacked, from the record of how they were handled.

The record explains the score and never changes it. It is an observation and not part of the state; snapshots carry it
beside the state.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

import msgspec

from cellwright.cell.kitting.kit_score import KitScore, Verdict
from cellwright.engine.clock import seconds
from cellwright.util.pose import Vector3

FALL = 0.03
"""A part that lies more than this [m] below its release position was dropped, not put down."""

MOVED = 0.05
"""For a part that lies further than this [m] from its release position, the present position is named too."""
_WORDS: Mapping[str, str] = {
    "held": "was in the gripper for {held}",
    "forced drop": "was lost to a forced drop at {place} after {held} in the gripper{now}",
    "dropped": "was dropped at {place} after {held} in the gripper{now}",
    "put down": "was put down at {place}{now}",
    "unreported": "was put down at {spot}, after the tray's last report",
    "stacked": "lay above {tray}'s tray without touching its plate, at {lies}",
    "other tray": "was on {tray}'s tray",
    "fell off": "fell off {tray}'s tray{now}",
    "deletion wall": "was removed by the deletion wall of the belt",
    "cleared": "was cleared from {tray}'s tray",
}
"""A fate in words, by its kind."""


class Removal(StrEnum):
    """Causes that remove a part from the cell: the belt's end, a delivered kit, or the clearing of a tray."""

    DELETION_WALL = "deletion wall"
    DELIVERY = "delivery"
    CLEARING = "clearing"


class FateKind(StrEnum):
    """Kinds of fates of a part."""

    NEVER_HELD = "never held"
    """No part of the type that could fill the place was ever in the gripper."""
    HELD = "held"
    FORCED_DROP = "forced drop"
    DROPPED = "dropped"
    PUT_DOWN = "put down"
    UNREPORTED = "unreported"
    """On the tray, but put down after the last report before the tray was judged."""
    STACKED = "stacked"
    """On another part above the tray, without touching its plate; a tray reports only what touches its plate."""
    OTHER_TRAY = "other tray"
    FELL_OFF = "fell off"
    DELETION_WALL = "deletion wall"
    CLEARED = "cleared"


@dataclass(frozen=True, slots=True)
class Fate:
    """Fate of a needed part that is not on the judged tray.

    Attributes:
        kind: the kind of fate.
        part: full model name; empty for `NEVER_HELD`.
        position: release position, world frame [m]; None if the part was never released.
        time: release time [ns].
        held: duration of the last grasp [ns].
        tray: AGV of the tray that the part lies on, is above or fell off; empty for none.
        lies: position when the tray was judged, world frame [m]; None if the part had left the cell.
        is_faulty: True for a faulty part, which earns nothing.
        past: for `NEVER_HELD`, the number of parts of the type that the belt's deletion wall removed.
        fallen: likewise, the number of those that fell off a belt to the floor.
    """

    kind: FateKind
    part: str = ""
    position: Vector3 | None = None
    time: int | None = None
    held: int = 0
    tray: str = ""
    lies: Vector3 | None = None
    is_faulty: bool = False
    past: int = 0
    fallen: int = 0

    def sentence(self) -> str:
        """The fate in words.

        Example:
            >>> Fate(FateKind.DROPPED, "bin7|gear_part_1", (0.31, 2.95, 1.0), held=3_100_000_000).sentence()
            'bin7|gear_part_1 was dropped at (0.31, 2.95) m after 3.1 s in the gripper'
        """
        if self.kind is FateKind.NEVER_HELD:
            past = f"; the deletion wall of the belt removed {self.past} of its type" if self.past else ""
            fallen = f"; {self.fallen} of its type fell off the belt" if self.fallen else ""
            return f"never gripped{past}{fallen}"
        name = f"{self.part} (faulty)" if self.is_faulty else self.part
        words = _WORDS[self.kind].format(
            tray=self.tray,
            held=f"{seconds(self.held):.1f} s",
            place=_place(self.position),
            spot=_place(self.position or self.lies),
            lies=_place(self.lies),
            now=self._now(),
        )
        return f"{name} {words}"

    def _now(self) -> str:
        """Describe the present position if it differs from the release position."""
        if self.lies is None or (self.position is not None and _apart(self.lies, self.position) < MOVED):
            return ""
        return f"; it lay at {_place(self.lies)}"


@dataclass(frozen=True, slots=True)
class PartSnapshot:
    """A part of the cell at the time when a tray is judged.

    Attributes:
        position: of its origin, world frame [m]; None if it is not in the cell.
        tray: id of the tray whose plate it touches; empty for none.
        above: id of the tray that it is above; empty for none.
        has_fallen: True for a part of a belt that lies far below the belts.
    """

    name: str
    type: str
    position: Vector3 | None
    tray: str = ""
    above: str = ""
    is_faulty: bool = False
    has_fallen: bool = False


@dataclass(slots=True)
class _History:
    """Handling of one part; times in ns."""

    taken: int | None = None
    let_go: int | None = None
    held: int = 0
    position: Vector3 | None = None
    is_forced: bool = False
    tray: str = ""
    removed: Removal | None = None


class HandlingRecord:
    """Record of how gripper, trays and belt handled the parts of one run, and of the fates found at submissions."""

    def __init__(self) -> None:
        self._parts: dict[str, _History] = {}
        self._fates: dict[str, tuple[Fate | None, ...]] = {}

    def is_held(self, name: str) -> bool:
        """Return whether a part is in a gripper."""
        return name in self._parts and self._parts[name].taken is not None

    def fates(self, kit_type: str) -> tuple[Fate | None, ...]:
        """Return the fates found when this kit was judged, one for each ordered part; empty if it was not judged."""
        return self._fates.get(kit_type, ())

    def take(self, name: str, now: int) -> None:
        """Record that the gripper took hold of a part at `now` [ns]."""
        history = self._history_of(name)
        history.taken, history.tray, history.is_forced, history.removed = now, "", False, None

    def let_go(self, name: str, position: Vector3, now: int, *, is_forced: bool) -> None:
        """Record that the gripper released a part at `now` [ns].

        Args:
            name: full model name of the part.
            position: of the part's origin, world frame [m].
            now: simulation time [ns].
            is_forced: True if one of the trial's drop regions took the part away.
        """
        history = self._history_of(name)
        history.held = 0 if history.taken is None else now - history.taken
        history.taken, history.let_go, history.position, history.is_forced = None, now, position, is_forced

    def report(self, tray_id: str, names: Iterable[str]) -> None:
        """Record the parts that a tray reported; a part still held by the gripper does not count."""
        for name in names:
            if (history := self._history_of(name)).taken is None:
                history.tray = tray_id

    def remove(self, name: str, cause: Removal) -> None:
        """Record that a part left the cell."""
        self._history_of(name).removed = cause

    def judge(
        self, score: KitScore, tray_id: str, reported: Iterable[str], parts: Iterable[PartSnapshot], now: int
    ) -> tuple[Fate | None, ...]:
        """Find and keep the fates of the parts that a judged kit lacks.

        For each type, handled parts stand for the missing ones, the latest first. Good parts go before faulty ones, and
        parts on another tray come last. No part stands for two.

        Args:
            score: the score of the judged kit.
            tray_id: the judged tray.
            reported: names of the judged parts.
            parts: the cell's parts at `now`; types that are not missing may be left out.
            now: simulation time [ns].

        Returns:
            A fate for each ordered part; None for a part that is present.
        """
        named = {fate.part for fates in self._fates.values() for fate in fates if fate is not None} | set(reported)
        candidates: dict[str, list[tuple[tuple[bool, bool, int, str], Fate]]] = {}
        past: Counter[str] = Counter()
        fallen: Counter[str] = Counter()
        for part in parts:
            history = self._parts.get(part.name)
            if history is None:
                fallen[part.type] += part.has_fallen
                continue
            if history.removed is Removal.DELIVERY:
                continue
            if history.taken is None and history.let_go is None and not history.tray:
                past[part.type] += history.removed is Removal.DELETION_WALL
            elif part.name not in named:
                fate = _fate(part, history, tray_id, now)
                latest = now if history.taken is not None else history.let_go or 0
                rank = (part.is_faulty, fate.kind is FateKind.OTHER_TRAY, -latest, part.name)
                candidates.setdefault(part.type, []).append((rank, fate))
        for ranked in candidates.values():
            ranked.sort(key=lambda each: each[0], reverse=True)  # pop() takes the last element
        fates: list[Fate | None] = []
        for finding in score.parts:
            if finding.verdict is not Verdict.MISSING:
                fates.append(None)
            elif candidates.get(finding.type):
                fates.append(candidates[finding.type].pop()[1])
            else:
                fates.append(Fate(FateKind.NEVER_HELD, past=past[finding.type], fallen=fallen[finding.type]))
        self._fates[score.kit_type] = tuple(fates)
        return tuple(fates)

    def get_record(self) -> dict[str, Any]:
        """Return the whole record as JSON values; empty if nothing was recorded."""
        parts = {name: asdict(history) for name, history in self._parts.items()}
        fates = {kit: [None if each is None else asdict(each) for each in found] for kit, found in self._fates.items()}
        return {"parts": parts, "fates": fates} if parts or fates else {}

    def set_record(self, record: Mapping[str, Any]) -> None:
        """Restore a record from `get_record`; an empty one starts a new run."""
        self._parts = msgspec.convert(record.get("parts", {}), dict[str, _History])
        self._fates = msgspec.convert(record.get("fates", {}), dict[str, tuple[Fate | None, ...]])

    def _history_of(self, name: str) -> _History:
        return self._parts.setdefault(name, _History())


def _fate(part: PartSnapshot, history: _History, tray_id: str, now: int) -> Fate:
    """Return the fate of a part that was handled and is not among the judged ones."""
    lies = None if history.removed else part.position
    held = history.held if history.taken is None else now - history.taken
    kind, tray = _kind(part, history, tray_id)
    return Fate(kind, part.name, history.position, history.let_go, held, tray.partition("::")[0], lies, part.is_faulty)


def _kind(part: PartSnapshot, history: _History, tray_id: str) -> tuple[FateKind, str]:
    """Return the kind of fate, and the tray that it refers to."""
    if history.removed is not None:
        is_wall = history.removed is Removal.DELETION_WALL
        return (FateKind.DELETION_WALL, "") if is_wall else (FateKind.CLEARED, history.tray)
    if history.taken is not None:
        return FateKind.HELD, ""
    if part.tray:
        return (FateKind.UNREPORTED if part.tray == tray_id else FateKind.OTHER_TRAY), part.tray
    if part.above:
        return FateKind.STACKED, part.above
    if history.tray:
        return FateKind.FELL_OFF, history.tray
    if history.is_forced:
        return FateKind.FORCED_DROP, ""
    let_go, lies = history.position, part.position
    fallen = let_go is not None and lies is not None and let_go[2] - lies[2] > FALL
    return (FateKind.DROPPED if fallen else FateKind.PUT_DOWN), ""


def _apart(one: Vector3, other: Vector3) -> float:
    return max(abs(one[0] - other[0]), abs(one[1] - other[1]))


def _place(position: Vector3 | None) -> str:
    x, y = (0.0, 0.0) if position is None else position[:2]
    return f"({x:.2f}, {y:.2f}) m"
