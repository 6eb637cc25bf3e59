"""Whether what was run again came out as it was recorded, and where it first did not."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from cellwright.engine.clock import seconds


class Answer(StrEnum):
    """Whether a run came out alike."""

    EQUAL = "equal"
    DIFFERENT = "different"
    UNKNOWN = "unknown"
    """There was nothing to compare."""


@dataclass(frozen=True)
class Moment:
    """A tick, and its simulation time [ns]."""

    tick: int
    time: int

    def __str__(self) -> str:
        return f"tick {self.tick} ({seconds(self.time):.3f} s)"


@dataclass(frozen=True)
class Verdict:
    """What came of running it again.

    Attributes:
        hashes: how many state hashes were compared and equal.
        frames: how many times all bodies were where they had been.
        commands: how many commands were carried out.
        equal_until: the newest moment whose state hash is equal; None before the first.
        different: the first moment whose state hash is another; None when there is none.
        moved: the first moment at which bodies stand elsewhere; None when there is none.
        bodies: names of some of those.
        begun: where it began.
        reached: how far it was run.
        wall: how long that took [s].
        fault: what ended the run before that; empty when nothing did.
    """

    hashes: int
    frames: int
    commands: int
    equal_until: Moment | None
    different: Moment | None
    moved: Moment | None
    bodies: tuple[str, ...]
    begun: Moment
    reached: Moment
    wall: float
    fault: str = ""

    @property
    def answer(self) -> Answer:
        """In a word."""
        if self.different is not None or self.moved is not None or self.fault:
            return Answer.DIFFERENT
        return Answer.EQUAL if self.hashes else Answer.UNKNOWN

    @property
    def first_difference(self) -> Moment | None:
        """The first moment at which it is known to be another run."""
        found = [moment for moment in (self.different, self.moved) if moment is not None]
        return min(found, key=lambda moment: moment.tick, default=None)

    @property
    def factor(self) -> float:
        """Simulated seconds a wall second."""
        return seconds(self.reached.time - self.begun.time) / self.wall if self.wall > 0.0 else 0.0


def versions_that_differ(recorded: dict[str, str], here: dict[str, str]) -> list[str]:
    """What was of another version, in words."""
    return [
        f"{name} {recorded.get(name, 'unknown')}, here {here.get(name, 'unknown')}"
        for name in sorted({*recorded, *here})
        if recorded.get(name) != here.get(name)
    ]
