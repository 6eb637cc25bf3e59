"""Groups of fixed and sleeping bodies that may touch: what wakes together is in one group."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import mujoco
import numpy as np

from cellwright.engine.bounding_boxes import BodyBoxes, Boxes, Mask, Numbers, Vectors

LINKED = 0.01
"""Maximum gap [m] between bounding boxes of sleeping bodies that may touch; the engine's contacts begin at 1 mm."""

COMPACT = 1.0
"""A larger fixed body [m] has a box for each of its shapes: that around a portal would mostly be empty."""


class Groups(NamedTuple):
    """Groups of bodies.

    Attributes:
        bodies: bodies of all groups, group by group.
        first: index of each group's first body.
        of_body: group of each body of the model, -1 for none.
        boxes: boxes of all groups, group by group.
        first_box: index of each group's first box.
        of_box: group of each box.
        fixed_body: the fixed body that a box belongs to, -1 for other boxes.
    """

    bodies: Numbers
    first: Numbers
    of_body: Numbers
    boxes: Boxes
    first_box: Numbers
    of_box: Numbers
    fixed_body: Numbers

    def members(self, group: int) -> Numbers:
        """Return the bodies of a group."""
        end = int(self.first[group + 1]) if group + 1 < len(self.first) else None
        return self.bodies[int(self.first[group]) : end]


class SleepingGroups:
    """Groups of a model in which parts and mechanisms fall asleep and wake.

    Args:
        model: the engine's model.
        boxes: boxes of its bodies.
        parts: free bodies.
        mechanisms: touchable bodies of the other trees, by tree.

    Attributes:
        fixed: boxes of the fixed bodies, which never move.
    """

    def __init__(
        self, model: mujoco.MjModel, boxes: BodyBoxes, parts: Numbers, mechanisms: Mapping[int, list[int]]
    ) -> None:
        self._boxes = boxes
        self._parts, self._mechanisms = parts, mechanisms
        self._tree = model.body_treeid[parts].astype(np.int64)
        self._qpos = model.jnt_qposadr[model.body_jntadr[parts]].astype(np.int64)[:, None] + np.arange(7)
        self._count = int(model.nbody)
        self.fixed = boxes.fixed(COMPACT)
        self._fixed = Boxes.joined(list(self.fixed.values()))
        self._fixed_body = np.repeat(list(self.fixed), [len(each) for each in self.fixed.values()])
        self.forget()

    def forget(self) -> None:
        """Forget who sleeps, and where."""
        self._known: tuple[bytes, Groups] | None = None
        self._resting = self._boxes.anywhere(self._parts)
        self._is_resting = np.zeros(len(self._parts), dtype=np.bool_)
        self._linked = np.zeros((0, 2), dtype=np.int64)
        """Pairs of resting parts that may touch."""

    def find(self, data: mujoco.MjData, is_awake: Mask) -> Groups:
        """Return the groups of all that sleeps; they change only with it.

        Args:
            data: the engine's data, with the poses of sleeping bodies.
            is_awake: True for each tree that is awake.
        """
        key = is_awake.tobytes()
        if self._known is None or self._known[0] != key:
            self._known = key, self._find(data, is_awake)
        return self._known[1]

    def _find(self, data: mujoco.MjData, is_awake: Mask) -> Groups:
        mechanisms = [bodies for tree, bodies in self._mechanisms.items() if bodies and not is_awake[tree]]
        links = np.array([body for bodies in mechanisms for body in bodies], dtype=np.int64)
        standing = Boxes.joined([self._fixed, self._boxes.at(links, data.xpos[links], data.xmat[links])])
        owners = np.concatenate([self._fixed_body, links])
        self._note_resting(data, ~is_awake[self._tree])
        resting = np.flatnonzero(self._is_resting)
        parts, boxes = self._parts[resting], self._resting.some(resting)
        part, box = np.nonzero(boxes.gaps(standing) <= LINKED)
        # What may touch wakes together: parts and what they lie on, parts and parts, the links of a mechanism.
        # Groups are the connected components of these pairs, each named after its least body.
        pairs = [
            np.column_stack([parts[part], owners[box]]),
            self._parts[self._linked],
            *(np.column_stack([np.full(len(bodies), bodies[0]), bodies]) for bodies in mechanisms),
        ]
        least = least_linked(self._count, np.concatenate(pairs))
        bodies = np.concatenate([np.unique(owners), parts])
        bodies = bodies[np.argsort(least[bodies], kind="stable")]
        names, first = np.unique(least[bodies], return_index=True)
        of_body = np.full(self._count, -1)
        of_body[bodies] = np.searchsorted(names, least[bodies])
        order = np.argsort(of_body[parts], kind="stable")
        # The parts of a group share one box, as they are many and close together. Fixed bodies keep their own.
        with_parts, starts = np.unique(of_body[parts][order], return_index=True)
        every = Boxes.joined([standing, boxes.some(order).around(starts)])
        of_box = np.concatenate([of_body[owners], with_parts])
        fixed_body = np.concatenate([self._fixed_body, np.full(len(links) + len(with_parts), -1)])
        order = np.argsort(of_box, kind="stable")
        first_box = np.searchsorted(of_box[order], np.arange(len(names)))
        return Groups(bodies, first, of_body, every.some(order), first_box, of_box[order], fixed_body[order])

    def _note_resting(self, data: mujoco.MjData, is_resting: Mask) -> None:
        """Note which parts sleep, where, and which of them may touch."""
        self._linked = self._linked[is_resting[self._linked].all(axis=1)]
        new = np.flatnonzero(is_resting & ~self._is_resting)
        self._is_resting = is_resting
        poses = data.qpos[self._qpos[new]]
        boxes = self._boxes.at(self._parts[new], poses[:, :3], rotations(poses[:, 3:]))
        self._resting.sides[:, new] = boxes.sides
        asleep = np.flatnonzero(is_resting)
        row, column = np.nonzero(boxes.gaps(self._resting.some(asleep)) <= LINKED)
        pairs = np.column_stack([new[row], asleep[column]])
        self._linked = np.concatenate([self._linked, pairs[pairs[:, 0] != pairs[:, 1]]])


def least_linked(count: int, pairs: Numbers) -> Numbers:
    """Return for each of `count` numbers the least one that it is linked to, directly or not; shape (count,).

    Args:
        count: the numbers are 0 to count - 1.
        pairs: linked numbers, shape (n, 2).

    Example:
        >>> least_linked(5, np.array([[3, 1], [4, 3]])).tolist()
        [0, 1, 2, 1, 1]
    """
    least = np.arange(count)
    while True:
        # Each round takes the lower number over every link, and then that of the number found. So rounds grow with the
        # logarithm of the longest chain, not with its length.
        lower = least[pairs].min(axis=1)
        if (least[pairs] == lower[:, None]).all():
            return least
        np.minimum.at(least, pairs[:, 0], lower)
        np.minimum.at(least, pairs[:, 1], lower)
        least = least[least]


def rotations(quaternions: Vectors) -> Vectors:
    """Return the matrices, shape (n, 9), of quaternions (w, x, y, z), shape (n, 4)."""
    w, x, y, z = (quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)).T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.array([each for row in rows for each in row]).T
