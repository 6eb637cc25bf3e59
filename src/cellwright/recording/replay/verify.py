"""Verification of a recording: runs its commands again and compares state hashes and frames."""

import json
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, TypeAlias

import numpy as np

from cellwright.cell.cell import Cell
from cellwright.engine.clock import seconds
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.standard import String
from cellwright.recording.format.commands import Command
from cellwright.recording.format.format import COMMAND, FRAME, STATE_HASH
from cellwright.recording.format.reader import RecordingFile, frame_bytes
from cellwright.recording.replay.policies import EpisodeCheck
from cellwright.recording.replay.rebuild import Rebuilt
from cellwright.rendering.scene.engine import SceneCapture
from cellwright.rendering.scene.scene import SceneFrame, decode_frame
from cellwright.util.errors import MessageError, RecordingError, SimulationError

_NEVER = 1 << 62
_POINT_TOLERANCE = 1e-6  # of sums that are rounded
_MAX_NAMED = 5  # bodies


@dataclass(frozen=True, slots=True)
class HashPoint:
    """State hash at a tick."""

    tick: int
    hash: str


Step: TypeAlias = Command | HashPoint | SceneFrame


def recorded_steps(source: RecordingFile) -> Iterator[Step]:
    """Yield commands, state hashes and frames.

    Raises:
        RecordingError: the recording is damaged.
    """
    before: SceneFrame | None = None
    for message in source.messages((COMMAND, STATE_HASH, FRAME)):
        try:
            if message.topic == FRAME:
                before = decode_frame(frame_bytes(message.data), before)
                step: Step = before
            else:
                text = TYPES.from_cdr(message.data, String).data
                step = Command.decode(text) if message.topic == COMMAND else _hash_point(text)
        except (MessageError, ValueError, TypeError, KeyError, RecursionError) as error:
            raise RecordingError(f"{message.topic} at {message.time / 1e9:.3f} s is invalid: {error}") from None
        yield step


def _hash_point(text: str) -> HashPoint:
    value: dict[str, Any] = json.loads(text)
    tick, digest = value["tick"], value["hash"]
    if type(tick) is not int or not 0 <= tick < _NEVER or not isinstance(digest, str):
        raise ValueError("a hash point must have a tick and a hash")
    return HashPoint(tick, digest)


class Answer(StrEnum):
    """Result of a verification."""

    EQUAL = "equal"
    DIFFERENT = "different"
    UNKNOWN = "unknown"
    """There was nothing to compare."""


@dataclass(frozen=True)
class TickTime:
    """A tick and its simulation time [ns]."""

    tick: int
    time: int

    def __str__(self) -> str:
        return f"tick {self.tick} ({seconds(self.time):.3f} s)"


@dataclass
class VerificationResult:
    """Results of a verification so far.

    Attributes:
        begun: begin of the run.
        reached: end of the run.
        hashes: number of state hashes that were equal.
        frames: number of frames in which all bodies were in their recorded poses.
        commands: number of executed commands.
        equal_until: newest moment with an equal state hash; None before the first.
        different: first moment with a different state hash; None if there is none.
        moved: first moment at which bodies have other poses; None if there is none.
        bodies: names of some of these bodies.
        points: points that the commands earn; None if the recording has none to compare with.
        recorded_points: points in the recording.
        policy: first request to a policy that is not as its rules make it, in words; empty if there is none.
        requests: number of requests to a policy.
        success: True if the commands make the task succeed; None if the recording has none to compare with.
        recorded_success: True if it succeeded in the recording.
        wall: wall time [s].
        fault: error that ended the run early; empty if there was none.
    """

    begun: TickTime
    reached: TickTime
    hashes: int = 0
    frames: int = 0
    commands: int = 0
    equal_until: TickTime | None = None
    different: TickTime | None = None
    moved: TickTime | None = None
    bodies: tuple[str, ...] = ()
    points: float | None = None
    recorded_points: float = 0.0
    policy: str = ""
    requests: int = 0
    success: bool | None = None
    recorded_success: bool = False
    wall: float = 0.0
    fault: str = ""

    @property
    def answer(self) -> Answer:
        """Overall result."""
        differs = self.different is not None or self.moved is not None or self.has_other_points
        if differs or self.has_other_success or self.fault or self.policy:
            return Answer.DIFFERENT
        return Answer.EQUAL if self.hashes else Answer.UNKNOWN

    @property
    def has_other_points(self) -> bool:
        """True if the commands earn other points than the recording says."""
        return self.points is not None and not abs(self.points - self.recorded_points) <= _POINT_TOLERANCE  # of NaN too

    @property
    def has_other_success(self) -> bool:
        """True if the commands make the task succeed, but not in the recording, or the reverse."""
        return self.success is not None and self.success is not self.recorded_success

    @property
    def first_difference(self) -> TickTime | None:
        """First moment at which the run is known to differ."""
        found = [moment for moment in (self.different, self.moved) if moment is not None]
        return min(found, key=lambda moment: moment.tick, default=None)

    @property
    def factor(self) -> float:
        """Real-time factor."""
        return seconds(self.reached.time - self.begun.time) / self.wall if self.wall > 0.0 else 0.0


def versions_that_differ(recorded: dict[str, str], here: dict[str, str]) -> list[str]:
    """List the versions that differ, in words."""
    return [
        f"{name} {recorded.get(name, 'unknown')}, here {here.get(name, 'unknown')}"
        for name in sorted({*recorded, *here})
        if recorded.get(name) != here.get(name)
    ]


def verify(
    rebuilt: Rebuilt,
    steps: Iterable[Step],
    on_progress: Callable[[int], None] = lambda _time: None,
    result: Mapping[str, Any] | None = None,
) -> VerificationResult:
    """Run the commands again until the end of the recording or the first different state hash.

    Args:
        rebuilt: the cell or robot, at the begin of the recording.
        steps: the recorded steps.
        result: the recorded result; of a cell its points are compared too.
        on_progress: called with the simulation time [ns], often.
    """
    simulation = rebuilt.served.simulation
    cell = rebuilt.served if isinstance(rebuilt.served, Cell) else None
    taker, check = SceneCapture.of(rebuilt.served), EpisodeCheck(rebuilt.served)

    def now() -> TickTime:
        return TickTime(simulation.clock.tick, simulation.now)

    task = None if cell is None else cell.task
    watch = None if task is None else task.watch()
    begun, verdict = time.perf_counter(), VerificationResult(now(), now())
    try:
        for step in steps:
            end = step.time if isinstance(step, SceneFrame) else simulation.clock.time_of(step.tick)
            if simulation.now < end:
                simulation.step_until(end)
                on_progress(simulation.now)
            match step:
                case Command():
                    verdict.commands += 1
                    rebuilt.carry_out(step)
                    check.take(step)
                case HashPoint():
                    if simulation.state_hash() != step.hash:
                        verdict.different = now()
                        break
                    verdict.hashes += 1
                    verdict.equal_until = now()
                # Later frames follow from the first that differs, and would tell nothing more.
                case SceneFrame() if verdict.moved is None:
                    simulation.refresh()
                    here = taker.frame(simulation.data, simulation.now)
                    if here.encode() == step.encode():
                        verdict.frames += 1
                    else:
                        verdict.moved, verdict.bodies = now(), _moved_bodies(taker.scene.bodies, here, step)
    except SimulationError as error:
        verdict.fault = str(error)
    verdict.policy, verdict.requests = check.fault, check.requests
    if watch is not None:
        watch.cancel()
    recorded, succeeded = (result or {}).get("score"), (result or {}).get("success")
    is_whole = verdict.different is None and not verdict.fault
    if is_whole and cell is not None and isinstance(recorded, int | float):
        verdict.points, verdict.recorded_points = cell.competition.score().total, recorded
    if is_whole and task is not None and isinstance(succeeded, bool):
        verdict.success, verdict.recorded_success = task.succeeded_at is not None, succeeded
    verdict.reached, verdict.wall = now(), time.perf_counter() - begun
    return verdict


def _moved_bodies(names: Sequence[str], here: SceneFrame, there: SceneFrame) -> tuple[str, ...]:
    """Return the names of some bodies whose poses differ in another frame; empty if it is of another scene."""
    if len(here.poses) != len(there.poses):
        return ()
    moved = (here.poses != there.poses).any(axis=1) | (here.shown != there.shown)
    return tuple(names[body] for body in np.flatnonzero(moved)[:_MAX_NAMED])
