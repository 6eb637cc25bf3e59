"""Reach of arms over the surfaces of a cell, with their tools pointing down, by their solvers.

Any yaw of the tool will do. So if the first turning joint of an arm turns about the vertical, only the height of a
point counts and its distance from that axis: the postures of one point are those of all others as far away, turned.
A joint at the end that turns the tool about its own axis makes one yaw stand for all. Postures are therefore solved
once for each height and each 5 mm of distance. An arm of another form is solved point by point, yaw by yaw.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from heapq import merge

import numpy as np
from numpy.typing import NDArray

from cellwright.cell.checks.surfaces import points_on
from cellwright.config.layout.surfaces import Surface
from cellwright.config.trial.trial import Trial
from cellwright.mechanism.mounted_arm import MountedArm, mounted_arm
from cellwright.mechanism.solvers import solver_of
from cellwright.motion.chain import Chain
from cellwright.motion.solver import TURN_WEIGHT, Vector
from cellwright.motion.turns import nearest_turn
from cellwright.util.pose import Pose

CLEARANCE = 0.02
"""Height of the tool over a surface [m]."""

YAW_STEP = math.pi / 4
"""Angle between the yaws of the tool that are tried [rad]."""

_DISTANCE, _HEIGHT = 0.005, 0.001
"""Steps [m] to which distances from the pan axis, and heights, are rounded."""
_VERTICAL, _ON_AXIS = 1e-5, 1e-5
"""Largest deviation of an axis from the vertical or the tool's [rad], and of the tool from the axis [m]."""
_TURN = 2 * math.pi

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Key = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Posture:
    """Posture of an arm at a point: the position of its mount [m], and its joints' from the base on [rad; m]."""

    position: float
    q: Vector


class Reach:
    """Reach of one arm with its tool pointing down.

    Example:
        >>> import cellwright
        >>> reach = Reach(mounted_arm(cellwright.load_trial("lesson").arms[0], {}))
        >>> reach.mask(np.array([(-0.3, 0.2, 0.73), (-3.0, 0.2, 0.73)])).tolist()
        [True, False]
    """

    def __init__(self, arm: MountedArm) -> None:
        self.arm = arm
        joints = arm.chain.joints
        base = next(iter(arm.mount.places(Pose(), arm.position))).world_T_base
        self._base = Pose(quaternion=base.quaternion)
        up = [self._base.rotate(joint.axis)[2] for joint in joints]
        first = next((number for number, joint in enumerate(joints) if not joint.is_prismatic), len(joints))
        is_vertical = first < len(joints) and all(abs(each) > math.cos(_VERTICAL) for each in up[: first + 1])
        self._pan = first if is_vertical else None
        self._root = np.array(self._base.transform(joints[0].point))
        self._sense = math.copysign(1.0, up[first]) if is_vertical else 0.0
        self._axis = np.array(self._base.transform(joints[first].point)) if is_vertical else np.zeros(3)
        last, tool = joints[-1], arm.chain.base_T_tool
        x, y, _ = tool.inverse().transform(last.point)
        is_along = abs(np.dot(last.axis, tool.rotate((0.0, 0.0, 1.0)))) > math.cos(_VERTICAL)
        self.turns_tool = not last.is_prismatic and bool(is_along) and math.hypot(x, y) < _ON_AXIS
        """True if the last joint turns the tool about its own axis alone."""
        self._free = self._free_chain()
        self._solver = solver_of(self._free, arm.home)
        self._families: dict[Key, _Family] = {}
        self._ranks: dict[Key, list[tuple[float, Vector]]] = {}

    @property
    def is_quick(self) -> bool:
        """True if postures of one point stand for others: without that, a place takes seconds to minutes."""
        return self._pan is not None

    def mask(self, points: Array) -> Mask:
        """Return which points the tool reaches; the last axis is x, y, z in the world [m]."""
        flat = points.reshape(-1, 3)
        reached: Mask = np.zeros(len(flat), dtype=np.bool_)
        for _, base in self._places(flat) if len(flat) else ():
            near = np.linalg.norm(flat - base - self._root, axis=1) <= self.arm.chain.reach
            left = np.flatnonzero(near & ~reached)
            reached[left] = self._fitting(flat[left] - base)
        return reached.reshape(points.shape[:-1])

    def postures(self, point: Array) -> Iterator[Posture]:
        """Yield the postures that bring the tool to a point of the world [m], that with the best mobility first."""
        places = [*self._places(point[None])]
        keys, turns = self._keys(point - np.array([base for _, base in places]))

        def at(position: float, key: Key, turn: float) -> Iterator[tuple[float, float, Vector, float]]:
            return ((mobility, position, q, turn) for mobility, q in self._ranked(key))

        rows = zip(places, keys.tolist(), turns.tolist(), strict=True)
        found = (at(position, tuple(key), turn) for (position, _), key, turn in rows)
        for _, position, q, turn in merge(*found, key=lambda each: each[0], reverse=True):
            turned = self._turned(q, turn)
            if turned is not None:
                yield Posture(position, turned)

    def yaws(self, posture: Posture) -> Iterator[Posture]:
        """Yield a posture with other yaws of the tool, by its last joint alone."""
        last = self.arm.chain.joints[-1]
        for step in (1, -1, 2, -2, 3, -3, 4):
            angle = _within(posture.q[-1] + step * YAW_STEP, last.lower, last.upper)
            if self.turns_tool and angle is not None:
                yield replace(posture, q=(*posture.q[:-1], angle))

    def _places(self, points: Array) -> Iterator[tuple[float, Array]]:
        """Yield positions of the mount with the place of the base, for points that are near each other."""
        x, y, z = points.mean(axis=0).tolist()
        middle = Pose((x, y, z))
        for position, world_T_base in self.arm.mount.places(middle, self.arm.position):
            yield position, np.array(world_T_base.position)

    def _fitting(self, offsets: Array) -> Mask:
        """Return which points, from the base on along the world's axes, are reached from there."""
        keys, turns = self._keys(offsets)
        mask: Mask = np.zeros(len(offsets), dtype=np.bool_)
        if not len(keys):
            return mask
        unique, which = np.unique(keys, axis=0, return_inverse=True)
        which = which.ravel()
        groups = np.split(np.argsort(which, kind="stable"), np.cumsum(np.bincount(which))[:-1])
        for key, left in zip(unique.tolist(), groups, strict=True):
            for q in self._family(tuple(key)):
                fits = self._pan_fits(q, turns[left])
                mask[left[fits]] = True
                left = left[~fits]
                if not left.size:
                    break
        return mask

    def _keys(self, offsets: Array) -> tuple[Array, Array]:
        """Return what tells points apart for the solver, and their directions about the pan axis [rad]."""
        if self._pan is None:
            return offsets, np.zeros(len(offsets))
        x, y, z = (offsets - self._axis).T
        distances = np.round(np.hypot(x, y) / _DISTANCE) * _DISTANCE
        return np.stack([distances, np.round(z / _HEIGHT) * _HEIGHT], axis=1), np.arctan2(y, x)

    def _family(self, key: Key) -> _Family:
        found = self._families.get(key)
        if found is None:
            found = self._families[key] = _Family(self._solved(key))
        return found

    def _solved(self, key: Key) -> Iterator[Vector]:
        """Yield the postures at a key, in direction 0."""
        x, y, z = key if self._pan is None else (self._axis + np.array((key[0], 0.0, key[1]))).tolist()
        for yaw in (0.0,) if self.turns_tool else np.arange(0.0, _TURN - 1e-9, YAW_STEP).tolist():
            tool = Pose.from_rpy((x, y, z + CLEARANCE), (math.pi, 0.0, yaw))
            yield from self._solver.branches(self._base.inverse() @ tool, self.arm.home)

    def _ranked(self, key: Key) -> list[tuple[float, Vector]]:
        """Return all postures at a key with their mobility, the best first.

        It is the smaller margin [m], which the joints that stand for a whole turn do not change.
        """
        if key not in self._ranks:
            margins = ((self._free.margin(q), q) for q in self._family(key))
            found = [(min(singular, TURN_WEIGHT * limit), q) for (singular, limit), q in margins]
            self._ranks[key] = sorted(found, key=lambda each: each[0], reverse=True)
        return self._ranks[key]

    def _pan_fits(self, q: Vector, turns: Array) -> Mask:
        if self._pan is None:
            return np.ones(len(turns), dtype=np.bool_)
        joint = self.arm.chain.joints[self._pan]
        if joint.upper - joint.lower >= _TURN:
            return np.ones(len(turns), dtype=np.bool_)
        return np.asarray((q[self._pan] + self._sense * turns - joint.lower) % _TURN <= joint.upper - joint.lower)

    def _turned(self, q: Vector, turn: float) -> Vector | None:
        """Return a posture turned about the pan axis, with the last joint at home; None if that is beyond a limit."""
        turned = list(q)
        if self._pan is not None:
            joint = self.arm.chain.joints[self._pan]
            angle = _within(q[self._pan] + self._sense * turn, joint.lower, joint.upper)
            if angle is None:
                return None
            turned[self._pan] = angle
        if self.turns_tool:
            turned[-1] = self.arm.home[-1]
        return tuple(turned)

    def _free_chain(self) -> Chain:
        """Return the chain without limits of the joints that stand for a whole turn."""
        free = {self._pan, len(self.arm.chain.joints) - 1 if self.turns_tool else None}
        joints = tuple(
            replace(joint, lower=-math.inf, upper=math.inf) if number in free else joint
            for number, joint in enumerate(self.arm.chain.joints)
        )
        return replace(self.arm.chain, joints=joints)


class _Family:
    """Postures of a solver, which are computed when they are asked for, and once."""

    def __init__(self, source: Iterator[Vector]) -> None:
        self._source = source
        self._known: list[Vector] = []

    def __iter__(self) -> Iterator[Vector]:
        yield from self._known
        for q in self._source:
            self._known.append(q)
            yield q


def reaches(trial: Trial) -> tuple[Reach, ...]:
    """Return the reach of each arm of a trial."""
    return tuple(Reach(mounted_arm(arm, trial.arm_models)) for arm in trial.arms)


def in_reach(surface: Surface, arms: Sequence[Reach]) -> Mask:
    """Return the mask of a surface's points that the tool of some arm reaches, from some place of its mount."""
    points = points_on(surface)
    reached: Mask = np.zeros(points.shape[:2], dtype=np.bool_)
    for arm in arms:
        left = ~reached
        reached[left] = arm.mask(points[left])
    return reached


def share_out_of_reach(surface: Surface, arms: Sequence[Reach]) -> float:
    """Return the share of a surface that no tool reaches; of a belt, that of its width.

    Parts ride along a belt, so a strip of its width counts as reached if a tool reaches it anywhere.
    """
    reached = in_reach(surface, arms)
    if surface.is_belt:
        reached = np.asarray(reached.any(axis=0))
    return 1.0 - float(np.mean(reached))


def _within(angle: float, lower: float, upper: float) -> float | None:
    """Return an angle, by whole turns, nearest to the middle of its limits [rad]; None if none is within them."""
    middle = (lower + upper) / 2
    return nearest_turn(angle, middle if math.isfinite(middle) else 0.0, lower, upper)
