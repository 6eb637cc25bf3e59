"""Boarding: which parts become passengers, of a belt or of a weld."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from cellwright.cell.devices.conveyor import Conveyor
from cellwright.cell.devices.gliders import are_steady
from cellwright.cell.devices.movers import MARGIN, Movers
from cellwright.cell.devices.moving_bodies import MovingBodies
from cellwright.cell.devices.parts import Overlaps
from cellwright.engine.bounding_boxes import Mask, Numbers, facing, gaps
from cellwright.engine.sleeping_groups import Groups

CALM = 0.1
"""A group closes, and a part becomes a passenger, if nothing can reach it within this time [s]."""


class Boarding:
    """Search for parts that something carries and that touch nothing else, nor will for a while.

    Args:
        moving: the bodies that can move.
        belts: the belts, by body.
        overlaps: the overlapping parts, which are never passengers.
        dofs: dofs of each free body, shape (bodies, 6).
        soon: time [s] in which no link of its own mechanism may reach a part on a weld.
    """

    def __init__(
        self, moving: MovingBodies, belts: Mapping[int, Conveyor], overlaps: Overlaps, dofs: Numbers, soon: float
    ) -> None:
        self._moving = moving
        self._belts = belts
        self._overlaps = overlaps
        self._dofs = dofs
        self._soon = soon

    def find(
        self, movers: Movers, groups: Groups, data: mujoco.MjData, last_step: tuple[mujoco.MjModel, mujoco.MjData]
    ) -> list[tuple[int, int]]:
        """Return the bodies of new passengers, each with that of its carrier.

        Args:
            movers: all that moves, with the times of now.
            groups: the groups of what sleeps.
            data: the engine's data.
            last_step: the model and the data that have the contacts of the last step.
        """
        rows = np.arange(movers.links, movers.free)
        if not len(rows):
            return []
        bodies = movers.bodies[rows]
        steady = self._find_steady(data, bodies)
        is_candidate = np.logical_or.reduce([movers.carriers[rows] >= 0, *steady.values()])
        if not is_candidate.any():
            return []
        is_pushed = data.xfrc_applied[bodies].any(axis=1)
        carriers = movers.carriers.copy()
        carriers[rows[is_pushed]] = -1
        model, last = last_step
        touching = model.geom_bodyid[last.contact.geom[: last.ncon]]
        overlapping = self._overlaps.bodies
        for row in rows[is_candidate & ~is_pushed].tolist():
            body, weld = int(movers.bodies[row]), int(carriers[row])
            others = touching[(touching == body).any(axis=1)]
            belts = (belt for belt, mask in steady.items() if mask[row - movers.links] and belt in others)
            carrier = weld if weld >= 0 else next(belts, -1)
            touches_more = bool(((others != body) & (others != carrier)).any()) or body in overlapping
            carriers[row] = -1 if touches_more else carrier
        # Parts on one carrier do not meet; but one that fails is a body as others, which the rest may meet.
        while True:
            found = rows[carriers[rows] >= 0]
            failing = [row for row in found.tolist() if not self._is_calm(movers, row, carriers, groups, data)]
            if not failing:
                return list(zip(movers.bodies[found].tolist(), carriers[found].tolist(), strict=True))
            carriers[failing] = -1

    def _find_steady(self, data: mujoco.MjData, bodies: Numbers) -> dict[int, Mask]:
        """Return which of the bodies move as each belt that runs."""
        velocities = data.qvel.take(self._dofs[bodies])
        return {
            belt: are_steady(velocities, conveyor.velocity)
            for belt, conveyor in self._belts.items()
            if conveyor.speed > 0.0
        }

    def _is_calm(self, movers: Movers, row: int, carriers: Numbers, groups: Groups, data: mujoco.MjData) -> bool:
        """Return whether a part would meet nothing for a while if it and others were passengers of these carriers."""
        carrier, speeds, sides = int(carriers[row]), movers.speeds, movers.sides
        belt = self._belts.get(carrier)
        speed, ahead = speeds[row], movers.left[row, : len(groups.boxes)]
        if belt is not None:
            speed, ahead = belt.speed, ahead[groups.fixed_body != carrier]
            if not (self._moving.ends[carrier].gap(sides[:, row]) - MARGIN) / speed > CALM:
                return False
        if not (ahead / speed > CALM).all():
            return False
        met = gaps(sides[:, row : row + 1], facing(sides))[0]
        met[carriers == carrier] = np.inf
        if belt is None:
            kin = self._moving.kin(data, movers, row, carrier)
            times = kin.times(met[kin.rows], np.abs(data.qvel.take(movers.dofs)))
            if (times[kin.levers.any(axis=1)] < self._soon).any():
                return False
            met[kin.rows] = np.inf
        return bool(((met - MARGIN) / (speed + speeds) > CALM).all())
