"""Running a recording again from its commands, and comparing what comes of it with what came of it then."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable

from cellwright.recording.format.commands import Command
from cellwright.recording.replay.rebuilt import Rebuilt
from cellwright.recording.replay.steps import HashPoint, Step
from cellwright.recording.replay.verdict import Moment, Verdict
from cellwright.rendering.scene.frame import Frame
from cellwright.rendering.scene.taking import SceneTaker
from cellwright.util.errors import SimulationError

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
        self._begun = self._now()
        self._hashes = self._frames = self._commands = 0
        self._equal_until: Moment | None = None
        self._different: Moment | None = None
        self._moved: Moment | None = None
        self._bodies: tuple[str, ...] = ()
        self._taker = SceneTaker(self._simulation.model, hidden=rebuilt.served.out_of_sight)

    def run(self, steps: Iterable[Step]) -> Verdict:
        """Go through what was recorded, until its end or the first hash that is another."""
        begun, fault = time.perf_counter(), ""
        try:
            for step in steps:
                self._take(step)
                if self._different is not None:
                    break
        except SimulationError as error:
            fault = str(error)
        return Verdict(
            hashes=self._hashes,
            frames=self._frames,
            commands=self._commands,
            equal_until=self._equal_until,
            different=self._different,
            moved=self._moved,
            bodies=self._bodies,
            begun=self._begun,
            reached=self._now(),
            wall=time.perf_counter() - begun,
            fault=fault,
        )

    def _take(self, step: Step) -> None:
        match step:
            case Command():
                self._pass_until(self._simulation.clock.time_of(step.tick))
                self._commands += 1
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
            self._hashes += 1
            self._equal_until = self._now()
        else:
            self._different = self._now()

    def _compare_frame(self, frame: Frame) -> None:
        if self._moved is not None:
            return
        self._simulation.refresh()
        here = self._taker.frame(self._simulation.data, self._simulation.now)
        if here.encode() == frame.encode():
            self._frames += 1
            return
        self._moved = self._now()
        if len(here.poses) == len(frame.poses):
            others = (here.poses != frame.poses).any(axis=1) | (here.shown != frame.shown)
            names = [name for name, is_other in zip(self._taker.scene.bodies, others, strict=True) if is_other]
            self._bodies = tuple(names[:_MOST_NAMED])

    def _now(self) -> Moment:
        return Moment(self._simulation.clock.tick, self._simulation.now)
