"""Conveyor belts: their drives, the schedules of the parts on them, and the deletion walls at their ends."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import ceil
from typing import Any, ClassVar, Literal, NamedTuple, TypeAlias

from cellwright.cell.devices.parts import MAX_PART_SIZE, Parts
from cellwright.cell.kitting.fates import Removal
from cellwright.cell.model.build import WorldPart
from cellwright.cell.model.clones import clone_name
from cellwright.cell.model.furniture import wall_name
from cellwright.config.layout.layout import Belt
from cellwright.config.trial.trial import BeltPart, Trial
from cellwright.engine.clock import NEVER, nanoseconds
from cellwright.engine.device import Device, PlainState, State
from cellwright.engine.simulation import Simulation
from cellwright.util.pose import Pose, Vector3

_SLOW = 2.0
"""Below this multiple of the engine's sleep tolerance [m/s] parts would fall asleep on the moving belt."""

WALL_PERIOD = Fraction(1, 5)
"""Time between two checks at the wall [s] (ARIAC 2017: the plugin's 5 Hz)."""
PopulationAction: TypeAlias = Literal["pause", "resume", "restart"]


class Conveyor(Device):
    """Drive of a belt. `power` is in percent of full speed, 0 to 100; a snapshot's model has the surface's velocity."""

    STATE: ClassVar[tuple[str, ...]] = ("power",)

    def __init__(self, parts: Parts, belt: Belt, name: str = "conveyor") -> None:
        super().__init__(name)
        self.parts = parts
        self.belt = belt
        self.power = 0.0
        self.on_power: list[Callable[[Conveyor], None]] = []
        """Callbacks that run when the power has been set."""

    def attach(self, simulation: Simulation) -> None:
        """Look up the belt."""
        super().attach(simulation)
        self._geom = simulation.model.geom(self.belt.body).id
        # Without the flag the engine ignores surface velocities that were all zero when it compiled.
        simulation.model.flg_surfacevel = 1

    def reset(self) -> None:
        """Stop the belt."""
        self.power = 0.0
        self.set_stepping(False)

    @property
    def speed(self) -> float:
        """Speed of the surface [m/s] in the belt's direction."""
        return self.belt.speed * self.power / 100.0

    @property
    def velocity(self) -> Vector3:
        """Velocity of the surface [m/s] in the world."""
        x, y, z = self.belt.direction
        speed = self.speed
        return (x * speed, y * speed, z * speed)

    def set_power(self, power: float) -> bool:
        """Run at `power` percent. Anything outside 0..100 is ignored, as in the original; return False then."""
        if not (math.isfinite(power) and 0.0 <= power <= 100.0):
            return False
        if power != self.power:
            self.power = power
            self._drive()
        for listener in self.on_power:
            listener(self)
        return True

    def before_step(self) -> None:
        """Keep parts awake that ride so slowly that the engine takes them for being at rest."""
        for part in self._on_belt():
            self.simulation.keep_awake(part.body)

    def _drive(self) -> None:
        simulation = self.simulation
        model = simulation.model
        # The surface velocity is in the geom's own frame, and the geom may be turned.
        simulation.refresh()
        world_R_geom = simulation.data.geom_xmat[self._geom].reshape(3, 3)
        model.geom_surfacevel[self._geom, :3] = world_R_geom.T @ self.velocity
        for part in self._on_belt():
            # a changed surface velocity does not wake parts
            simulation.wake(part.body)
        self.set_stepping(0.0 < self.speed < _SLOW * model.opt.sleep_tolerance)

    def _on_belt(self) -> list[WorldPart]:
        """Return the parts up to a metre over the belt, with those beside it that may reach it."""
        belt = self.belt
        x, y, z = belt.centre.position
        reach = math.hypot(*belt.size[:2]) / 2 + MAX_PART_SIZE
        near = self.parts.inside((x - reach, y - reach, z), (x + reach, y + reach, belt.surface + 1.0))
        return [part for part in near if belt.covers(*self.parts.pose(part).position[:2], margin=MAX_PART_SIZE)]


class DeletionWall(Device):
    """Device that removes parts that touch the volume at the end of a belt."""

    def __init__(self, parts: Parts, belt: Belt, name: str = "deletion_wall") -> None:
        super().__init__(name)
        self.parts = parts
        self.belt = belt

    def attach(self, simulation: Simulation) -> None:
        """Look up the wall."""
        super().attach(simulation)
        self._geom = simulation.model.geom(wall_name(self.belt)).id

    def reset(self) -> None:
        """Check five times a second from now on."""
        self._schedule(1)

    def handle_look(self, number: int) -> None:
        """Remove the parts that touch the wall."""
        self._schedule(number + 1)
        self.simulation.refresh()
        centre = self.simulation.model.geom_pos[self._geom]
        turn = abs(self.simulation.data.geom_xmat[self._geom].reshape(3, 3))
        half = turn @ self.simulation.model.geom_size[self._geom] + MAX_PART_SIZE
        for part in self.parts.inside(centre - half, centre + half):
            self.simulation.refresh()
            if self.parts.touches(part, self._geom, cutoff=1e-3):
                self.parts.put_away(part, Removal.DELETION_WALL)

    def _schedule(self, look: int) -> None:
        self.simulation.schedule(self, "look", look, at=nanoseconds(look * WALL_PERIOD))


@dataclass(frozen=True, slots=True)
class Appearance:
    """Appearance of a part: clone number `clone` of its type, at `pose` in the spawn frame.

    If `in_pool` is false the pool has no such clone left, and nothing appears.
    """

    type: str
    clone: int
    pose: Pose
    in_pool: bool

    @property
    def name(self) -> str:
        """Name of its model."""
        return clone_name(f"{self.type}_clone_{self.clone}")


class PopulationSchedule(PlainState):
    """Schedule of the parts on the belt, and its progress. Pure logic, exact.

    Times are whole nanoseconds and the belt's progress is a fraction of them. So calling `pop` at every step or only
    when the next part is due gives the same result.

    The schedule runs by time at full power; at half power everything takes twice as long. A change of power keeps the
    progress so far, so that parts keep their distance on the belt. After the last part the list begins again, at once.
    Clones of a type are counted through all rounds; the pool limits how many exist.

    Args:
        parts: parts with their times [s after the start, at full power].
        cycles: number of rounds that the pool of parts is enough for.
        delay: delay of the first round [s at full power], after each start of the list.
        first: number of the first clone of each type; 0 for types that are not in it.
    """

    STATE: ClassVar[tuple[str, ...]] = ("running", "_anchor", "_index", "_last_pop")

    def __init__(
        self, parts: Sequence[BeltPart], cycles: int = 1, delay: float = 0.0, first: Mapping[str, int] | None = None
    ) -> None:
        self.set_delay(delay)
        self._first = Counter(first)
        self.entries = tuple(sorted(parts, key=lambda part: part.time))
        self._due = [nanoseconds(part.time) for part in self.entries]
        self._pool = Counter({type_: count * cycles for type_, count in Counter(p.type for p in self.entries).items()})
        self.reset()

    def set_delay(self, delay: float) -> None:
        """Set the delay of the first round [s at full power], before a run."""
        self._start = Fraction(-nanoseconds(delay))

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
        """Return the progress in the list at `now` [ns], in nanoseconds at full power."""
        return self._progress + (now - self._anchor) * self._rate if self.running else self._progress

    def restart(self, now: int) -> None:
        """Restart the list from its beginning at `now` [ns]. The count of clones continues."""
        self.running = True
        self._index, self._anchor, self._progress = 0, now, self._start

    def pause(self, now: int) -> None:
        """Pause at `now` [ns]."""
        self._anchor, self._progress = now, self.progress(now)
        self.running = False

    def resume(self, now: int) -> None:
        """Resume at `now` [ns] where it was paused."""
        self._anchor, self._progress = now, self.progress(now)
        self.running = True

    def set_power(self, power: float, now: int) -> None:
        """Continue at the pace of the belt, at 0 to 100 % of its power, from `now` [ns] on."""
        self._anchor, self._progress = now, self.progress(now)
        self._rate = Fraction(power) / 100

    def is_ahead(self, kind: str, clone: int) -> bool:
        """Return whether a clone of a type is one of this schedule, and has not been due yet."""
        return self._clones[kind] <= clone - self._first[kind] < self._pool[kind]

    def next_due(self) -> int:
        """Return the time of the next part [ns], unless something changes before; `NEVER` if there is none.

        It is always later than the last part's appearance: at most one appears in a step.
        """
        if not self.running or not self.entries:
            return NEVER
        # Progress grows by `_rate` per ns since `_anchor`: the entry is due when missing / rate has passed. With exact
        # fractions, rounded up once, a part appears at the same tick however often the power changed.
        missing = self._due[self._index] - self._progress
        if missing <= 0:
            due = self._anchor
        elif self._rate == 0:
            return NEVER
        else:
            due = self._anchor + ceil(missing / self._rate)
        return min(max(due, self._last_pop + 1), NEVER)

    def pop(self, now: int) -> Appearance | None:
        """Return the part that appears at `now` [ns], if one is due."""
        if now < self.next_due():
            return None
        part = self.entries[self._index]
        clone = self._clones[part.type]
        self._clones[part.type] += 1
        self._index += 1
        self._last_pop = now
        if self._index == len(self.entries):
            self._index, self._anchor, self._progress = 0, now, Fraction(0)
        return Appearance(part.type, self._first[part.type] + clone, part.pose, clone < self._pool[part.type])

    def get_state(self) -> dict[str, Any]:
        """Return the whole state as JSON values."""
        return {
            **super().get_state(),
            "rate": list(self._rate.as_integer_ratio()),
            "progress": list(self._progress.as_integer_ratio()),
            "clones": dict(self._clones),
        }

    def set_state(self, state: State) -> None:
        """Restore what `get_state` returned."""
        super().set_state(state)
        self._rate, self._progress = Fraction(*state["rate"]), Fraction(*state["progress"])
        self._clones = Counter(state["clones"])


class Population(PopulationSchedule, Device):
    """Device that puts the parts of a trial on their belt. The list runs at the pace of the belt."""

    def __init__(self, trial: Trial, conveyor: Conveyor, parts: Parts, name: str = "population") -> None:
        Device.__init__(self, name)
        cycles, delay = trial.options.belt_population_cycles, trial.circumstances.belt_delay
        belt = conveyor.belt.name
        flow = [part for part in trial.belt_parts if part.belt == belt]
        PopulationSchedule.__init__(self, flow, cycles, delay, trial.first_clones(belt))
        self.parts = parts
        self._spawn = conveyor.belt.spawn
        conveyor.on_power.append(self._take_power)

    def control(self, action: PopulationAction) -> None:
        """Pause, resume where it was paused, or restart the list from its beginning."""
        {"pause": self.pause, "resume": self.resume, "restart": self.restart}[action](self.simulation.now)
        self._plan()

    def handle_appear(self) -> None:
        """Place the part that is due on the belt, if the pool still has one."""
        appearance = self.pop(self.simulation.now)
        is_spawned = appearance is not None and appearance.name in self.parts.in_play
        if appearance is not None and appearance.in_pool and not is_spawned:
            self.parts.appear(appearance.name, self._spawn @ appearance.pose)
        self._plan()

    def _take_power(self, conveyor: Conveyor) -> None:
        self.set_power(conveyor.power, self.simulation.now)
        self._plan()

    def _plan(self) -> None:
        self.simulation.cancel(self, "appear")
        due = self.next_due()
        if due < NEVER:
            self.simulation.schedule(self, "appear", at=max(due, self.simulation.now))


class BeltDevices(NamedTuple):
    """Devices of the belts of a cell, each by the name of its belt."""

    conveyors: dict[str, Conveyor]
    populations: dict[str, Population]
    walls: dict[str, DeletionWall]

    @classmethod
    def of(cls, trial: Trial, parts: Parts) -> BeltDevices:
        """Return a drive for each belt, a population where parts come, and a wall where there is one.

        Those of the first belt have the names of 2017; to those of the others the belt's name is added.
        """
        belts = trial.layout.belts
        flows = {part.belt for part in trial.belt_parts}
        made = cls({}, {}, {})
        for each in belts:
            suffix = "" if each is belts[0] else f"_{each.name}"
            conveyor = made.conveyors[each.name] = Conveyor(parts, each, f"conveyor{suffix}")
            if each.name in flows:
                made.populations[each.name] = Population(trial, conveyor, parts, f"population{suffix}")
            if each.wall is not None:
                made.walls[each.name] = DeletionWall(parts, each, f"deletion_wall{suffix}")
        return made
