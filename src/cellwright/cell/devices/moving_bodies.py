"""Moving bodies of a cell, what their boxes may come to, and when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np

from cellwright.engine.bounding_boxes import FAR, BodyBoxes, Boxes, Mask, Numbers, Vectors, facing, gaps, sides_at
from cellwright.engine.sleeping_groups import Groups, rotations
from cellwright.util.pose import Vector3

MARGIN = 0.02
"""Gap [m] below which bodies are taken for touching. Contacts begin at 1 mm; the rest is reserve."""

KIN_MARGIN = 0.005
"""The same [m] for a held part and links of the mechanism that holds it, all of which are known to move."""

EXCESS = 0.2
"""Speed [m/s] that a moving point may gain at least unnoticed after a check."""

KIN_EXCESS = 3 * EXCESS
"""The same for a held part against a link behind it: on a wrist its lever may be three times the cup's."""

SHORTEST = 4
"""Number of steps in which nothing that is closed may be reached."""

_STEADY = np.array((5e-5, 5e-5, 1e-4, 5e-3, 5e-3, 5e-3))
"""Maximum deviation of a part's velocity from that of its belt [m/s, rad/s] when it becomes a passenger.

A cylinder at rest turns to and fro at 1e-3 rad/s for ever.
"""


class Kin(NamedTuple):
    """Links that move relative to a part on a weld, in the same mechanism: the rows, and levers of their motion."""

    rows: Numbers
    levers: Vectors

    def times(self, gap: Vectors, velocities: Vectors) -> Vectors:
        """Return the time [s] in which each link could come within the margin, for gaps [m]."""
        return np.asarray((gap - KIN_MARGIN) / (self.levers @ velocities + KIN_EXCESS))


@dataclass(frozen=True, slots=True)
class Ends:
    """Ends of belts that parts ride to: beyond lies a half space, and the gap to it counts along the belt.

    Attributes:
        coordinates: coordinate of each part's end in the direction of travel [m]; infinite without an end.
        towards: share of each side of a part's box in the coordinate of its foremost corner, shape (6, parts).
        exist: True if any part has an end.
    """

    coordinates: Vectors
    towards: Vectors
    exist: bool

    @classmethod
    def of(cls, belts: Sequence[tuple[float, Vector3] | None]) -> Ends:
        """Return the ends for parts, given as coordinate and direction of travel of the belt of each, if it has one."""
        coordinates, towards = np.full(len(belts), np.inf), np.zeros((6, len(belts)))
        for column, belt in enumerate(belts):
            if belt is not None:
                coordinates[column], direction = belt
                towards[:, column] = _foremost(direction)
        return cls(coordinates, towards, any(belts))

    def gaps(self, sides: Vectors) -> Vectors:
        """Return the gap [m] between each part's box and the end of its belt."""
        return np.asarray(self.coordinates - (self.towards * sides).sum(axis=0))


def _foremost(direction: Vector3) -> Vectors:
    """Return the share of each side of a box in the coordinate of its foremost corner in a direction, shape (6,)."""
    along = np.array(direction)
    # upper sides are stored with a minus sign
    return np.concatenate([np.minimum(along, 0.0), -np.maximum(along, 0.0)])


@dataclass(frozen=True, slots=True)
class Movers:
    """Moving bodies, and the boxes that they may come to: rows and columns of the table of gaps.

    Attributes:
        links: number of links of mechanisms, the first rows.
        free: number of links and of parts, the next rows; passengers are the last.
        bodies: bodies of the rows.
        carriers: what carries each row; -1 for nothing.
        local: centres and half extents of their boxes in their own frames [m], both of shape (rows, 3, 1).
        dofs: dofs that move them.
        weights: how far each of these moves any point [m/rad, m/m].
        levers: how far these move a point of each [m/rad, m/m], shape (rows, dofs).
        base: speed of each [m/s] to add to that of its dofs.
        opposite: sides of the columns [m], shape (6, columns): groups, what is behind a belt's end, passengers.
        ends: belts' ends for the passengers that ride one, for the column between groups and passengers.
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
    ends: Ends
    never: Vectors
    watched: Vectors
    kin: dict[int, Kin]
    can_touch: bool

    def watch(self, is_open: Mask) -> None:
        """Leave open groups out of `watched`; `is_open` is for each column of a group."""
        np.copyto(self.watched, self.never)
        self.watched[: self.free, : len(is_open)][:, is_open] = np.inf

    def sides(self, data: mujoco.MjData) -> Vectors:
        """Return the sides of the moving boxes [m], shape (6, rows)."""
        return sides_at(*self.local, data.xpos[self.bodies], data.xmat[self.bodies])

    def speeds(self, velocities: Vectors) -> Vectors:
        """Return the maximum speed of a point of each row [m/s] for joint velocities' magnitudes, shape (dofs,)."""
        return np.asarray(self.levers @ velocities + self.base)

    def times(self, sides: Vectors, velocities: Vectors) -> Vectors:
        """Return the time [s] in which each row could come within the margin of each column, shape (rows, columns).

        Args:
            sides: sides of the rows, as of `sides`.
            velocities: magnitudes of the joint velocities, shape (dofs,).
        """
        first = self.opposite.shape[1] - (len(self.bodies) - self.free)
        self.opposite[:, first:] = facing(sides[:, self.free :])
        found = gaps(sides, self.opposite)
        if self.ends.exist:
            found[self.free :, first - 1] = self.ends.gaps(sides[:, self.free :])
        near = {column: kin.times(found[kin.rows, column], velocities) for column, kin in self.kin.items()}
        # A point of a body moves at most at the sum of lever times joint velocity, levers being upper bounds over all
        # postures. So gap / speed is a lower bound of the time to a touch, whichever way the body moves.
        speeds = self.speeds(velocities)
        found -= MARGIN
        found[:, :first] /= speeds[:, None]
        found[:, first:] /= speeds[:, None] + speeds[self.free :]
        for column, kin in self.kin.items():
            found[kin.rows, column] = near[column]
        return found

    def until_groups(self, times: Vectors, groups: Groups) -> Vectors:
        """Return the time [s] in which anything could reach each group, of the `times` of rows and columns."""
        times = times + self.never
        left = times[: self.free, : len(groups.boxes)].min(axis=0, initial=np.inf)
        return np.asarray(np.minimum.reduceat(left, groups.first_box))


class MovingBodies:
    """Bodies of a model that can move, and those that can carry a part.

    Args:
        model: the engine's model, as compiled.
        belts: direction of travel of each belt, by its body.

    Attributes:
        boxes: the boxes of all bodies.
        parts: the free bodies.
        links: the touchable bodies of each other tree.
    """

    def __init__(self, model: mujoco.MjModel, belts: Mapping[int, Vector3]) -> None:
        self._model = model
        self._ends = {body: (end_of_belt(model, body, direction), direction) for body, direction in belts.items()}
        self.boxes = BodyBoxes(model)
        self._tree = model.body_treeid.astype(np.int64)
        self.parts, self.links = self._find_trees()
        self._levers = {body: self.boxes.levers(body) for body in self.boxes.bodies if self._tree[body] >= 0}
        self._weights = np.max([np.zeros(model.nv), *self._levers.values()], axis=0)
        """Maximum speed of any point for each unit of a joint velocity [m/rad, m/m]."""
        self._dof_tree = model.dof_treeid.astype(np.int64)
        self._turns = model.jnt_type[model.dof_jntid] == mujoco.mjtJoint.mjJNT_HINGE
        self._qpos = model.jnt_qposadr.astype(np.int64)
        self._welds = self._find_welds()

    @property
    def bodies(self) -> Numbers:
        """All touchable bodies that can move."""
        return np.array(list(self._levers), dtype=np.int64)

    def movers(
        self,
        data: mujoco.MjData,
        is_awake: Mask,
        groups: Groups,
        passengers: Mapping[int, int],
        belt_speeds: Mapping[int, float],
    ) -> Movers:
        """Return what moves.

        Args:
            data: the engine's data.
            is_awake: which trees are awake.
            groups: the groups of what sleeps.
            passengers: body and carrier of each passenger.
            belt_speeds: speed of each belt [m/s], by its body.
        """
        links = [body for tree, bodies in self.links.items() if is_awake[tree] for body in bodies]
        loose = self.parts[is_awake[self._tree[self.parts]]].tolist()
        parts = [body for body in loose if body not in passengers]
        bodies = np.array([*links, *parts, *passengers], dtype=np.int64)
        free, count = len(links) + len(parts), len(groups.boxes)
        carriers = [*(-1 for _ in links), *(self.carrier(data, body) for body in parts), *passengers.values()]
        carried_by = np.array(carriers, dtype=np.int64)
        is_gliding = np.isin(carried_by, list(self._ends))
        boxes = self.boxes.at(bodies, np.zeros((len(bodies), 3)), np.zeros((len(bodies), 9)))
        # Beyond a belt's end is a half space. What rides the belt must be open there. It may not be along the axes, so
        # `Ends` has its gaps, and the column has a box that meets everything.
        beyond = Boxes(np.full((6, 1), -FAR), np.array([-1]), np.array([-1]))
        columns = Boxes.joined([groups.boxes, beyond, boxes.some(slice(free, None))])
        never = np.where(boxes.ignore(columns), np.inf, 0.0)
        # Only what rides a belt falls off its end, and it touches the belt all the while: its own contact with the
        # belt is what gliding replaces. Passengers of one carrier keep their places to each other.
        never[~is_gliding, count] = np.inf
        never[:, :count][is_gliding[:, None] & (groups.fixed_body == carried_by[:, None])] = np.inf
        never[:, count + 1 :][carried_by[:, None] == carried_by[free:]] = np.inf
        # Riders need no dofs, as they have exactly their belt's velocity; it is the base of their speed.
        dofs = np.flatnonzero(np.isin(self._dof_tree, self._tree[bodies[~is_gliding]]))
        kin = {}
        for column, (body, carrier) in enumerate(passengers.items(), count + 1):
            # A part on a weld moves with the links of its mechanism. Only the joints between bring them nearer to each
            # other, so a link without a joint between never meets the part.
            if carrier not in self._ends:
                relative = self.relative_levers(data, body, carrier, links)
                related = self._tree[links] == self._tree[carrier]
                moving = relative.any(axis=1)
                never[: len(links), column][related & ~moving] = np.inf
                rows = np.flatnonzero(related & moving)
                if len(rows):
                    kin[column] = Kin(rows, relative[rows][:, dofs])
        levers = np.array([self._levers[body][dofs] for body in bodies.tolist()]).reshape(len(bodies), len(dofs))
        return Movers(
            links=len(links),
            free=free,
            bodies=bodies,
            carriers=carried_by,
            local=self.boxes.local(bodies),
            dofs=dofs,
            weights=self._weights[dofs],
            levers=levers,
            base=np.array([belt_speeds.get(carrier, EXCESS) for carrier in carriers]),
            opposite=facing(columns.sides),
            ends=Ends.of([self._ends.get(carrier) for carrier in passengers.values()]),
            never=never,
            watched=never.copy(),
            kin=kin,
            can_touch=not boxes.some(slice(len(links))).ignore(boxes.some(slice(len(links)))).all(),
        )

    def gap_to_end(self, belt: int, sides: Vectors) -> float:
        """Return the gap [m] between the box of a part, given by its sides of shape (6,), and the end of a belt."""
        end, direction = self._ends[belt]
        return end - float(_foremost(direction) @ sides)

    def update(self, sides: Vectors, movers: Movers, data: mujoco.MjData, bodies: list[int]) -> None:
        """Compute sides of parts from their positions; the engine may not yet update the poses of what was woken."""
        for body in bodies:
            if body in self._welds:
                row = np.flatnonzero(movers.bodies == body)[:1]
                address = int(self._qpos[self._model.body_jntadr[body]])
                pose = data.qpos[address : address + 7]
                sides[:, row] = self.boxes.at(row * 0 + body, pose[None, :3], rotations(pose[None, 3:])).sides

    def carrier(self, data: mujoco.MjData, body: int) -> int:
        """Return the body at the other end of a part's only active weld, -1 if there is no such weld."""
        ends = [other for weld, other in self._welds[body] if data.eq_active[weld]]
        return ends[0] if len(ends) == 1 else -1

    def kin(self, data: mujoco.MjData, movers: Movers, row: int, carrier: int) -> Kin:
        """Return the links of the mechanism that carries a row, and how they move relative to it."""
        links = movers.bodies[: movers.links]
        rows = np.flatnonzero(self._tree[links] == self._tree[carrier])
        relative = self.relative_levers(data, int(movers.bodies[row]), carrier, links[rows].tolist())
        return Kin(rows, relative[:, movers.dofs])

    def relative_levers(self, data: mujoco.MjData, body: int, carrier: int, links: list[int]) -> Vectors:
        """Return how far joints move a welded part relative to links [m/rad, m/m], shape (links, dofs of the model)."""
        # A joint that moves the carrier moves the part as well, and at most by the part's reach beyond the carrier's
        # origin further, if it turns: distance of the origins, which the weld keeps, plus the part's own radius.
        welds = [weld for weld, _ in self._welds[body] if data.eq_active[weld]]
        apart = np.linalg.norm(self._model.eq_data[welds, 3:6], axis=1).max(initial=0.0)
        reach = apart + self.boxes.radius[body]
        own = self._levers.get(carrier)
        if own is None:  # a frame without shapes, such as the tip of a robot's arm
            own = self.boxes.levers(carrier)
        levers = own + reach * (self._turns & (own > 0.0))
        return np.array([np.where(self._levers[link] > 0.0, 0.0, levers) for link in links]).reshape(-1, len(levers))

    def _find_trees(self) -> tuple[Numbers, dict[int, list[int]]]:
        """Return the free bodies, and the touchable bodies of each other tree."""
        model = self._model
        touchable = set(self.boxes.bodies)
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
        model = self._model
        parts = set(self.parts.tolist())
        welds: dict[int, list[tuple[int, int]]] = {body: [] for body in parts}
        for weld in np.flatnonzero(model.eq_type == mujoco.mjtEq.mjEQ_WELD).tolist():
            ends = int(model.eq_obj1id[weld]), int(model.eq_obj2id[weld])
            for body, other in (ends, ends[::-1]):
                if body in parts and other not in parts:
                    welds[body].append((weld, other))
        return welds


def end_of_belt(model: mujoco.MjModel, belt: int, direction: Vector3) -> float:
    """Return the coordinate [m] of the end of a belt, a body with one shape, in its direction of travel."""
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, model.body_quat[belt])
    turned, along = rotation.reshape(3, 3), np.array(direction)
    middle, half = np.split(model.geom_aabb[model.body_geomadr[belt]], 2)
    return float(along @ (model.body_pos[belt] + turned @ middle) + np.abs(along @ turned) @ half)


def are_steady(velocities: Vectors, carried_at: Vector3 | Sequence[Vector3]) -> Mask:
    """Return which parts, with velocities of shape (n, 6), move as a belt at a velocity [m/s], or each as its own."""
    deviation = velocities.copy()
    deviation[:, :3] -= carried_at
    return np.asarray((np.abs(deviation) < _STEADY).all(axis=1))
