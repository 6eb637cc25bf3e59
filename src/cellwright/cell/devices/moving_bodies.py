"""Moving bodies of a cell, what can carry them, and the boxes that they may come to."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import mujoco
import numpy as np

from cellwright.cell.devices.gliders import Ends, end_of_belt
from cellwright.cell.devices.movers import EXCESS, Kin, Movers
from cellwright.engine.bounding_boxes import FAR, BodyBoxes, Boxes, Mask, Numbers, Vectors, facing
from cellwright.engine.sleeping_groups import Groups, rotations
from cellwright.util.pose import Vector3

SHORTEST = 4
"""Number of steps in which nothing that is closed may be reached."""


class MovingBodies:
    """Bodies of a model that can move, and those that can carry a part.

    Args:
        model: the engine's model, as compiled.
        belts: direction of travel of each belt, by its body.

    Attributes:
        boxes: the boxes of all bodies.
        parts: the free bodies.
        links: the touchable bodies of each other tree.
        bodies: all touchable bodies that can move.
        ends: the end of each belt, by its body.
    """

    def __init__(self, model: mujoco.MjModel, belts: Mapping[int, Vector3]) -> None:
        self._model = model
        self.ends = {body: end_of_belt(model, body, direction) for body, direction in belts.items()}
        self.boxes = BodyBoxes(model)
        self._tree = model.body_treeid.astype(np.int64)
        self.parts, self.links = self._find_trees()
        self._levers = {body: self.boxes.levers(body) for body in self.boxes.bodies if self._tree[body] >= 0}
        self.bodies = np.array(list(self._levers), dtype=np.int64)
        self._weights = np.max([np.zeros(model.nv), *self._levers.values()], axis=0)
        """Maximum speed of any point for each unit of a joint velocity [m/rad, m/m]."""
        self._dof_tree = model.dof_treeid.astype(np.int64)
        self._turns = model.jnt_type[model.dof_jntid] == mujoco.mjtJoint.mjJNT_HINGE
        self._qpos = model.jnt_qposadr.astype(np.int64)
        self._welds = self._find_welds()

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
            is_awake: True for each tree that is awake.
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
        is_gliding = np.array([carrier in self.ends for carrier in carriers], dtype=np.bool_)
        boxes = self.boxes.anywhere(bodies)
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
        has_dofs = np.zeros(self._model.ntree, dtype=np.bool_)
        has_dofs[self._tree[bodies[~is_gliding]]] = True
        dofs = np.flatnonzero(has_dofs[self._dof_tree])
        kin = {}
        for column, (body, carrier) in enumerate(passengers.items(), count + 1):
            # A part on a weld moves with the links of its mechanism. Only the joints between bring them nearer to each
            # other, so a link without a joint between never meets the part.
            if carrier not in self.ends:
                relative = self.relative_levers(data, body, carrier, links)
                related = self._tree[links] == self._tree[carrier]
                moving = relative.any(axis=1)
                never[: len(links), column][related & ~moving] = np.inf
                rows = np.flatnonzero(related & moving)
                if len(rows):
                    kin[column] = Kin(rows, relative[rows][:, dofs])
        levers = np.array([self._levers[body].take(dofs) for body in bodies.tolist()]).reshape(len(bodies), len(dofs))
        return Movers(
            links=len(links),
            free=free,
            bodies=bodies,
            carriers=carried_by,
            local=np.array(self.boxes.local(bodies)),
            dofs=dofs,
            weights=self._weights[dofs],
            levers=levers,
            base=np.array([belt_speeds.get(carrier, EXCESS) for carrier in carriers]),
            opposite=facing(columns.sides),
            ends=Ends.of([self.ends.get(carrier) for carrier in passengers.values()]),
            never=never,
            watched=never.copy(),
            kin=kin,
            can_touch=not boxes.some(slice(len(links))).ignore(boxes.some(slice(len(links)))).all(),
        )

    def place(self, movers: Movers, data: mujoco.MjData, bodies: Iterable[int]) -> None:
        """Compute sides of parts from their positions; the engine may not yet update the poses of what was woken."""
        for body in bodies:
            if body in self._welds:
                row = np.flatnonzero(movers.bodies == body)[:1]
                address = int(self._qpos[self._model.body_jntadr[body]])
                pose = data.qpos[address : address + 7]
                movers.sides[:, row] = self.boxes.at(row * 0 + body, pose[None, :3], rotations(pose[None, 3:])).sides

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
