"""Verification of a recording: runs its commands again and compares state hashes and frames."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, TypeAlias

from cellwright.engine.clock import seconds
from cellwright.middleware.messages import from_cdr
from cellwright.middleware.messages.standard import String
from cellwright.recording.format.commands import Command
from cellwright.recording.format.format import COMMAND, FRAME, STATE_HASH
from cellwright.recording.format.reader import Recording, frame_bytes, json_object
from cellwright.recording.replay.rebuild import Rebuilt
from cellwright.rendering.scene.engine import SceneTaker
from cellwright.rendering.scene.scene import Frame, decode_frame
from cellwright.util.errors import MessageError, RecordingError, SimulationError

_NEVER = 1 << 62


@dataclass(frozen=True, slots=True)
class HashPoint:
    """What the whole state came to at a tick."""

    tick: int
    hash: str


Step: TypeAlias = Command | HashPoint | Frame


def recorded_steps(source: Recording) -> Iterator[Step]:
    """Commands, state hashes and frames.

    Raises:
        RecordingError: the recording does not hold what it should.
    """
    before: Frame | None = None
    for message in source.messages((COMMAND, STATE_HASH, FRAME)):
        try:
            if message.topic == FRAME:
                before = decode_frame(frame_bytes(message.data), before)
                step: Step = before
            elif message.topic == COMMAND:
                step = Command.decode(from_cdr(message.data, String).data)
            else:
                step = _hash_point(json_object(message.data))
        except (MessageError, KeyError, ValueError) as error:
            raise RecordingError(f"{message.topic} at {message.time / 1e9:.3f} s makes no sense: {error}") from None
        yield step


def _hash_point(told: dict[str, Any]) -> HashPoint:
    tick, digest = told["tick"], told["hash"]
    if type(tick) is not int or not 0 <= tick < _NEVER or not isinstance(digest, str):
        raise ValueError("a tick and a hash are needed")
    return HashPoint(tick, digest)


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


@dataclass
class Verdict:
    """What came of running it again, so far.

    Attributes:
        begun: where it began.
        reached: how far it was run.
        hashes: how many state hashes were compared and equal.
        frames: how many times all bodies were where they had been.
        commands: how many commands were carried out.
        equal_until: the newest moment whose state hash is equal; None before the first.
        different: the first moment whose state hash is another; None when there is none.
        moved: the first moment at which bodies stand elsewhere; None when there is none.
        bodies: names of some of those.
        wall: how long that took [s].
        fault: what ended the run before that; empty when nothing did.
    """

    begun: Moment
    reached: Moment
    hashes: int = 0
    frames: int = 0
    commands: int = 0
    equal_until: Moment | None = None
    different: Moment | None = None
    moved: Moment | None = None
    bodies: tuple[str, ...] = ()
    wall: float = 0.0
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


_MOST_NAMED = 5  # bodies


class Verification:
    """One run again.

    Args:
        rebuilt: what runs, standing where the recording begins.
        on_progress: takes the simulation time [ns], often.
    """

    def __init__(self, rebuilt: Rebuilt, on_progress: Callable[[int], None] = lambda _time: None) -> None:
        self._rebuilt = rebuilt
        self._simulation = rebuilt.served.simulation
        self._on_progress = on_progress
        self._verdict = Verdict(self._now(), self._now())
        self._taker = SceneTaker(self._simulation.model, hidden=rebuilt.served.out_of_sight)

    def run(self, steps: Iterable[Step]) -> Verdict:
        """Go through what was recorded, until its end or the first hash that is another."""
        begun, verdict = time.perf_counter(), self._verdict
        try:
            for step in steps:
                self._take(step)
                if verdict.different is not None:
                    break
        except SimulationError as error:
            verdict.fault = str(error)
        verdict.reached, verdict.wall = self._now(), time.perf_counter() - begun
        return verdict

    def _take(self, step: Step) -> None:
        match step:
            case Command():
                self._pass_until(self._simulation.clock.time_of(step.tick))
                self._verdict.commands += 1
                self._rebuilt.carry_out(step)
            case HashPoint():
                self._pass_until(self._simulation.clock.time_of(step.tick))
                self._compare_hash(step)
            case Frame():
                self._pass_until(step.time)
                self._compare_frame(step)

    def _pass_until(self, end: int) -> None:
        simulation = self._simulation
        if simulation.now < end:
            simulation.step_until(end)
            self._on_progress(simulation.now)

    def _compare_hash(self, point: HashPoint) -> None:
        if self._simulation.state_hash() == point.hash:
            self._verdict.hashes += 1
            self._verdict.equal_until = self._now()
        else:
            self._verdict.different = self._now()

    def _compare_frame(self, frame: Frame) -> None:
        if self._verdict.moved is not None:
            return
        self._simulation.refresh()
        here = self._taker.frame(self._simulation.data, self._simulation.now)
        if here.encode() == frame.encode():
            self._verdict.frames += 1
            return
        self._verdict.moved = self._now()
        if len(here.poses) == len(frame.poses):
            others = (here.poses != frame.poses).any(axis=1) | (here.shown != frame.shown)
            names = [name for name, is_other in zip(self._taker.scene.bodies, others, strict=True) if is_other]
            self._verdict.bodies = tuple(names[:_MOST_NAMED])

    def _now(self) -> Moment:
        return Moment(self._simulation.clock.tick, self._simulation.now)
