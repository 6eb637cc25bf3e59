"""Conveyor belt: its drive, the parts that come on it by a schedule, and the deletion wall at its end."""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import ceil
from typing import Any, ClassVar, Literal, TypeAlias

from cellwright.cell.devices.parts import LARGEST_PART, Parts
from cellwright.cell.kitting.fates import Removal
from cellwright.cell.model.build import WorldPart
from cellwright.cell.model.frames import SPAWN_FRAME
from cellwright.cell.model.furniture import BELT_GEOM, DELETION_WALL_GEOM
from cellwright.config.trial.trial import BeltPart, Trial
from cellwright.engine.clock import NEVER, nanoseconds
from cellwright.engine.simulation import Device, PlainState, Simulation, State
from cellwright.util.pose import Pose

FULL_SPEED = 0.2
"""Belt speed [m/s] at 100 % power, towards world -y (ARIAC 2017, kMaxBeltLinVel)."""

_SLOW = 2.0
"""Below this many times the engine's sleep tolerance [m/s] parts would fall asleep on the moving belt."""


class Conveyor(Device):
    """The belt. `power` is in percent of full speed, 0 to 100; a snapshot's model has the surface's velocity."""

    STATE: ClassVar[tuple[str, ...]] = ("power",)

    def __init__(self, parts: Parts) -> None:
        super().__init__("conveyor")
        self.parts = parts
        self.power = 0.0
        self.on_power: list[Callable[[Conveyor], None]] = []
        """Those who are told when the power has been set."""

    def attach(self, simulation: Simulation) -> None:
        """Look up the belt."""
        super().attach(simulation)
        self._geom = simulation.model.geom(BELT_GEOM).id
        # Without the flag the engine takes no notice of surface velocities that were all zero when it compiled.
        simulation.model.flg_surfacevel = 1

    def reset(self) -> None:
        """Stand still."""
        self.power = 0.0
        self.set_stepping(False)

    @property
    def speed(self) -> float:
        """Speed of the surface [m/s] towards world -y."""
        return FULL_SPEED * self.power / 100.0

    def set_power(self, power: float) -> bool:
        """Run at `power` percent; anything outside 0..100 is ignored, as in the original. Whether it was taken."""
        if not (math.isfinite(power) and 0.0 <= power <= 100.0):
            return False
        if power != self.power:
            self.power = power
            self._drive()
        for listener in self.on_power:
            listener(self)
        return True

    def before_step(self) -> None:
        """Keep awake what rides so slowly that the engine takes it for being at rest."""
        for part in self._on_belt():
            self.simulation.keep_awake(part.body)

    def _drive(self) -> None:
        simulation = self.simulation
        model = simulation.model
        # The surface velocity is given in the geom's own frame, and the geom may be turned.
        simulation.refresh()
        world_R_geom = simulation.data.geom_xmat[self._geom].reshape(3, 3)
        model.geom_surfacevel[self._geom, :3] = world_R_geom.T @ (0.0, -self.speed, 0.0)
        for part in self._on_belt():
            simulation.wake(part.body)  # a changed surface velocity wakes nobody
        self.set_stepping(0.0 < self.speed < _SLOW * model.opt.sleep_tolerance)

    def _on_belt(self) -> list[WorldPart]:
        simulation = self.simulation
        simulation.refresh()
        centre = simulation.data.geom_xpos[self._geom]
        size = simulation.model.geom_size[self._geom]
        return self.parts.inside(
            (centre[0] - size.max(), centre[1] - size.max(), centre[2]),
            (centre[0] + size.max(), centre[1] + size.max(), centre[2] + size.min() + 1.0),
        )


WALL_PERIOD = Fraction(1, 5)
"""Time between two looks at the wall [s] (ARIAC 2017: the plugin's 5 Hz)."""


class DeletionWall(Device):
    """Removes parts that touch the wall's volume."""

    def __init__(self, parts: Parts) -> None:
        super().__init__("deletion_wall")
        self.parts = parts

    def attach(self, simulation: Simulation) -> None:
        """Look up the wall."""
        super().attach(simulation)
        self._geom = simulation.model.geom(DELETION_WALL_GEOM).id

    def reset(self) -> None:
        """Look five times a second from now on."""
        self._schedule(1)

    def handle_look(self, number: int) -> None:
        """Look for parts that touch the wall."""
        self._schedule(number + 1)
        centre = self.simulation.model.geom_pos[self._geom]
        half = self.simulation.model.geom_size[self._geom] + LARGEST_PART
        for part in self.parts.inside(centre - half, centre + half):
            self.simulation.refresh()
            if self.parts.touches(part, self._geom, cutoff=1e-3):
                self.parts.put_away(part, Removal.DELETION_WALL)

    def _schedule(self, look: int) -> None:
        self.simulation.schedule(self, "look", look, at=nanoseconds(look * WALL_PERIOD))


@dataclass(frozen=True, slots=True)
class Appearance:
    """A part that is to appear: clone number `clone` of its type, at `pose` in the spawn frame.

    Where `in_pool` is false the pool has no such clone any more, and nothing appears.
    """

    type: str
    clone: int
    pose: Pose
    in_pool: bool

    @property
    def name(self) -> str:
        """The name of its model."""
        return f"populate_conveyor|{self.type}_clone_{self.clone}"


class PopulationSchedule(PlainState):
    """The list of parts, and how far it has been gone through. Pure logic, exact.

    Times are whole nanoseconds and the belt's progress is a fraction of them, so it makes no difference whether `pop`
    is called at every step or only when the next part is due.

    The list is gone through by time at full power; at half power everything takes twice as long. A change of power
    leaves what has passed as it is, so that parts keep their distance on the belt. When the last part has appeared the
    list begins again, at once. Clones of a type are counted on through all rounds; only as many as the pool has are
    there.

    Args:
        parts: what is to appear and when [s after the start, at full power].
        cycles: how many rounds the pool of parts is enough for.
        delay: how much later [s at full power] the first round begins, each time somebody starts the list.
    """

    STATE: ClassVar[tuple[str, ...]] = ("running", "_anchor", "_index", "_last_pop")

    def __init__(self, parts: Sequence[BeltPart], cycles: int = 1, delay: float = 0.0) -> None:
        self._start = Fraction(-nanoseconds(delay))
        self.entries = tuple(sorted(parts, key=lambda part: part.time))
        self._due = [nanoseconds(part.time) for part in self.entries]
        self._pool = Counter({type_: count * cycles for type_, count in Counter(p.type for p in self.entries).items()})
        self.reset()

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
        """How far into the list it is at `now` [ns], in nanoseconds at full power."""
        return self._progress + (now - self._anchor) * self._rate if self.running else self._progress

    def restart(self, now: int) -> None:
        """Go through the list from its beginning, from `now` [ns] on. Clones are counted on."""
        self.running = True
        self._index, self._anchor, self._progress = 0, now, self._start

    def pause(self, now: int) -> None:
        """Stand still from `now` [ns] on."""
        self._anchor, self._progress = now, self.progress(now)
        self.running = False

    def resume(self, now: int) -> None:
        """Go on from `now` [ns] on where it stood still."""
        self._anchor, self._progress = now, self.progress(now)
        self.running = True

    def set_power(self, power: float, now: int) -> None:
        """Go on at the pace of the belt, at 0 to 100 % of its power, from `now` [ns] on."""
        self._anchor, self._progress = now, self.progress(now)
        self._rate = Fraction(power) / 100

    def next_due(self) -> int:
        """When the next part is due [ns], unless something is changed before; `NEVER` if none is.

        It is always later than the last part's appearance: at most one appears in a step.
        """
        if not self.running or not self.entries:
            return NEVER
        missing = self._due[self._index] - self._progress
        if missing <= 0:
            due = self._anchor
        elif self._rate == 0:
            return NEVER
        else:
            due = self._anchor + ceil(missing / self._rate)
        return min(max(due, self._last_pop + 1), NEVER)

    def pop(self, now: int) -> Appearance | None:
        """The part that appears at `now` [ns], if one is due."""
        if now < self.next_due():
            return None
        part = self.entries[self._index]
        clone = self._clones[part.type]
        self._clones[part.type] += 1
        self._index += 1
        self._last_pop = now
        if self._index == len(self.entries):
            self._index, self._anchor, self._progress = 0, now, Fraction(0)
        return Appearance(part.type, clone, part.pose, clone < self._pool[part.type])

    def get_state(self) -> dict[str, Any]:
        """All that is remembered, as JSON values."""
        return {
            **super().get_state(),
            "rate": list(self._rate.as_integer_ratio()),
            "progress": list(self._progress.as_integer_ratio()),
            "clones": dict(self._clones),
        }

    def set_state(self, state: State) -> None:
        """Take over what `get_state` returned."""
        super().set_state(state)
        self._rate, self._progress = Fraction(*state["rate"]), Fraction(*state["progress"])
        self._clones = Counter(state["clones"])


PopulationAction: TypeAlias = Literal["pause", "resume", "restart"]


class Population(PopulationSchedule, Device):
    """Puts the parts of a trial on the belt. The list runs at the pace of the belt."""

    def __init__(self, trial: Trial, conveyor: Conveyor, parts: Parts) -> None:
        Device.__init__(self, "population")
        cycles, delay = trial.options.belt_population_cycles, trial.circumstances.belt_delay
        PopulationSchedule.__init__(self, trial.belt_parts, cycles, delay)
        self.parts = parts
        conveyor.on_power.append(self._take_power)

    def control(self, action: PopulationAction) -> None:
        """Pause, resume where it was paused, or restart the list from its beginning."""
        {"pause": self.pause, "resume": self.resume, "restart": self.restart}[action](self.simulation.now)
        self._plan()

    def handle_appear(self) -> None:
        """Let the part that is due appear, if the pool still has one."""
        appearance = self.pop(self.simulation.now)
        if appearance is not None and appearance.in_pool:
            self.parts.place(self.parts.part(appearance.name), SPAWN_FRAME @ appearance.pose)
        self._plan()

    def _take_power(self, conveyor: Conveyor) -> None:
        self.set_power(conveyor.power, self.simulation.now)
        self._plan()

    def _plan(self) -> None:
        self.simulation.cancel(self, "appear")
        due = self.next_due()
        if due < NEVER:
            self.simulation.schedule(self, "appear", at=max(due, self.simulation.now))
