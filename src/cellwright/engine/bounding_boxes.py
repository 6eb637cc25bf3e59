"""Bounding boxes of the bodies of a model, gaps between them, and how fast the joints can move their points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

Vectors: TypeAlias = NDArray[np.float64]
Numbers: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]

FAR = 1e4
"""Half the extent [m] of the box of a half-space."""

_LEVEL = 1 - 1e-12
"""A plane is level if the vertical component of its normal is above this."""


@dataclass(frozen=True, slots=True)
class Boxes:
    """Boxes along the axes of the world, and the contact classes of their content.

    Attributes:
        sides: lower corners and the negative of the upper corners [m], shape (6, n).
        contype: the engine's bits of the classes, shape (n,).
        conaffinity: the bits of the classes that they may touch, shape (n,).
    """

    sides: Vectors
    contype: Numbers
    conaffinity: Numbers

    def __len__(self) -> int:
        return len(self.contype)

    @classmethod
    def joined(cls, boxes: Sequence[Boxes]) -> Boxes:
        """Return the boxes of several objects in one, in their order."""
        return cls(
            np.concatenate([each.sides for each in boxes], axis=1),
            np.concatenate([each.contype for each in boxes]),
            np.concatenate([each.conaffinity for each in boxes]),
        )

    def some(self, chosen: Numbers | Mask | slice) -> Boxes:
        """Return some of the boxes."""
        return Boxes(self.sides[:, chosen], self.contype[chosen], self.conaffinity[chosen])

    def around(self, first: Numbers | Sequence[int] = (0,)) -> Boxes:
        """Return a box around each run of boxes; `first` are the indices at which the runs begin."""
        if not len(self):
            return self
        bits = (np.bitwise_or.reduceat(each, first) for each in (self.contype, self.conaffinity))
        return Boxes(np.minimum.reduceat(self.sides, first, axis=1), *bits)

    def extents(self) -> Vectors:
        """Return the lengths of the boxes along the axes [m], shape (3, n)."""
        return np.asarray(-self.sides[3:] - self.sides[:3])

    def gaps(self, others: Boxes) -> Vectors:
        """Return the gap [m] between each of these and each of the others, shape (n, m); negative if they overlap.

        It is the largest gap along an axis, so the distance is at least as long.
        """
        return gaps(self.sides, facing(others.sides))

    def ignore(self, others: Boxes) -> Mask:
        """Return which of these can never touch which of the others, by their classes; shape (n, m)."""
        touching = self.contype[:, None] & others.conaffinity
        touching |= self.conaffinity[:, None] & others.contype
        return np.asarray(touching == 0)


def facing(sides: Vectors) -> Vectors:
    """Return the sides of boxes, shape (6, n), in the order in which others face them."""
    return np.concatenate([sides[3:], sides[:3]])


def gaps(sides: Vectors, opposite: Vectors) -> Vectors:
    """Return the gaps [m] between boxes, shape (6, n), and others, shape (6, m) and `facing` them; shape (n, m)."""
    # Upper corners are stored with a minus sign, and `opposite` has lower and upper exchanged. So along each axis both
    # sums are gaps, this box behind the other one and before it: the largest of all counts.
    rows, columns = np.ones((6, sides.shape[1], 2)), np.ones((6, 2, opposite.shape[1]))
    rows[:, :, 0], columns[:, 1] = sides, opposite
    return np.asarray(np.maximum.reduce(sums(rows, columns), axis=0))


def sums(rows: Vectors, columns: Vectors, out: Vectors | None = None) -> Vectors:
    """Return all sums of two numbers.

    They are a product of matrices, row * 1 + 1 * column. Both of its products are exact, so each sum is rounded once,
    as by an addition. Numpy takes half as long for it as for adding rows to columns.

    Args:
        rows: one number of each sum, and 1, shape (..., n, 2).
        columns: 1, and the other number, shape (..., 2, m).
        out: array of the sums, shape (..., n, m).
    """
    return np.asarray(np.matmul(rows, columns, out=out))


class BodyBoxes:
    """Boxes around the touchable shapes of the bodies of a model.

    Args:
        model: the engine's model, with the contact classes of its bodies as compiled.

    Attributes:
        radius: distance [m] of the farthest point of each body from its origin, shape (bodies,).
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._contype = model.body_contype.astype(np.int64)
        self._conaffinity = model.body_conaffinity.astype(np.int64)
        self._centre = np.zeros((model.nbody, 3))
        self._half = np.zeros((model.nbody, 3))
        self.radius = np.zeros(model.nbody)
        self._shapes: dict[int, list[int]] = {}
        for geom in np.flatnonzero(model.geom_contype | model.geom_conaffinity).tolist():
            self._shapes.setdefault(int(model.geom_bodyid[geom]), []).append(geom)
        for body, geoms in self._shapes.items():
            corners = np.concatenate([self._corners(geom) for geom in geoms])
            lower, upper = corners.min(axis=0), corners.max(axis=0)
            self._centre[body], self._half[body] = (lower + upper) / 2, (upper - lower) / 2
            self.radius[body] = np.linalg.norm(corners, axis=1).max()

    @property
    def bodies(self) -> list[int]:
        """Bodies with a touchable shape."""
        return sorted(self._shapes)

    def at(self, bodies: Numbers, positions: Vectors, rotations: Vectors) -> Boxes:
        """Return the boxes of bodies at positions [m], shape (n, 3), with world_R_body as matrices, shape (n, 9)."""
        sides = sides_at(*self.local(bodies), positions, rotations)
        return Boxes(sides, self._contype[bodies], self._conaffinity[bodies])

    def anywhere(self, bodies: Numbers) -> Boxes:
        """Return boxes of bodies whose places are yet unknown, with all sides at 0."""
        return Boxes(np.zeros((6, len(bodies))), self._contype[bodies], self._conaffinity[bodies])

    def local(self, bodies: Numbers) -> tuple[Vectors, Vectors]:
        """Return centres and half extents of bodies' boxes in their own frames [m], both of shape (n, 3, 1)."""
        return self._centre[bodies, :, None], self._half[bodies, :, None]

    def fixed(self, compact: float) -> dict[int, Boxes]:
        """Return the boxes of each fixed body: one, or one of each shape if it is larger than `compact` [m]."""
        model, data = self._model, mujoco.MjData(self._model)
        mujoco.mj_kinematics(model, data)
        fixed = {}
        for body in self.bodies:
            if model.body_treeid[body] < 0:
                boxes = Boxes.joined([self._shape(data, geom) for geom in self._shapes[body]])
                whole = boxes.around()
                fixed[body] = whole if (whole.extents() <= compact).all() else boxes
        return fixed

    def _shape(self, data: mujoco.MjData, geom: int) -> Boxes:
        """Return the box of a shape; that of a level plane holds everything below it, that of another everything."""
        model = self._model
        rotation = data.geom_xmat[geom].reshape(3, 3)
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
            half: Vectors = np.full(3, FAR)
            centre = np.array((0.0, 0.0, data.geom_xpos[geom][2] - FAR if rotation[2, 2] > _LEVEL else 0.0))
        else:
            centre = data.geom_xpos[geom] + rotation @ model.geom_aabb[geom, :3]
            half = np.abs(rotation) @ model.geom_aabb[geom, 3:]
        bits = (np.array([int(each[geom])]) for each in (model.geom_contype, model.geom_conaffinity))
        return Boxes(np.concatenate([centre - half, -centre - half])[:, None], *bits)

    def levers(self, body: int) -> Vectors:
        """Return how far the joints move points of a body at most, in any posture [m/rad, m/m], shape (dofs,).

        The joint velocities' magnitudes times these are a bound of the speed of every point of the body.
        """
        model = self._model
        levers = np.zeros(model.nv)
        reach = float(self.radius[body])
        # Up the chain to the world: `reach` bounds the distance of the points from the origin of each body in turn.
        # A hinge moves a point by angle times distance from its axis. A slide moves it by its own way, and may have
        # carried it so much further from the hinges before it.
        while body:
            for joint in range(int(model.body_jntadr[body]), int(model.body_jntadr[body] + model.body_jntnum[body])):
                first = int(model.jnt_dofadr[joint])
                arm = reach + float(np.linalg.norm(model.jnt_pos[joint]))
                match model.jnt_type[joint]:
                    case mujoco.mjtJoint.mjJNT_FREE:
                        levers[first : first + 6] = 1.0, 1.0, 1.0, arm, arm, arm
                    case mujoco.mjtJoint.mjJNT_BALL:
                        levers[first : first + 3] = arm
                    case mujoco.mjtJoint.mjJNT_HINGE:
                        levers[first] = arm
                    case _:
                        levers[first] = 1.0
                        reach += float(np.abs(model.jnt_range[joint]).max()) if model.jnt_limited[joint] else 0.0
            reach += float(np.linalg.norm(model.body_pos[body]))
            body = int(model.body_parentid[body])
        return levers

    def _corners(self, geom: int) -> Vectors:
        """Return the corners [m] of a shape's box in the frame of its body, shape (8, 3)."""
        model = self._model
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
        signs = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
        box = model.geom_aabb[geom, :3] + signs * model.geom_aabb[geom, 3:]
        return np.asarray(box @ rotation.reshape(3, 3).T + model.geom_pos[geom])


def sides_at(centre: Vectors, half: Vectors, positions: Vectors, rotations: Vectors) -> Vectors:
    """Return the sides, shape (6, n), of boxes given in the frames of bodies at some poses; see `BodyBoxes`."""
    rotation = rotations.reshape(-1, 3, 3)
    middle = positions + (rotation @ centre)[:, :, 0]
    # The corner that lies furthest along an axis has the sum of the half edges, each by its share along that axis.
    reach = (np.abs(rotation) @ half)[:, :, 0]
    return np.concatenate([(middle - reach).T, (-middle - reach).T])
