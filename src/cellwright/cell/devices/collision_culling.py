"""Collision culling: bodies that cannot touch anything soon are left out of collision detection.

The engine's broad phase sorts the bounding box of every body in each step, asleep or not. A part that rides the belt or
hangs on the cup has contacts to solve in each step. This device closes bodies to the engine (`body_contype` 0) while
nothing can come of it:

- A **group** is a fixed body or a resting mechanism, such as an AGV, with the sleeping parts in and on it. It is closed
  as a whole while nothing awake can reach it: what wakes together opens together.
- A **passenger** is a part that something carries and that touches nothing else. Either it rides a belt steadily: it
  then has exactly the belt's velocity and no weight. Or a weld holds it, to the cup or to a tray. It is closed until
  something else comes near, the belt changes or ends, the weld changes, or a force acts on the part.
- If nothing is open but mechanisms that touch nothing, such as the arm, the engine skips contacts altogether.

A check computes the gap between the bounding box of every moving body and that of every group and passenger. From gaps
and speeds follows the time of the next check. Speeds may change before: joint velocities are compared with those of the
last check, and a rise checks again. So a drive may be as strong as it likes.

Wherever anything else touches anything all bodies take part, and the engine computes what it would compute without
culling.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from cellwright.cell.devices.boarding import CALM, Boarding
from cellwright.cell.devices.closed_bodies import ClosedBodies
from cellwright.cell.devices.conveyor import Conveyor
from cellwright.cell.devices.gliders import Gliders
from cellwright.cell.devices.movers import EXCESS, Movers
from cellwright.cell.devices.moving_bodies import SHORTEST, MovingBodies
from cellwright.cell.devices.parts import Overlaps
from cellwright.engine.bounding_boxes import Mask, Vectors
from cellwright.engine.clock import NEVER
from cellwright.engine.device import Device, State
from cellwright.engine.simulation import Simulation
from cellwright.engine.sleeping_groups import Groups, SleepingGroups

WINDOW = 0.2
"""Maximum time [s] between two checks."""

LONGEST = 10 * WINDOW
"""Longest time [s] that is considered: then speeds may rise by ten times `EXCESS` until the next check."""

SELDOM = 4
"""Number of steps between two comparisons of the velocities while only mechanisms move.

Even 100 m/s^2 takes a link less than 2 mm further in the three steps between, of a margin of 20 mm.
"""

REVIEW = 0.1
"""Time [s] between two reviews, which also close groups and find passengers, while anything is open."""


class CollisionCulling(Device):
    """Device that closes bodies which cannot meet to the engine; the last one in `before_step`.

    Args:
        conveyors: the belts.
        overlaps: the overlapping parts; they are never passengers, since their contact carries their penetration.

    Attributes:
        passengers: body of each passenger, and what carries it: a belt's body or the other body of a weld.
    """

    def __init__(self, conveyors: Iterable[Conveyor], overlaps: Overlaps) -> None:
        super().__init__("collision_culling")
        self.passengers: dict[int, int] = {}
        self._conveyors = tuple(conveyors)
        self._overlaps = overlaps
        self._woken: set[int] = set()
        self._due = self._review_due = 0
        self._every = 1
        self._excess = 0.0
        self._movers: Movers | None = None
        self._gliding: Gliders | None = None
        self._is_awake: Mask = np.zeros(0, dtype=np.bool_)

    @property
    def closed(self) -> frozenset[int]:
        """Bodies that are closed to the engine, without passengers."""
        return frozenset(np.flatnonzero(self._bodies.is_closed).tolist())

    @property
    def gliders(self) -> tuple[int, ...]:
        """Bodies of the passengers on the belts."""
        return tuple(body for body, carrier in self.passengers.items() if carrier in self._belts)

    def attach(self, simulation: Simulation) -> None:
        """Look up bodies, their boxes and classes."""
        super().attach(simulation)
        self._look_up()
        simulation.on_wake.append(self._woken.add)
        simulation.on_touch.append(self._check_next)
        simulation.on_renewal.append(self._open_all)

    def _look_up(self) -> None:
        """Look up everything in a model that is as compiled, with everything open."""
        model, data = self.simulation.model, self.simulation.data
        self._model = model
        self._last_step = model, data
        self.passengers = {}
        self._bodies = ClosedBodies(model)
        self._tree = model.body_treeid.astype(np.int64)
        self._belts = {int(model.body(each.belt.body).id): each for each in self._conveyors}
        directions = {body: each.belt.direction for body, each in self._belts.items()}
        self._moving = moving = MovingBodies(model, directions)
        self._sleeping = SleepingGroups(model, moving.boxes, moving.parts, moving.links)
        self._dofs = model.body_dofadr.astype(np.int64)[:, None] + np.arange(6)
        self._step = float(model.opt.timestep)
        self._soon, self._review_steps = SHORTEST * self._step, max(1, int(REVIEW / self._step))
        self._boarding = Boarding(moving, self._belts, self._overlaps, self._dofs, 2 * self._soon)
        self._velocities, self._asleep, self._forces = data.qvel, data.tree_asleep, data.xfrc_applied
        # compared as bytes, for it is done in each step; a bytearray compares with a view, bytes would need a copy
        self._no_forces, self._force_bytes = bytearray(data.xfrc_applied.nbytes), memoryview(data.xfrc_applied)
        self._reference: Vectors = np.zeros(0)
        self._forget()

    def reset(self) -> None:
        """Begin a run: everything is open."""
        self._woken.clear()
        self._open_all()

    def get_state(self) -> State:
        """Return what is closed and carried, and all that the next checks depend on."""
        return {
            "closed": np.flatnonzero(self._bodies.is_closed).tolist(),
            "passengers": [[body, carrier] for body, carrier in self.passengers.items()],
            "awake": np.flatnonzero(self._is_awake).tolist(),
            "woken": sorted(self._woken),
            "due": self._due,
            "review_due": self._review_due,
            "contacts": self._bodies.has_contacts,
            "every": self._every,
            "excess": self._excess,
            "reference": self._reference.tolist(),
        }

    def set_state(self, state: State) -> None:
        """Restore what `get_state` returned."""
        self._open_all()
        self._bodies.close(np.array(state["closed"], dtype=np.int64))
        for body, carrier in state["passengers"]:
            self._take_along(body, carrier)
        self._is_awake = np.isin(np.arange(len(self._is_awake)), state["awake"])
        self._awake_count = len(state["awake"])
        self._woken.clear()
        self._woken.update(state["woken"])
        self._due, self._review_due, self._every = state["due"], state["review_due"], state["every"]
        self._bodies.allow_contacts(state["contacts"])
        self._excess, self._reference = state["excess"], np.array(state["reference"])

    def before_step(self) -> None:
        """Check if it is time, or if something was woken or pushed, or has become faster."""
        simulation = self.simulation
        has_grown = simulation.model is not self._model
        if has_grown:
            # a model that has just grown has no contacts yet: those of the last step are in the old data
            last = self._last_step
            self.set_state(self.get_state())
            self._last_step = last
        tick = simulation.clock.tick
        if (
            self._woken
            or tick >= self._due
            or simulation.data.ntree_awake != self._awake_count
            or (tick % self._every == 0 and self._is_faster())
            or self._no_forces != self._force_bytes
        ):
            self._check()
        if has_grown:
            self._last_step = simulation.model, simulation.data

    def _is_faster(self) -> bool:
        """Return whether a point may move faster than the last check assumed."""
        movers = self._movers or self._find_movers()
        change = self._velocities.take(movers.dofs)
        change -= self._reference
        np.abs(change, out=change)
        return bool(change.dot(movers.weights) > self._excess)

    def _check(self) -> None:
        """Plan the next check, or review everything if something may have to be opened or closed."""
        simulation = self.simulation
        simulation.refresh()
        is_awake, looked = self._asleep < 0, None
        if not self._woken and is_awake.tobytes() == self._is_awake.tobytes() and self._no_forces == self._force_bytes:
            movers, times = looked = self._look()
            until = movers.until_watched(times, LONGEST)
            is_safe = until >= self._soon and not self._find_pushed()
            if is_safe and (simulation.clock.tick < self._review_due or not self._can_close(movers, times)):
                self._plan(movers, until)
                return
        self._review(is_awake, looked)

    def _look(self, woken: Iterable[int] = ()) -> tuple[Movers, Vectors]:
        """Return what moves, and the times of its table."""
        movers, data = self._find_movers(), self.simulation.data
        movers.update(data)
        self._moving.place(movers, data, woken)
        return movers, movers.times(np.abs(self._velocities.take(movers.dofs)))

    def _can_close(self, movers: Movers, times: Vectors) -> bool:
        """Return whether a review may close something; if not, the next one has time."""
        groups = self._sleeping.find(self.simulation.data, self._is_awake)
        if movers.free > movers.links or (self._find_open(groups) & (movers.until_groups(times, groups) > CALM)).any():
            return True
        self._review_due = self.simulation.clock.tick + self._review_steps
        return False

    def _check_next(self) -> None:
        """Check before the next step: a position was written directly."""
        self._due = 0

    def _plan(self, movers: Movers, until: float) -> None:
        """Plan the next check: for the time `until` [s], or earlier, and then speeds may rise by more meanwhile."""
        # Times are gap / (speed + EXCESS). So with a shorter window w speeds may rise by more, by x = EXCESS until / w:
        # (speed + x) w <= (speed + EXCESS) until for all speeds. `_is_faster` checks again if a rise is above x.
        window = min(float(until), WINDOW)
        # one step, also where a position is not a number
        steps = int(window / self._step) if window > self._step else 1
        self._due = self.simulation.clock.tick + steps
        self._excess = EXCESS * float(until) / window
        self._every = 1 if movers.free > movers.links else SELDOM
        self._reference = self._velocities[movers.dofs]

    def _review(self, is_awake: Mask, looked: tuple[Movers, Vectors] | None) -> None:
        """Open what may be touched soon, close what cannot, and look for new passengers.

        Args:
            is_awake: True for each tree that is awake.
            looked: findings of a look if nothing has changed but positions and velocities.
        """
        data = self.simulation.data
        woken = self._wake_up(is_awake) if looked is None else []
        groups = self._sleeping.find(data, is_awake)
        for body in [*self._find_pushed(), *(body for body in self.passengers if not is_awake[self._tree[body]])]:
            self._put_down(body, groups)
        if woken or (is_awake != self._is_awake).any():
            self._is_awake, self._movers = is_awake, None
            self._awake_count = int(is_awake.sum())
        movers, times = looked if looked is not None and looked[0] is self._movers else self._look(woken)
        left = movers.until_groups(times, groups)
        closed = self._bodies.is_closed[groups.bodies]
        for group in np.flatnonzero(np.logical_or.reduceat(closed, groups.first) & (left < self._soon)).tolist():
            self._bodies.open(groups.members(group))
        for group in np.flatnonzero(~np.logical_and.reduceat(closed, groups.first) & (left > CALM)).tolist():
            self._bodies.close(groups.members(group))
        times, first = times + movers.never, len(groups.boxes) + 1
        riding = np.minimum(times[movers.free :].min(axis=1), times[:, first:].min(axis=0, initial=np.inf))
        leaving = [body for body, time in zip(list(self.passengers), riding.tolist(), strict=True) if time < self._soon]
        for body in leaving:
            self._put_down(body, groups)
        joining = self._boarding.find(movers, groups, data, self._last_step)
        for body, carrier in joining:
            self._take_along(body, carrier)
        is_open = self._find_open(groups)
        is_calm = not is_open.any() and movers.links == movers.free and not leaving
        self._bodies.allow_contacts(not is_calm or movers.can_touch)
        if woken or leaving or joining:
            self._due = self._review_due = self.simulation.clock.tick + 1
        else:
            self._review_due = NEVER if is_calm else self.simulation.clock.tick + self._review_steps
            movers.watch(is_open[groups.of_box])
            self._plan(movers, (times + movers.watched).min(initial=LONGEST))

    def _find_open(self, groups: Groups) -> Mask:
        """Return which groups are open."""
        return np.asarray(~np.logical_and.reduceat(self._bodies.is_closed[groups.bodies], groups.first))

    def _find_pushed(self) -> list[int]:
        """Return the gliders that do not have their belt's velocity any more: a program has written another one."""
        if not self.passengers:
            return []
        speeds = [each.speed for each in self._conveyors]
        if self._gliding is None or self._gliding.speeds != speeds:
            belts = {body: self._belts[self.passengers[body]].velocity for body in self.gliders}
            self._gliding = Gliders.of(speeds, belts, self._dofs)
        return self._gliding.find_pushed(self._velocities)

    def _wake_up(self, is_awake: Mask) -> list[int]:
        """Open what was woken or pushed, with its groups, and mark it as awake.

        The engine wakes it in the coming step, or when positions are refreshed before.

        Returns:
            The first bodies of these trees.
        """
        trees = set(self._woken)
        self._woken.clear()
        if self._no_forces != self._force_bytes:
            trees.update(self._tree[np.flatnonzero(self._forces.any(axis=1))].tolist())
            trees.discard(-1)
        woken = sorted(trees)
        bodies: list[int] = self.simulation.model.tree_bodyadr[woken].tolist()
        # what is woken and closed sleeps on until the engine's next step, and still belongs to its group
        is_awake[woken] = ~self._bodies.is_closed[bodies]
        moving = self._moving.bodies
        if (self._bodies.is_closed[moving] & is_awake[self._tree[moving]]).any():
            # woken past the simulation, as by a force on a joint
            self._open_all()
        if woken:
            groups = self._sleeping.find(self.simulation.data, is_awake)
            for body in bodies:
                if body in self.passengers:
                    self._put_down(body, groups)
                elif groups.of_body[body] >= 0:
                    self._bodies.open(groups.members(int(groups.of_body[body])))
            is_awake[woken] = True
        return bodies

    def _forget(self) -> None:
        """Forget everything that follows from what sleeps, and where."""
        self._is_awake = np.ones(len(self._asleep), dtype=np.bool_)
        self._awake_count = len(self._asleep)
        self._movers = self._gliding = None
        self._sleeping.forget()

    def _find_movers(self) -> Movers:
        """Return what moves; it changes with what is awake, what is carried, and by what."""
        if self._movers is None:
            data = self.simulation.data
            groups = self._sleeping.find(data, self._is_awake)
            speeds = {body: each.speed for body, each in self._belts.items()}
            self._movers = self._moving.movers(data, self._is_awake, groups, self.passengers, speeds)
            self._movers.watch(self._find_open(groups)[groups.of_box])
        return self._movers

    def _take_along(self, body: int, carrier: int) -> None:
        """Close a part that something carries; on a belt it takes its velocity and has no weight."""
        self.passengers[body] = carrier
        self._movers = self._gliding = None
        belt = self._belts.get(carrier)
        self._bodies.carry(body, is_weightless=belt is not None)
        if belt is not None:
            self._velocities[self._dofs[body]] = *belt.velocity, 0.0, 0.0, 0.0

    def _put_down(self, body: int, groups: Groups) -> None:
        """Open a part again, and what carries it."""
        group = int(groups.of_body[self.passengers.pop(body)])
        self._movers = self._gliding = None
        self._bodies.open(np.array([body]) if group < 0 else np.append(groups.members(group), body))

    def _open_all(self) -> None:
        """Open everything, as at the start of a run."""
        if self.simulation.model is not self._model:
            self._look_up()
        self.passengers.clear()
        self._bodies.open(np.arange(len(self._bodies.is_closed)))
        self._bodies.allow_contacts(True)
        self._due = self._review_due = 0
        self._every, self._excess = 1, 0.0
        self._reference = np.zeros(0)
        self._forget()
