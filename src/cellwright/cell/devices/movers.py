"""Table of the moving bodies of a cell and the boxes that they may come to: the times to a touch.

A check computes the whole table, once in some 15 steps. Its arrays have only some hundred elements, so the calls cost
more than the arithmetic. All arrays are therefore made once, with the table, and each check writes into them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np

from cellwright.cell.devices.gliders import Ends
from cellwright.engine.bounding_boxes import Mask, Numbers, Vectors, sums
from cellwright.engine.sleeping_groups import Groups

MARGIN = 0.02
"""Gap [m] below which bodies are taken for touching. Contacts begin at 1 mm; the rest is reserve."""

KIN_MARGIN = 0.005
"""The same [m] for a held part and links of the mechanism that holds it, all of which are known to move."""

EXCESS = 0.2
"""Speed [m/s] that a moving point may gain at least unnoticed after a check."""

KIN_EXCESS = 3 * EXCESS
"""The same for a held part against a link behind it: on a wrist its lever may be three times the cup's."""

_SIGNS = np.array((1.0, -1.0))[:, None, None]
"""Of lower and upper corners in the sides of boxes."""


class Kin(NamedTuple):
    """Links that move relative to a part on a weld, in the same mechanism: the rows, and levers of their motion."""

    rows: Numbers
    levers: Vectors

    def times(self, gap: Vectors, velocities: Vectors) -> Vectors:
        """Return the time [s] in which each link could come within the margin, for gaps [m]."""
        return np.asarray((gap - KIN_MARGIN) / (self.levers @ velocities + KIN_EXCESS))


@dataclass(eq=False)
class Movers:
    """Moving bodies, and the boxes that they may come to: rows and columns of the table of gaps.

    Its arrays change with each `update`, and with each call of `times`.

    Attributes:
        links: number of links of mechanisms, the first rows.
        free: number of links and of parts, the next rows; passengers are the last.
        bodies: bodies of the rows.
        carriers: carrier of each row; -1 for nothing.
        local: centres and half extents of their boxes in their own frames [m], shape (2, rows, 3, 1).
        dofs: dofs that move them.
        weights: distance by which each of these moves any point [m/rad, m/m].
        levers: distance by which these move a point of each [m/rad, m/m], shape (rows, dofs).
        base: speed of each [m/s] to add to that of its dofs.
        opposite: sides of the columns [m], shape (6, columns): groups, what is behind a belt's end, passengers.
        ends: belts' ends for the passengers that ride one, for the column between groups and passengers.
        never: infinite where row and column ignore each other, else 0.
        watched: likewise, and infinite for open groups but in the rows of passengers.
        kin: by column of a passenger, where its mechanism is articulated.
        can_touch: True if links may touch each other.
        sides: sides of the rows [m] at the last `update`, shape (6, rows).
        speeds: maximum speed of a point of each row [m/s] at the last `times`, shape (rows,).
        left: gaps [m] less the margin at the last `times`, shape (rows, columns).
    """

    links: int
    free: int
    bodies: Numbers
    carriers: Numbers
    local: Vectors
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

    def __post_init__(self) -> None:
        to = self._scratch = _Scratch(self.free, self.opposite, len(self.bodies))
        self.sides, self.opposite, self.speeds, self.left = to.sides, to.opposite, to.speeds, to.left
        self._related = [(kin.rows * to.times.shape[1] + column, kin) for column, kin in self.kin.items()]
        """The table's places, counted row by row, of links that move relative to a part that they hold."""

    def watch(self, is_open: Mask) -> None:
        """Leave open groups out of `watched`; `is_open` is for each column of a group."""
        np.copyto(self.watched, self.never)
        self.watched[: self.free, : len(is_open)][:, is_open] = np.inf

    def update(self, data: mujoco.MjData) -> None:
        """Compute the sides of the moving boxes."""
        # the boxes' `sides_at`, bit for bit
        to = self._scratch
        data.xmat.take(self.bodies, axis=0, out=to.rotations, mode="clip")
        data.xpos.take(self.bodies, axis=0, out=to.middle, mode="clip")
        np.abs(to.turns[0], out=to.turns[1])
        np.matmul(to.turns, self.local, out=to.turned)
        np.add(to.middle, to.from_origin, out=to.middle)
        np.multiply(to.across, _SIGNS, out=to.both)
        np.subtract(to.both, to.reach, out=to.corners)

    def times(self, velocities: Vectors) -> Vectors:
        """Return the time [s] in which each row could come within the margin of each column, shape (rows, columns).

        Args:
            velocities: magnitudes of the joint velocities, shape (dofs,).
        """
        to = self._scratch
        # A point of a body moves at most at the sum of lever times joint velocity, levers being upper bounds over all
        # postures. So gap / speed is a lower bound of the time to a touch, whichever way the body moves.
        self.levers.dot(velocities, to.joints)
        np.add(to.joints, self.base, out=to.speeds)
        np.copyto(to.facing, to.carried)
        np.copyto(to.approaching, to.speeds_carried)
        sums(to.rows, to.columns, to.sums)
        np.maximum.reduce(to.all_sums, axis=0, out=to.all_left)
        if self.ends.exist:
            self.ends.gaps(to.sides_carried, to.to_end)
        near = [kin.times(to.all_left.take(places), velocities) for places, kin in self._related]
        np.subtract(to.left, MARGIN, out=to.left)
        np.divide(to.left, to.closing, out=to.times)
        for times, (places, _) in zip(near, self._related, strict=True):
            to.all_times[places] = times
        return to.times

    def until_watched(self, times: Vectors, longest: float) -> float:
        """Return the least of the times [s] to something that is watched, or the longest one."""
        to = self._scratch
        np.add(times, self.watched, out=to.watched)
        return float(np.minimum.reduce(to.all_watched, initial=longest))

    def until_groups(self, times: Vectors, groups: Groups) -> Vectors:
        """Return the time [s] in which anything could reach each group, of the `times` of rows and columns."""
        times = times + self.never
        left = times[: self.free, : len(groups.boxes)].min(axis=0, initial=np.inf)
        return np.asarray(np.minimum.reduceat(left, groups.first_box))


class _Scratch:
    """Arrays that a table's computation writes into, and views of them.

    Args:
        free: the first row of a passenger.
        opposite: sides of the columns [m], shape (6, columns); the last ones are those of the passengers.
        rows: number of rows of the table.
    """

    def __init__(self, free: int, opposite: Vectors, rows: int) -> None:
        columns = opposite.shape[1]
        first = columns - (rows - free)
        self.turns = np.empty((2, rows, 3, 3))
        """Rotations, and the magnitudes of their elements."""
        self.rotations = self.turns[0].reshape(rows, 9)
        self.middle, self.turned, self.both = np.empty((rows, 3)), np.empty((2, rows, 3, 1)), np.empty((2, 3, rows))
        self.from_origin, reach = self.turned[:, :, :, 0]
        self.across, self.reach = self.middle.T, reach.T
        # Their sums are those of sides, whose largest is a gap, and those of speeds.
        self.rows, self.columns = np.ones((7, rows, 2)), np.ones((7, 2, columns))
        self.sums = np.empty((7, rows, columns))
        self.sides, self.opposite = self.rows[:6, :, 0], self.columns[:6, 1]
        self.opposite[:] = opposite
        self.corners, facing = self.sides.reshape(2, 3, rows), self.opposite.reshape(2, 3, columns)[::-1]
        self.sides_carried, self.carried = self.sides[:, free:], self.corners[:, :, free:]
        self.facing = facing[:, :, first:]
        self.joints, self.speeds = np.empty(rows), self.rows[6, :, 0]
        self.columns[6, 1] = 0.0
        self.speeds_carried, self.approaching = self.speeds[free:], self.columns[6, 1, first:]
        self.all_sums, self.closing = self.sums[:6].reshape(6, rows * columns), self.sums[6]
        self.left, self.times, self.watched = np.empty((3, rows, columns))
        self.all_left, self.all_times, self.all_watched = (
            each.reshape(-1) for each in (self.left, self.times, self.watched)
        )
        self.to_end = self.left[free:, first - 1]
