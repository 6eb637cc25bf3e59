"""Collision culling: bodies that cannot touch anything soon are left out of collision detection.

The engine's broad phase sorts the bounding box of every body in each step, asleep or not. A part that rides the belt or
hangs on the cup has contacts to solve in each step. This device closes bodies to the engine (`body_contype` 0) while
nothing can come of it:

- A **group** is a fixed body or a resting mechanism, such as an AGV, with the sleeping parts in and on it. It is closed
  as a whole while nothing awake can reach it: what wakes together opens together.
- A **passenger** is a part that something carries and that touches nothing else. Either it rides the belt steadily: it
  then has exactly the belt's velocity and no weight. Or a weld holds it, to the cup or to a tray. It is closed until
  something else comes near, the belt changes or ends, the weld changes, or a force acts on the part.
- If nothing is open but mechanisms that touch nothing, such as the arm, the engine skips contacts altogether.

A check computes the gap between the bounding box of every moving body and that of every group and passenger. From gaps
and speeds follows the time of the next check. Speeds may change before: each step compares all joint velocities with
those of the last check, and checks again when a moving point could be faster by `EXCESS`. So a drive may be as strong
as it likes.

Wherever anything else touches anything all bodies take part, and the engine computes what it would compute without
culling.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from cellwright.cell.devices.conveyor import Conveyor
from cellwright.cell.devices.parts import Overlaps
from cellwright.cell.model.furniture import BELT_GEOM
from cellwright.engine.bounding_boxes import FAR, BodyBoxes, Boxes, Mask, Numbers, Vectors, facing, gaps, sides_at
from cellwright.engine.clock import NEVER
from cellwright.engine.simulation import Device, Simulation, State
from cellwright.engine.sleeping_groups import Groups, SleepingGroups, rotations

MARGIN = 0.02
"""Gap [m] below which bodies are taken for touching. Contacts begin at 1 mm; the rest is reserve."""

KIN_MARGIN = 0.005
"""The same [m] for a held part and links of the mechanism that holds it, all of which are known to move."""

EXCESS = 0.2
"""Speed [m/s] that a moving point may gain unnoticed after a check."""

KIN_EXCESS = 3 * EXCESS
"""The same for a held part against a link behind it: on a wrist its lever may be three times the cup's."""

WINDOW = 0.2
"""Maximum time [s] between two checks."""

REVIEW = 0.1
"""Time [s] between two reviews, which also close groups and find passengers, while anything is open."""

SHORTEST = 4
"""What something could reach within this number of steps is open."""

CALM = 0.1
"""A group closes, and a part becomes a passenger, if nothing can reach it within this time [s]."""

_STEADY = np.array((5e-5, 5e-5, 1e-4, 5e-3, 5e-3, 5e-3))
"""Maximum deviation of a part's velocity from the belt's [m/s, rad/s] when it becomes a passenger.

A cylinder at rest turns to and fro at 1e-3 rad/s for ever.
"""

_NO_CONTACTS = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)


class _Kin(NamedTuple):
    """Links that move relative to a part on a weld, in the same mechanism: the rows, and levers of their motion."""

    rows: Numbers
    levers: Vectors


class _Movers(NamedTuple):
    """Moving bodies, and the boxes that they may come to: rows and columns of the table of gaps.

    Attributes:
        links: number of links of mechanisms, the first rows.
        free: number of links and of parts, the next rows; passengers are the last.
        bodies: bodies of the rows.
        carriers: what carries each row; -1 for nothing.
        local: centres and half extents of their boxes in their own frames [m], both of shape (rows, 3, 1).
        dofs: dofs that move them.
        weights: how far each of these moves any point [m/rad, m/m].
        levers: how far these move a point of each, shape (rows, dofs).
        base: speed of each [m/s] to add to that of its dofs.
        opposite: sides of the columns [m], shape (6, columns): groups, what is behind the belt's end, passengers.
        never: infinite where row and column ignore each other, else 0.
        watched: likewise, and infinite for open groups but in the rows of passengers.
        kin: by column of a passenger, where its mechanism is articulated.
        can_touch: True if links may touch each other.
    """

    links: int
    free: int
    bodies: Numbers
    carriers: Numbers
    local: tuple[Vectors, Vectors]
    dofs: Numbers
    weights: Vectors
    levers: Vectors
    base: Vectors
    opposite: Vectors
    never: Vectors
    watched: Vectors
    kin: dict[int, _Kin]
    can_touch: bool


class CollisionCulling(Device):
    """Device that closes bodies which cannot meet to the engine; the last one in `before_step`.

    Closed bodies, passengers and the time of the next check are state, in snapshots and in the state hash.

    Args:
        conveyor: the belt.
        overlaps: the overlapping parts; they are never passengers, since their contact carries their penetration.

    Attributes:
        passengers: body of each passenger, and what carries it: the belt's body or the other body of a weld.
    """

    def __init__(self, conveyor: Conveyor, overlaps: Overlaps) -> None:
        super().__init__("collision_culling")
        self.passengers: dict[int, int] = {}
        self._conveyor = conveyor
        self._overlaps = overlaps
        self._woken: set[int] = set()
        self._due = self._review_due = 0
        self._movers: _Movers | None = None
        self._is_awake: Mask = np.zeros(0, dtype=np.bool_)

    @property
    def closed(self) -> frozenset[int]:
        """Bodies that are closed to the engine, without passengers."""
        return frozenset(np.flatnonzero(self._is_closed).tolist())

    @property
    def gliders(self) -> tuple[int, ...]:
        """Bodies of the passengers on the belt."""
        return tuple(body for body, carrier in self.passengers.items() if carrier == self._belt)

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
        self._contype, self._conaffinity = model.body_contype.copy(), model.body_conaffinity.copy()
        self._gravcomp = model.body_gravcomp.copy()
        self._tree = model.body_treeid.astype(np.int64)
        self._is_closed = np.zeros(model.nbody, dtype=np.bool_)
        self._boxes = BodyBoxes(model)
        self._parts, self._links = self._find_trees()
        self._sleeping = SleepingGroups(model, self._boxes, self._parts, self._links)
        self._belt = int(model.geom_bodyid[model.geom(BELT_GEOM).id])
        behind = np.full((6, 1), -FAR)
        behind[4] = -self._sleeping.fixed[self._belt].sides[1, 0]  # it moves towards -y
        self._behind_belt = Boxes(behind, np.array([-1]), np.array([-1]))
        self._moving = np.array([body for body in self._boxes.bodies if self._tree[body] >= 0], dtype=np.int64)
        self._levers = {body: self._boxes.levers(body) for body in self._moving.tolist()}
        self._weights = np.max([np.zeros(model.nv), *self._levers.values()], axis=0)
        """Maximum speed of any point for each unit of a joint velocity [m/rad, m/m]."""
        self._dofs = model.body_dofadr.astype(np.int64)[:, None] + np.arange(6)
        self._dof_tree = model.dof_treeid.astype(np.int64)
        self._turns = model.jnt_type[model.dof_jntid] == mujoco.mjtJoint.mjJNT_HINGE
        self._welds = self._find_welds()
        self._velocities, self._asleep, self._forces = data.qvel, data.tree_asleep, data.xfrc_applied
        self._no_forces = np.zeros_like(data.xfrc_applied).tobytes()
        self._step = float(model.opt.timestep)
        self._soon = SHORTEST * self._step
        self._reference: Vectors = np.zeros(0)
        self._forget()

    def reset(self) -> None:
        """Begin a run: everything is open."""
        self._woken.clear()
        self._open_all()

    def get_state(self) -> State:
        """Return what is closed and carried, and all that the next checks depend on."""
        return {
            "closed": np.flatnonzero(self._is_closed).tolist(),
            "passengers": [[body, carrier] for body, carrier in self.passengers.items()],
            "awake": np.flatnonzero(self._is_awake).tolist(),
            "woken": sorted(self._woken),
            "due": self._due,
            "review_due": self._review_due,
            "contacts": not self.simulation.model.opt.disableflags & _NO_CONTACTS,
            "reference": self._reference.tolist(),
        }

    def set_state(self, state: State) -> None:
        """Restore what `get_state` returned."""
        self._open_all()
        self._close(np.array(state["closed"], dtype=np.int64))
        for body, carrier in state["passengers"]:
            self._take_along(body, carrier)
        self._is_awake[:] = False
        self._is_awake[state["awake"]] = True
        self._awake_count = len(state["awake"])
        self._woken.clear()
        self._woken.update(state["woken"])
        self._due, self._review_due = state["due"], state["review_due"]
        self._allow_contacts(state["contacts"])
        self._reference = np.array(state["reference"])

    def before_step(self) -> None:
        """Check if it is time, or if something was woken or pushed, or has become faster."""
        simulation = self.simulation
        if simulation.model is self._model:
            self._check_if_due()
            return
        last = self._last_step  # a model that has just grown has no contacts yet
        self.set_state(self.get_state())
        self._last_step = last
        self._check_if_due()
        self._last_step = simulation.model, simulation.data

    def _check_if_due(self) -> None:
        simulation = self.simulation
        is_due = self._woken or simulation.clock.tick >= self._due or simulation.data.ntree_awake != self._awake_count
        if not is_due:
            movers = self._find_movers()
            change = np.abs(self._velocities[movers.dofs] - self._reference)
            is_due = change.dot(movers.weights) > EXCESS or self._forces.tobytes() != self._no_forces
        if is_due:
            self._check()

    def _check(self) -> None:
        """Plan the next check, or review everything if something closed may be touched before."""
        simulation = self.simulation
        simulation.refresh()
        is_awake = self._asleep < 0
        if not self._woken and simulation.clock.tick < self._review_due and (is_awake == self._is_awake).all():
            movers = self._find_movers()
            times = self._times(movers, self._sides(movers), self._speeds(movers))
            times += movers.watched
            until = float(times.min(initial=WINDOW))
            if until >= self._soon and self._forces.tobytes() == self._no_forces and not self._find_pushed():
                self._plan(until)
                return
        self._review(is_awake)

    def _check_next(self) -> None:
        """Check before the next step: a position was written directly."""
        self._due = 0

    def _plan(self, until: float) -> None:
        """Plan the next check for at most `until` [s] from now."""
        steps = int(until / self._step) if until > self._step else 1  # also where a position is not a number
        self._due = self.simulation.clock.tick + steps
        self._reference = self._velocities[self._movers.dofs] if self._movers is not None else np.zeros(0)

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
        sides, speeds = self._sides(movers, woken), self._speeds(movers)
        times = self._times(movers, sides, speeds)
        times += movers.never
        count = len(groups.boxes)
        left = np.minimum.reduceat(times[: movers.free, :count].min(axis=0, initial=np.inf), groups.first_box)
        closed = self._is_closed[groups.bodies]
        for group in np.flatnonzero(np.logical_or.reduceat(closed, groups.first) & (left < self._soon)).tolist():
            self._open(groups.members(group))
        for group in np.flatnonzero(~np.logical_and.reduceat(closed, groups.first) & (left > CALM)).tolist():
            self._close(groups.members(group))
        riding = np.minimum(times[movers.free :].min(axis=1), times[:, count + 1 :].min(axis=0, initial=np.inf))
        leaving = [body for body, time in zip(list(self.passengers), riding.tolist(), strict=True) if time < self._soon]
        for body in leaving:
            self._put_down(body, groups)
        joining = self._find_passengers(movers, sides, speeds, groups)
        for body, carrier in joining:
            self._take_along(body, carrier)
        is_closed = np.logical_and.reduceat(self._is_closed[groups.bodies], groups.first)
        is_calm = bool(is_closed.all()) and movers.links == movers.free and not leaving
        self._allow_contacts(not is_calm or movers.can_touch)
        tick = self.simulation.clock.tick
        if woken or leaving or joining:
            self._review_due = tick + 1
            self._plan(0.0)
        else:
            self._review_due = NEVER if is_calm else tick + max(1, int(REVIEW / self._step))
            self._watch(movers, groups)
            times += movers.watched
            self._plan(float(times.min(initial=WINDOW)))

    def _find_pushed(self) -> list[int]:
        """Return the gliders that do not have the belt's velocity any more: a program has written another one."""
        gliders = self.gliders
        if not gliders:
            return []
        deviation = self._velocities[self._dofs[list(gliders)]]
        deviation[:, 1] += self._conveyor.speed
        np.abs(deviation, out=deviation)
        if (deviation < _STEADY).all():
            return []
        return [body for body, values in zip(gliders, deviation, strict=True) if not (values < _STEADY).all()]

    def _watch(self, movers: _Movers, groups: Groups) -> None:
        """Leave open groups out of the next checks."""
        is_open = ~np.logical_and.reduceat(self._is_closed[groups.bodies], groups.first)
        np.copyto(movers.watched, movers.never)
        movers.watched[: movers.free, : len(groups.boxes)][:, is_open[groups.of_box]] = np.inf

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
        is_awake[woken] = ~self._is_closed[bodies]  # as before
        if (self._is_closed[self._moving] & is_awake[self._tree[self._moving]]).any():
            self._open_all()  # woken past the simulation, as by a force on a joint
        if woken:
            groups = self._sleeping.find(self.simulation.data, is_awake)
            for body in bodies:
                if body in self.passengers:
                    self._put_down(body, groups)
                elif groups.of_body[body] >= 0:
                    self._open(groups.members(int(groups.of_body[body])))
            is_awake[woken] = True
        return bodies

    def _find_trees(self) -> tuple[Numbers, dict[int, list[int]]]:
        """Return the free bodies, and the touchable bodies of each other tree."""
        model = self.simulation.model
        touchable = set(self._boxes.bodies)
        parts, links = [], {}
        for tree in range(model.ntree):
            first = int(model.tree_bodyadr[tree])
            bodies = [body for body in range(first, first + int(model.tree_bodynum[tree])) if body in touchable]
            if bodies == [first] and model.jnt_type[model.body_jntadr[first]] == mujoco.mjtJoint.mjJNT_FREE:
                parts.append(first)
            else:
                links[tree] = bodies
        return np.array(parts, dtype=np.int64), links

    def _find_welds(self) -> dict[int, list[tuple[int, int]]]:
        """Return the welds of each part, and the body at their other end."""
        model = self.simulation.model
        parts = set(self._parts.tolist())
        welds: dict[int, list[tuple[int, int]]] = {body: [] for body in parts}
        for weld in np.flatnonzero(model.eq_type == mujoco.mjtEq.mjEQ_WELD).tolist():
            ends = int(model.eq_obj1id[weld]), int(model.eq_obj2id[weld])
            for body, other in (ends, ends[::-1]):
                if body in parts and other not in parts:
                    welds[body].append((weld, other))
        return welds

    def _carrier(self, body: int) -> int:
        """Return the body at the other end of a part's only active weld, -1 if there is no such weld."""
        active = self.simulation.data.eq_active
        ends = [other for weld, other in self._welds[body] if active[weld]]
        return ends[0] if len(ends) == 1 else -1

    def _forget(self) -> None:
        """Forget everything that follows from what sleeps, and where."""
        self._is_awake = np.ones(len(self._asleep), dtype=np.bool_)
        self._awake_count = len(self._asleep)
        self._movers = None
        self._sleeping.forget()

    def _find_movers(self) -> _Movers:
        """Return what moves; it changes with what is awake, what is carried, and by what."""
        if self._movers is None:
            self._movers = self._make_movers(self._sleeping.find(self.simulation.data, self._is_awake))
        return self._movers

    def _make_movers(self, groups: Groups) -> _Movers:
        links = [body for tree, bodies in self._links.items() if self._is_awake[tree] for body in bodies]
        loose = self._parts[self._is_awake[self._tree[self._parts]]].tolist()
        parts = [body for body in loose if body not in self.passengers]
        bodies = np.array([*links, *parts, *self.passengers], dtype=np.int64)
        free, count = len(links) + len(parts), len(groups.boxes)
        carriers = np.array(
            [-1] * len(links) + [self._carrier(body) for body in parts] + list(self.passengers.values()), dtype=np.int64
        )
        is_gliding = carriers == self._belt
        boxes = self._boxes.at(bodies, np.zeros((len(bodies), 3)), np.zeros((len(bodies), 9)))
        columns = Boxes.joined([groups.boxes, self._behind_belt, boxes.some(slice(free, None))])
        never = np.where(boxes.ignore(columns), np.inf, 0.0)
        never[~is_gliding, count] = np.inf
        never[:, :count][is_gliding[:, None] & (groups.fixed_body == self._belt)] = np.inf
        never[:, count + 1 :][carriers[:, None] == carriers[free:]] = np.inf
        kin = {}
        for column, (body, carrier) in enumerate(self.passengers.items(), count + 1):
            if carrier != self._belt:
                relative = self._relative_levers(body, carrier, links)
                related = self._tree[links] == self._tree[carrier]
                moving = relative.any(axis=1)
                never[: len(links), column][related & ~moving] = np.inf
                rows = np.flatnonzero(related & moving)
                if len(rows):
                    kin[column] = _Kin(rows, relative[rows])
        dofs = np.flatnonzero(np.isin(self._dof_tree, self._tree[bodies[~is_gliding]]))
        levers = np.array([self._levers[body][dofs] for body in bodies.tolist()]).reshape(len(bodies), len(dofs))
        movers = _Movers(
            links=len(links),
            free=free,
            bodies=bodies,
            carriers=carriers,
            local=self._boxes.local(bodies),
            dofs=dofs,
            weights=self._weights[dofs],
            levers=levers,
            base=np.where(is_gliding, self._conveyor.speed, EXCESS),
            opposite=facing(columns.sides),
            never=never,
            watched=never.copy(),
            kin={column: _Kin(each.rows, each.levers[:, dofs]) for column, each in kin.items()},
            can_touch=not boxes.some(slice(len(links))).ignore(boxes.some(slice(len(links)))).all(),
        )
        self._watch(movers, groups)
        return movers

    def _relative_levers(self, body: int, carrier: int, links: list[int]) -> Vectors:
        """Return how far joints move a welded part relative to links [m/rad, m/m], shape (links, dofs of the model)."""
        model, data = self.simulation.model, self.simulation.data
        welds = [weld for weld, _ in self._welds[body] if data.eq_active[weld]]
        apart = np.linalg.norm(model.eq_data[welds, 3:6], axis=1).max(initial=0.0)  # of the bodies' origins
        reach = apart + self._boxes.radius[body]
        levers = self._levers[carrier] + reach * (self._turns & (self._levers[carrier] > 0.0))
        return np.array([np.where(self._levers[link] > 0.0, 0.0, levers) for link in links]).reshape(-1, len(levers))

    def _sides(self, movers: _Movers, woken: list[int] | None = None) -> Vectors:
        """Return the sides of the moving boxes; the engine may not yet update the poses of what was woken."""
        data = self.simulation.data
        positions, matrices = data.xpos[movers.bodies], data.xmat[movers.bodies]
        for body in woken or ():
            if body in self._welds:
                row = int(np.flatnonzero(movers.bodies == body)[0])
                address = int(self.simulation.model.jnt_qposadr[self.simulation.model.body_jntadr[body]])
                pose = data.qpos[address : address + 7]
                positions[row], matrices[row] = pose[:3], rotations(pose[None, 3:])[0]
        return sides_at(*movers.local, positions, matrices)

    def _speeds(self, movers: _Movers) -> Vectors:
        """Return the maximum speed of a point of each body until the next check [m/s]."""
        return np.asarray(movers.levers @ np.abs(self._velocities[movers.dofs]) + movers.base)

    def _times(self, movers: _Movers, sides: Vectors, speeds: Vectors) -> Vectors:
        """Return the time [s] in which each row could come within the margin of each column."""
        free, first = movers.free, movers.opposite.shape[1] - len(self.passengers)
        movers.opposite[:, first:] = facing(sides[:, free:])
        found = gaps(sides, movers.opposite)
        near = {column: found[each.rows, column] for column, each in movers.kin.items()}
        found -= MARGIN
        found[:, :first] /= speeds[:, None]
        found[:, first:] /= speeds[:, None] + speeds[free:]
        for column, each in movers.kin.items():
            found[each.rows, column] = self._kin_times(movers, each, near[column])
        return found

    def _kin_times(self, movers: _Movers, kin: _Kin, gap: Vectors) -> Vectors:
        speeds = kin.levers @ np.abs(self._velocities[movers.dofs]) + KIN_EXCESS
        return np.asarray((gap - KIN_MARGIN) / speeds)

    def _find_passengers(
        self, movers: _Movers, sides: Vectors, speeds: Vectors, groups: Groups
    ) -> list[tuple[int, int]]:
        """Return parts that something carries and that touch nothing else, nor will for a while; and their carriers."""
        rows = np.arange(movers.links, movers.free)
        if not len(rows):
            return []
        velocities = self._velocities[self._dofs[movers.bodies[rows]]]
        velocities[:, 1] += self._conveyor.speed
        is_steady = (np.abs(velocities) < _STEADY).all(axis=1) & (self._conveyor.speed > 0.0)
        model, data = self._last_step
        touching = model.geom_bodyid[data.contact.geom[: data.ncon]]
        overlapping = self._overlaps.bodies
        carriers = movers.carriers.copy()
        is_pushed = self._forces[movers.bodies[rows]].any(axis=1)
        carriers[rows[is_pushed]] = -1
        for row in rows[(is_steady | (carriers[rows] >= 0)) & ~is_pushed].tolist():
            body, weld = int(movers.bodies[row]), int(carriers[row])
            carrier = weld if weld >= 0 else self._belt
            others = touching[(touching == body).any(axis=1)]
            touches_more = bool(((others != body) & (others != carrier)).any()) or body in overlapping
            carriers[row] = -1 if touches_more or (weld < 0 and not len(others)) else carrier
        while True:  # those on one carrier do not come nearer to each other
            failing = [
                row
                for row in rows[carriers[rows] >= 0].tolist()
                if not self._is_calm(movers, row, carriers, sides, speeds, groups)
            ]
            if not failing:
                found = rows[carriers[rows] >= 0]
                return list(zip(movers.bodies[found].tolist(), carriers[found].tolist(), strict=True))
            carriers[failing] = -1

    def _is_calm(
        self, movers: _Movers, row: int, carriers: Numbers, sides: Vectors, speeds: Vectors, groups: Groups
    ) -> bool:
        """Return whether a part would meet nothing for a while if it and others were passengers of these carriers."""
        count, carrier = len(groups.boxes), int(carriers[row])
        is_gliding = carrier == self._belt
        speed = self._conveyor.speed if is_gliding else speeds[row]
        ahead, met = (
            gaps(sides[:, row : row + 1], each)[0] for each in (movers.opposite[:, : count + 1], facing(sides))
        )
        ahead[:-1][is_gliding & (groups.fixed_body == self._belt)] = np.inf
        ahead[-1] = ahead[-1] if is_gliding else np.inf
        met[carriers == carrier] = np.inf
        if not is_gliding:
            links = movers.bodies[: movers.links]
            relative = self._relative_levers(int(movers.bodies[row]), carrier, links.tolist())
            rows = np.flatnonzero(self._tree[links] == self._tree[carrier])
            kin = _Kin(rows, relative[rows][:, movers.dofs])
            is_moving = kin.levers.any(axis=1)
            if (self._kin_times(movers, kin, met[rows])[is_moving] < 2 * self._soon).any():
                return False
            met[rows] = np.inf
        return bool(((ahead - MARGIN) / speed > CALM).all() and ((met - MARGIN) / (speed + speeds) > CALM).all())

    def _take_along(self, body: int, carrier: int) -> None:
        """Close a part that something carries; on the belt it takes its velocity and has no weight."""
        model = self.simulation.model
        self.passengers[body] = carrier
        self._movers = None
        model.body_contype[body] = model.body_conaffinity[body] = 0
        if carrier == self._belt:
            model.body_gravcomp[body] = 1.0
            self._velocities[self._dofs[body]] = 0.0, -self._conveyor.speed, 0.0, 0.0, 0.0, 0.0

    def _put_down(self, body: int, groups: Groups) -> None:
        """Open a part again, and what carries it."""
        group = int(groups.of_body[self.passengers.pop(body)])
        self._movers = None
        self.simulation.model.body_gravcomp[body] = self._gravcomp[body]
        self._open(np.array([body]))
        if group >= 0:
            self._open(groups.members(group))

    def _open(self, bodies: Numbers) -> None:
        model = self.simulation.model
        self._is_closed[bodies] = False
        model.body_contype[bodies], model.body_conaffinity[bodies] = self._contype[bodies], self._conaffinity[bodies]

    def _close(self, bodies: Numbers) -> None:
        model = self.simulation.model
        self._is_closed[bodies] = True
        model.body_contype[bodies] = model.body_conaffinity[bodies] = 0

    def _open_all(self) -> None:
        """Open everything, as at the start of a run."""
        if self.simulation.model is not self._model:
            self._look_up()
        self.passengers.clear()
        self._open(np.arange(len(self._is_closed)))
        self.simulation.model.body_gravcomp[:] = self._gravcomp
        self._allow_contacts(True)
        self._due = self._review_due = 0
        self._reference = np.zeros(0)
        self._forget()

    def _allow_contacts(self, allowed: bool) -> None:  # noqa: FBT001
        option = self.simulation.model.opt
        if allowed == bool(option.disableflags & _NO_CONTACTS):
            option.disableflags ^= _NO_CONTACTS
