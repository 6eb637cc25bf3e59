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

from cellwright.cell.devices.closed_bodies import ClosedBodies
from cellwright.cell.devices.conveyor import Conveyor
from cellwright.cell.devices.moving_bodies import EXCESS, MARGIN, SHORTEST, Movers, MovingBodies, are_steady
from cellwright.cell.devices.parts import Overlaps
from cellwright.engine.bounding_boxes import Mask, Numbers, Vectors, facing, gaps
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

CALM = 0.1
"""A group closes, and a part becomes a passenger, if nothing can reach it within this time [s]."""


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
        self._velocities, self._asleep, self._forces = data.qvel, data.tree_asleep, data.xfrc_applied
        self._no_forces = np.zeros_like(data.xfrc_applied).tobytes()
        self._step = float(model.opt.timestep)
        self._soon, self._review_steps = SHORTEST * self._step, max(1, int(REVIEW / self._step))
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
            or self._forces.tobytes() != self._no_forces
        ):
            self._check()
        if has_grown:
            self._last_step = simulation.model, simulation.data

    def _is_faster(self) -> bool:
        """Return whether a point may move faster than the last check assumed."""
        movers = self._find_movers()
        change = np.abs(self._velocities[movers.dofs] - self._reference)
        return bool(change.dot(movers.weights) > self._excess)

    def _check(self) -> None:
        """Plan the next check, or review everything if something may have to be opened or closed."""
        simulation = self.simulation
        simulation.refresh()
        is_awake = self._asleep < 0
        if not self._woken and (is_awake == self._is_awake).all() and self._forces.tobytes() == self._no_forces:
            movers = self._find_movers()
            times = movers.times(movers.sides(simulation.data), np.abs(self._velocities[movers.dofs]))
            until = (times + movers.watched).min(initial=LONGEST)
            is_safe = until >= self._soon and not self._find_pushed()
            if is_safe and (simulation.clock.tick < self._review_due or not self._can_close(movers, times)):
                self._plan(movers, until)
                return
        self._review(is_awake)

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

    def _review(self, is_awake: Mask) -> None:
        """Open what may be touched soon, close what cannot, and look for new passengers."""
        data = self.simulation.data
        woken = self._wake_up(is_awake)
        groups = self._sleeping.find(data, is_awake)
        for body in [*self._find_pushed(), *(body for body in self.passengers if not is_awake[self._tree[body]])]:
            self._put_down(body, groups)
        if woken or (is_awake != self._is_awake).any():
            self._is_awake, self._movers = is_awake, None
            self._awake_count = int(is_awake.sum())
        movers = self._find_movers()
        sides = movers.sides(data)
        self._moving.update(sides, movers, data, woken)
        times = movers.times(sides, np.abs(self._velocities[movers.dofs]))
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
        joining = self._find_passengers(movers, sides, groups)
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
        gliders = self.gliders
        if not gliders:
            return []
        velocities = [self._belts[self.passengers[body]].velocity for body in gliders]
        is_steady = are_steady(self._velocities[self._dofs[list(gliders)]], velocities)
        return [body for body, holds in zip(gliders, is_steady.tolist(), strict=True) if not holds]

    def _wake_up(self, is_awake: Mask) -> list[int]:
        """Open what was woken or pushed, with its groups, and mark it as awake.

        The engine wakes it in the coming step, or when positions are refreshed before.

        Returns:
            The first bodies of these trees.
        """
        trees = set(self._woken)
        self._woken.clear()
        if self._forces.tobytes() != self._no_forces:
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
        self._movers = None
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

    def _find_passengers(self, movers: Movers, sides: Vectors, groups: Groups) -> list[tuple[int, int]]:
        """Return parts that something carries and that touch nothing else, nor will for a while; and their carriers."""
        rows = np.arange(movers.links, movers.free)
        if not len(rows):
            return []
        steady = {
            belt: are_steady(self._velocities[self._dofs[movers.bodies[rows]]], conveyor.velocity)
            for belt, conveyor in self._belts.items()
            if conveyor.speed > 0.0
        }
        is_steady = np.logical_or.reduce([np.zeros(len(rows), dtype=np.bool_), *steady.values()])
        model, data = self._last_step
        touching = model.geom_bodyid[data.contact.geom[: data.ncon]]
        overlapping = self._overlaps.bodies
        carriers = movers.carriers.copy()
        is_pushed = self._forces[movers.bodies[rows]].any(axis=1)
        carriers[rows[is_pushed]] = -1
        for row in rows[(is_steady | (carriers[rows] >= 0)) & ~is_pushed].tolist():
            body, weld = int(movers.bodies[row]), int(carriers[row])
            others = touching[(touching == body).any(axis=1)]
            belts = (belt for belt, mask in steady.items() if mask[row - movers.links] and belt in others)
            carrier = weld if weld >= 0 else next(belts, -1)
            touches_more = bool(((others != body) & (others != carrier)).any()) or body in overlapping
            carriers[row] = -1 if touches_more else carrier
        # Parts on one carrier do not meet; but one that fails is a body as others, which the rest may meet.
        while True:
            failing = [
                row
                for row in rows[carriers[rows] >= 0].tolist()
                if not self._is_calm(movers, row, carriers, sides, groups)
            ]
            if not failing:
                found = rows[carriers[rows] >= 0]
                return list(zip(movers.bodies[found].tolist(), carriers[found].tolist(), strict=True))
            carriers[failing] = -1

    def _is_calm(self, movers: Movers, row: int, carriers: Numbers, sides: Vectors, groups: Groups) -> bool:
        """Return whether a part would meet nothing for a while if it and others were passengers of these carriers."""
        count, carrier = len(groups.boxes), int(carriers[row])
        belt = self._belts.get(carrier)
        velocities = np.abs(self._velocities[movers.dofs])
        speeds = movers.speeds(velocities)
        speed = speeds[row] if belt is None else belt.speed
        ahead, met = (
            gaps(sides[:, row : row + 1], each)[0] for each in (movers.opposite[:, : count + 1], facing(sides))
        )
        ahead[-1] = np.inf
        if belt is not None:
            ahead[:-1][groups.fixed_body == carrier] = np.inf
            ahead[-1] = self._moving.gap_to_end(carrier, sides[:, row])
        met[carriers == carrier] = np.inf
        if belt is None:
            kin = self._moving.kin(self.simulation.data, movers, row, carrier)
            if (kin.times(met[kin.rows], velocities)[kin.levers.any(axis=1)] < 2 * self._soon).any():
                return False
            met[kin.rows] = np.inf
        return bool(((ahead - MARGIN) / speed > CALM).all() and ((met - MARGIN) / (speed + speeds) > CALM).all())

    def _take_along(self, body: int, carrier: int) -> None:
        """Close a part that something carries; on a belt it takes its velocity and has no weight."""
        self.passengers[body] = carrier
        self._movers = None
        belt = self._belts.get(carrier)
        self._bodies.carry(body, is_weightless=belt is not None)
        if belt is not None:
            self._velocities[self._dofs[body]] = *belt.velocity, 0.0, 0.0, 0.0

    def _put_down(self, body: int, groups: Groups) -> None:
        """Open a part again, and what carries it."""
        group = int(groups.of_body[self.passengers.pop(body)])
        self._movers = None
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
