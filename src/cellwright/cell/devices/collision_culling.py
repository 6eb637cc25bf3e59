"""Collision culling: bodies that cannot touch anything soon are left out of collision detection.

The engine's broad phase sorts the bounding box of every body in each step, asleep or not, and a part that rides the
belt has contacts to solve in each step. This device closes bodies to the engine (`body_contype` 0) while nothing can
come of it:

- A **group** is a fixed body or a resting mechanism, such as an AGV, with the sleeping parts in and on it. It is closed
  as a whole while nothing awake can reach it: what wakes together opens together.
- A **glider** is a part that rides the belt steadily and touches nothing else. It moves at exactly the belt's velocity
  and without weight until something comes near, the belt changes or ends, or a force acts on it.
- If nothing is open but mechanisms that touch nothing, such as the arm, the engine skips contacts altogether.

A check computes the gap between the bounding box of every moving body and that of every group. From gaps and speeds
follows the time of the next check. Speeds may change before: each step compares all joint velocities with those of the
last check, and checks again when a moving point could be faster by `EXCESS`. So a drive may be as strong as it likes;
only what it can add in a single step must fit into `MARGIN`.

Wherever anything touches anything all bodies take part, and the engine computes what it would compute without culling.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from cellwright.cell.devices.conveyor import Conveyor
from cellwright.cell.devices.parts import Overlaps
from cellwright.cell.model.furniture import BELT_GEOM
from cellwright.engine.bounding_boxes import FAR, BodyBoxes, Boxes, Mask, Numbers, Vectors, facing, gaps, sides_at
from cellwright.engine.clock import NEVER
from cellwright.engine.simulation import Device, Simulation, State

MARGIN = 0.02
"""Gap [m] below which bodies may touch in the next step.

Half of it covers `EXCESS` during `WINDOW`. The rest covers a single step: contacts begin at 1 mm, and 9 mm are a jump
of the speed by 4.5 m/s within 2 ms.
"""

EXCESS = 0.2
"""Speed [m/s] that a moving point may gain unnoticed after a check."""

WINDOW = 0.05
"""Maximum time [s] between two checks."""

SHORTEST = 4
"""A group that something could reach within this number of steps is open."""

CALM = 0.1
"""A group closes, and a part begins to glide, if nothing can reach it within this time [s]."""

LINKED = 0.01
"""Maximum gap [m] between bounding boxes of sleeping bodies that may touch; the engine's contacts begin at 1 mm."""

COMPACT = 1.0
"""A larger fixed body [m] has a box for each of its shapes: that around a portal would mostly be empty."""

_STEADY = np.array((5e-5, 5e-5, 1e-4, 5e-3, 5e-3, 5e-3))
"""Maximum deviation of a part's velocity from the belt's [m/s, rad/s] when it begins to glide.

A cylinder at rest turns to and fro at 1e-3 rad/s for ever.
"""

_NO_CONTACTS = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)


class _Groups(NamedTuple):
    """Groups of bodies that sleep in touch.

    Attributes:
        bodies: bodies of all groups, group by group.
        first: index of each group's first body.
        of_body: group of each body of the model, -1 for none.
        boxes: boxes of all groups, group by group.
        first_box: index of each group's first box.
        of_box: group of each box.
        is_belt: True for the box of the belt itself, shape (boxes,).
    """

    bodies: Numbers
    first: Numbers
    of_body: Numbers
    boxes: Boxes
    first_box: Numbers
    of_box: Numbers
    is_belt: Mask


class _Movers(NamedTuple):
    """Bodies that move, and the boxes that they may come to: rows and columns of the table of gaps.

    Attributes:
        links: number of links of mechanisms, the first rows.
        parts: number of parts, the next rows; gliders are the last.
        bodies: bodies of the rows.
        local: centres and half extents of their boxes in their own frames [m], both of shape (rows, 3, 1).
        dofs: dofs that move links and parts.
        levers: how far these move points of links and parts [m/rad, m/m], shape (links + parts, dofs).
        opposite: sides of the columns [m], shape (6, columns): the groups, what is behind the belt's end, gliders.
        never: infinite where row and column ignore each other, else 0.
        watched: likewise, and infinite for open groups but in the rows of gliders.
        can_touch: True if links may touch each other.
    """

    links: int
    parts: int
    bodies: Numbers
    local: tuple[Vectors, Vectors]
    dofs: Numbers
    levers: Vectors
    opposite: Vectors
    never: Vectors
    watched: Vectors
    can_touch: bool


class CollisionCulling(Device):
    """Device that closes bodies which cannot meet to the engine; the last one in `before_step`.

    Closed bodies, gliders and the time of the next check are state, in snapshots and in the state hash.

    Args:
        conveyor: the belt.
        overlaps: the overlapping parts; they never glide, since their contact carries their penetration.
    """

    def __init__(self, conveyor: Conveyor, overlaps: Overlaps) -> None:
        super().__init__("collision_culling")
        self._conveyor = conveyor
        self._overlaps = overlaps
        self._gliders: list[int] = []
        self._woken: set[int] = set()
        self._due = self._review_due = 0

    @property
    def closed(self) -> frozenset[int]:
        """Bodies that are closed to the engine, without gliders."""
        return frozenset(np.flatnonzero(self._is_closed).tolist())

    @property
    def gliders(self) -> tuple[int, ...]:
        """Bodies of the parts that glide on the belt."""
        return tuple(self._gliders)

    def attach(self, simulation: Simulation) -> None:
        """Look up bodies, their boxes and classes."""
        super().attach(simulation)
        model, data = simulation.model, simulation.data
        self._boxes = BodyBoxes(model)
        fixed = self._boxes.fixed(COMPACT)
        self._fixed = Boxes.joined(list(fixed.values()))
        self._fixed_body = np.repeat(list(fixed), [len(each) for each in fixed.values()])
        self._belt = int(model.geom_bodyid[model.geom(BELT_GEOM).id])
        behind = np.full((6, 1), -FAR)
        behind[4] = -fixed[self._belt].sides[1, 0]  # it moves towards -y
        self._behind_belt = Boxes(behind, np.array([-1]), np.array([-1]))
        self._contype, self._gravcomp = model.body_contype.copy(), model.body_gravcomp.copy()
        self._conaffinity = model.body_conaffinity.copy()
        self._tree = model.body_treeid.astype(np.int64)
        self._is_closed = np.zeros(model.nbody, dtype=np.bool_)
        self._parts, self._links = self._find_trees()
        self._qpos = model.jnt_qposadr[model.body_jntadr[self._parts]].astype(np.int64)[:, None] + np.arange(7)
        self._dofs = model.body_dofadr.astype(np.int64)[:, None] + np.arange(6)
        self._dof_tree = model.dof_treeid.astype(np.int64)
        self._moving = np.array([body for body in self._boxes.bodies if self._tree[body] >= 0], dtype=np.int64)
        self._levers = {body: self._boxes.levers(body) for body in self._moving.tolist()}
        self._weights = np.max([np.zeros(model.nv), *self._levers.values()], axis=0)
        """Maximum speed of any point for each unit of a joint velocity [m/rad, m/m]."""
        self._velocities, self._asleep, self._forces = data.qvel, data.tree_asleep, data.xfrc_applied
        self._no_forces = np.zeros_like(data.xfrc_applied).tobytes()
        self._step = float(model.opt.timestep)
        self._soon = SHORTEST * self._step
        self._reference = np.zeros(model.nv)
        self._difference = np.empty(model.nv)
        self._forget()
        simulation.on_wake.append(self._woken.add)
        simulation.on_renewal.append(self._open_all)

    def reset(self) -> None:
        """Begin a run: everything is open."""
        self._woken.clear()
        self._open_all()

    def get_state(self) -> State:
        """Return closed bodies, gliders, trees woken after the last check, its velocities, and when the next is due."""
        moving = np.flatnonzero(self._reference).tolist()
        return {
            "closed": np.flatnonzero(self._is_closed).tolist(),
            "gliders": list(self._gliders),
            "woken": sorted(self._woken),
            "due": self._due,
            "review_due": self._review_due,
            "contacts": not self.simulation.model.opt.disableflags & _NO_CONTACTS,
            "reference": [[dof, float(self._reference[dof])] for dof in moving],
        }

    def set_state(self, state: State) -> None:
        """Restore what `get_state` returned."""
        self._open_all()
        self._close(np.array(state["closed"], dtype=np.int64))
        for body in state["gliders"]:
            self._begin_glide(body)
        self._allow_contacts(state["contacts"])
        self._woken.clear()
        self._woken.update(state["woken"])
        self._due, self._review_due = state["due"], state["review_due"]
        self._reference[:] = 0.0
        for dof, velocity in state["reference"]:
            self._reference[dof] = velocity

    def before_step(self) -> None:
        """Check if it is time, or if something was woken or pushed, or has become faster."""
        if self._woken or self.simulation.clock.tick >= self._due:
            self._check()
            return
        difference = self._difference
        np.subtract(self._velocities, self._reference, difference)
        np.abs(difference, difference)
        if difference.dot(self._weights) > EXCESS or self._forces.tobytes() != self._no_forces:
            self._check()

    def _check(self) -> None:
        """Plan the next check, or review everything if something closed or gliding may be touched before."""
        simulation = self.simulation
        simulation.refresh()
        tick = simulation.clock.tick
        is_awake = self._asleep < 0
        known = is_awake.tobytes()
        if not self._woken and known == self._awake_known and self._movers is not None and tick < self._review_due:
            movers = self._movers
            times = self._times(movers, self._sides(movers), self._speeds(movers))
            times += movers.watched
            until = float(times.min(initial=WINDOW))
            if until >= self._soon and self._forces.tobytes() == self._no_forces:
                self._plan(until)
                return
        self._review(is_awake)

    def _plan(self, until: float) -> None:
        """Plan the next check for at most `until` [s] from now."""
        steps = int(until / self._step) if until > self._step else 1  # also where a position is not a number
        self._due = self.simulation.clock.tick + steps
        np.copyto(self._reference, self._velocities)

    def _review(self, is_awake: Mask) -> None:
        """Open what may be touched soon, close what cannot, and look for parts that glide."""
        woken = self._wake_up(is_awake)
        groups = self._find_groups(is_awake)
        movers = self._find_movers(is_awake, groups)
        sides, speeds = self._sides(movers, woken), self._speeds(movers)
        times = self._times(movers, sides, speeds)
        times += movers.never
        free, count = movers.links + movers.parts, len(groups.boxes)
        left = np.minimum.reduceat(times[:free, :count].min(axis=0, initial=np.inf), groups.first_box)
        closed = self._is_closed[groups.bodies]
        for group in np.flatnonzero(np.logical_or.reduceat(closed, groups.first) & (left < self._soon)).tolist():
            self._open(groups, group)
        for group in np.flatnonzero(~np.logical_and.reduceat(closed, groups.first) & (left > CALM)).tolist():
            self._close(_piece(groups.bodies, groups.first, group))
        gliding = np.minimum(times[free:].min(axis=1), times[:free, count + 1 :].min(axis=0, initial=np.inf))
        landing = [body for body, time in zip(self._gliders, gliding.tolist(), strict=True) if time < self._soon]
        for body in landing:
            self._end_glide(body)
            self._open(groups, int(groups.of_body[self._belt]))
        starting = self._find_gliders(movers, sides, speeds, groups) if movers.parts else []
        for body in starting:
            self._begin_glide(body)
        is_closed = np.logical_and.reduceat(self._is_closed[groups.bodies], groups.first)
        is_calm = bool(is_closed.all()) and not movers.parts and not landing
        self._allow_contacts(not is_calm or movers.can_touch)
        tick = self.simulation.clock.tick
        self._review_due = NEVER if is_calm else tick + max(1, int(WINDOW / self._step))
        if woken or landing or starting:
            self._review_due = tick + 1
        else:
            np.copyto(movers.watched, movers.never)
            movers.watched[:free, :count][:, ~is_closed[groups.of_box]] = np.inf
            times += movers.watched
        self._plan(0.0 if self._review_due == tick + 1 else float(times.min(initial=WINDOW)))

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
        if not woken:
            return []
        groups = self._find_groups(is_awake)
        for body in bodies:
            if body in self._gliders:
                self._end_glide(body)
                self._open(groups, int(groups.of_body[self._belt]))
            elif groups.of_body[body] >= 0:
                self._open(groups, int(groups.of_body[body]))
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

    def _forget(self) -> None:
        """Forget everything that follows from which bodies sleep, and where."""
        self._awake_known = b""
        self._groups: _Groups | None = None
        self._movers: _Movers | None = None
        count = len(self._parts)
        bits = (each[self._parts].astype(np.int64) for each in (self._contype, self._conaffinity))
        self._resting = Boxes(np.zeros((6, count)), *bits)
        self._is_resting = np.zeros(count, dtype=np.bool_)
        self._linked = np.zeros((0, 2), dtype=np.int64)
        """Pairs of resting parts that may touch."""

    def _find_groups(self, is_awake: Mask) -> _Groups:
        """Return the groups of what sleeps; they change only with it."""
        known = is_awake.tobytes()
        if self._groups is not None and known == self._awake_known:
            return self._groups
        data = self.simulation.data
        mechanisms = [bodies for tree, bodies in self._links.items() if bodies and not is_awake[tree]]
        links = np.array([body for bodies in mechanisms for body in bodies], dtype=np.int64)
        standing = Boxes.joined([self._fixed, self._boxes.at(links, data.xpos[links], data.xmat[links])])
        owners = np.concatenate([self._fixed_body, links])
        self._note_resting(~is_awake[self._tree[self._parts]])
        resting = np.flatnonzero(self._is_resting)
        boxes = self._resting.some(resting)
        part, box = np.nonzero(boxes.gaps(standing) <= LINKED)
        pairs = [
            np.column_stack([self._parts[resting[part]], owners[box]]),
            self._parts[self._linked],
            *(np.column_stack([np.full(len(bodies), bodies[0]), bodies]) for bodies in mechanisms),
        ]
        group = _joined(self.simulation.model.nbody, np.concatenate(pairs))
        bodies = np.concatenate([np.unique(owners), self._parts[resting]])
        bodies = bodies[np.argsort(group[bodies], kind="stable")]
        names, first = np.unique(group[bodies], return_index=True)
        of_body = np.full(len(group), -1)
        of_body[bodies] = np.searchsorted(names, group[bodies])
        order = np.argsort(of_body[self._parts[resting]], kind="stable")
        ours, starts = np.unique(of_body[self._parts[resting]][order], return_index=True)
        every = Boxes.joined([standing, boxes.some(order).around(starts)])
        owner = np.concatenate([of_body[owners], ours])
        sequence = np.argsort(owner, kind="stable")
        is_belt = np.concatenate([owners == self._belt, np.zeros(len(ours), dtype=np.bool_)])
        first_box = np.searchsorted(owner[sequence], np.arange(len(names)))
        self._groups = _Groups(
            bodies, first, of_body, every.some(sequence), first_box, owner[sequence], is_belt[sequence]
        )
        self._awake_known, self._movers = known, None
        return self._groups

    def _note_resting(self, is_resting: Mask) -> None:
        """Note which parts sleep, where, and which of them may touch."""
        self._linked = self._linked[is_resting[self._linked].all(axis=1)]
        new = np.flatnonzero(is_resting & ~self._is_resting)
        self._is_resting = is_resting
        poses = self.simulation.data.qpos[self._qpos[new]]
        boxes = self._boxes.at(self._parts[new], poses[:, :3], _rotations(poses[:, 3:]))
        self._resting.sides[:, new] = boxes.sides
        asleep = np.flatnonzero(is_resting)
        row, column = np.nonzero(boxes.gaps(self._resting.some(asleep)) <= LINKED)
        pairs = np.column_stack([new[row], asleep[column]])
        self._linked = np.concatenate([self._linked, pairs[pairs[:, 0] != pairs[:, 1]]])

    def _find_movers(self, is_awake: Mask, groups: _Groups) -> _Movers:
        """Return what moves; it changes only with what is awake and what glides."""
        if self._movers is None:
            mechanisms = [tree for tree in self._links if is_awake[tree]]
            links = [body for tree in mechanisms for body in self._links[tree]]
            loose = self._parts[is_awake[self._tree[self._parts]]]
            parts = loose[~np.isin(loose, self._gliders)]
            bodies = np.concatenate([np.array(links, dtype=np.int64), parts, self._gliders]).astype(np.int64)
            boxes = self._boxes.at(bodies, np.zeros((len(bodies), 3)), np.zeros((len(bodies), 9)))
            free, count = len(links) + len(parts), len(groups.boxes)
            columns = Boxes.joined([groups.boxes, self._behind_belt, boxes.some(slice(free, None))])
            never = np.where(boxes.ignore(columns), np.inf, 0.0)
            never[:free, count] = np.inf
            never[free:, :count][:, groups.is_belt] = np.inf
            never[free:, count + 1 :] = np.inf
            can_touch = not boxes.some(slice(len(links))).ignore(boxes.some(slice(len(links)))).all()
            dofs = np.flatnonzero(np.isin(self._dof_tree, self._tree[bodies[:free]]))
            levers = np.array([self._levers[body][dofs] for body in bodies[:free].tolist()]).reshape(free, len(dofs))
            local, opposite = self._boxes.local(bodies), facing(columns.sides)
            self._movers = _Movers(
                len(links), len(parts), bodies, local, dofs, levers, opposite, never, never.copy(), can_touch
            )
        return self._movers

    def _sides(self, movers: _Movers, woken: Sequence[int] = ()) -> Vectors:
        """Return the sides of the moving boxes; the engine may not yet update the poses of what was woken."""
        data = self.simulation.data
        positions, rotations = data.xpos[movers.bodies], data.xmat[movers.bodies]
        for body in woken:
            index = np.flatnonzero(self._parts == body)
            if len(index):
                pose = data.qpos[self._qpos[index[0]]]
                row = int(np.flatnonzero(movers.bodies == body)[0])
                positions[row], rotations[row] = pose[:3], _rotations(pose[None, 3:])[0]
        return sides_at(*movers.local, positions, rotations)

    def _speeds(self, movers: _Movers) -> Vectors:
        """Return the maximum speed of a point of each body until the next check [m/s], relative to gliders."""
        belt, free = self._conveyor.speed, len(movers.levers)
        speeds = np.full(len(movers.bodies), belt)
        speeds[:free] += movers.levers @ np.abs(self._velocities[movers.dofs]) + EXCESS
        return speeds

    def _times(self, movers: _Movers, sides: Vectors, speeds: Vectors) -> Vectors:
        """Return the time [s] in which each row could come within the margin of each column."""
        count = len(self._gliders)
        if count:
            movers.opposite[:, -count:] = facing(sides[:, -count:])
        times = gaps(sides, movers.opposite)
        times -= MARGIN
        times /= speeds[:, None]
        return times

    def _find_gliders(self, movers: _Movers, sides: Vectors, speeds: Vectors, groups: _Groups) -> list[int]:
        """Return parts that ride steadily, touch nothing but the belt, and will not for a while."""
        belt = self._conveyor.speed
        first, free = movers.links, movers.links + movers.parts
        velocities = self._velocities[self._dofs[movers.bodies[first:free]]]
        velocities[:, 1] += belt
        candidates = first + np.flatnonzero((np.abs(velocities) < _STEADY).all(axis=1))
        if not belt or not len(candidates):
            return []
        data = self.simulation.data
        touching = self.simulation.model.geom_bodyid[data.contact.geom[: data.ncon]]
        overlapping = self._overlaps.bodies
        found = []
        for row in candidates.tolist():
            body = int(movers.bodies[row])
            others = touching[(touching == body).any(axis=1)]
            if not len(others) or not ((others == body) | (others == self._belt)).all() or body in overlapping:
                continue
            box = sides[:, row : row + 1]
            ahead = gaps(box, movers.opposite[:, : len(groups.boxes) + 1])[0]
            ahead[:-1][groups.is_belt] = np.inf
            met = (gaps(box, facing(sides[:, :free]))[0] - MARGIN) / speeds[:free]
            met[row] = np.inf
            if min((ahead.min() - MARGIN) / belt, met.min()) > CALM:
                found.append(body)
        return found

    def _begin_glide(self, body: int) -> None:
        model = self.simulation.model
        self._gliders.append(body)
        self._movers = None
        model.body_contype[body] = model.body_conaffinity[body] = 0
        model.body_gravcomp[body] = 1.0
        self._velocities[self._dofs[body]] = 0.0, -self._conveyor.speed, 0.0, 0.0, 0.0, 0.0

    def _end_glide(self, body: int) -> None:
        self._gliders.remove(body)
        self._movers = None
        self.simulation.model.body_gravcomp[body] = self._gravcomp[body]
        self._restore_classes(np.array([body]))

    def _open(self, groups: _Groups, group: int) -> None:
        bodies = _piece(groups.bodies, groups.first, group)
        self._is_closed[bodies] = False
        self._restore_classes(bodies)

    def _close(self, bodies: Numbers) -> None:
        self._is_closed[bodies] = True
        self.simulation.model.body_contype[bodies] = 0
        self.simulation.model.body_conaffinity[bodies] = 0

    def _open_all(self) -> None:
        """Open everything, as at the start of a run."""
        for body in list(self._gliders):
            self._end_glide(body)
        self._is_closed[:] = False
        self._restore_classes(np.arange(len(self._is_closed)))
        self._allow_contacts(True)
        self._due = self._review_due = 0
        self._reference[:] = 0.0
        self._forget()

    def _restore_classes(self, bodies: Numbers) -> None:
        self.simulation.model.body_contype[bodies] = self._contype[bodies]
        self.simulation.model.body_conaffinity[bodies] = self._conaffinity[bodies]

    def _allow_contacts(self, allowed: bool) -> None:  # noqa: FBT001
        option = self.simulation.model.opt
        if allowed == bool(option.disableflags & _NO_CONTACTS):
            option.disableflags ^= _NO_CONTACTS


def _piece(values: Numbers, first: Numbers, index: int) -> Numbers:
    """Return the values of one group."""
    end = int(first[index + 1]) if index + 1 < len(first) else None
    return values[int(first[index]) : end]


def _joined(count: int, pairs: Numbers) -> Numbers:
    """Return for each of `count` numbers the least number that it is linked to by pairs, shape (count,)."""
    least = np.arange(count)
    while True:
        lower = least[pairs].min(axis=1)
        if (least[pairs] == lower[:, None]).all():
            return least
        np.minimum.at(least, pairs[:, 0], lower)
        np.minimum.at(least, pairs[:, 1], lower)
        least = least[least]


def _rotations(quaternions: Vectors) -> Vectors:
    """Return quaternions (w, x, y, z), shape (n, 4), as matrices, shape (n, 9)."""
    w, x, y, z = (quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)).T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.array([each for row in rows for each in row]).T
