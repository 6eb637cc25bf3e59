"""Hands of a robot that hold parts by welds."""

from __future__ import annotations

from collections.abc import Callable

import mujoco

from cellwright.cell.devices.parts import MAX_PART_SIZE, Parts
from cellwright.cell.model.build import WorldPart
from cellwright.config.layout.robots import Hand
from cellwright.engine.device import Device
from cellwright.engine.simulation import Simulation
from cellwright.mechanism.welds import engage_weld
from cellwright.util.pose import Pose

CLOSED = 0.5
"""Status of a hand, from 0 (open) to 1 (closed), at which it begins to hold."""


class HoldingHand(Device):
    """Hand of a robot: the nearest part within its reach is held when the hand closes, until it opens.

    It closes when its targets are half closed. A part that is already held or locked by something else is left alone.

    Args:
        parts: the parts of the cell.
        hand: the hand.
        status: returns how far its targets are closed, from 0 to 1.
    """

    STATE = ("part", "is_closed")

    def __init__(self, parts: Parts, hand: Hand, status: Callable[[], float]) -> None:
        super().__init__(f"hand {hand.name}")
        self._parts, self._hand, self._status = parts, hand, status
        self.part: str | None = None
        """Name of the part that it holds."""
        self.is_closed = False
        parts.on_taken.append(self._notice_taken)

    def attach(self, simulation: Simulation) -> None:
        """Look up the grasp point."""
        super().attach(simulation)
        self._geom = int(simulation.model.geom(self._hand.name).id)
        self._body = int(simulation.model.geom_bodyid[self._geom])

    def reset(self) -> None:
        """Hold nothing; a hand that begins closed holds nothing until it has opened."""
        self.part, self.is_closed = None, self._status() >= CLOSED

    def after_step(self) -> None:
        """Hold or release, if the hand has closed or opened."""
        is_closed = self._status() >= CLOSED
        if is_closed is self.is_closed:
            return
        self.is_closed = is_closed
        if is_closed:
            self._hold()
        elif self.part is not None:
            self._release(self._parts.part(self.part))

    def _hold(self) -> None:
        simulation = self.simulation
        simulation.refresh()
        model, data = simulation.model, simulation.data
        centre, reach = data.xpos[self._body], self._hand.reach
        nearest: tuple[float, WorldPart] | None = None
        for part in self._parts.inside(centre - MAX_PART_SIZE, centre + MAX_PART_SIZE):
            if self._is_taken(part):
                continue
            distance = min(
                mujoco.mj_geomDistance(model, data, self._geom, geom, 2 * reach, None) for geom in part.geoms
            )
            if distance <= reach and (nearest is None or distance < nearest[0]):
                nearest = distance, part
        if nearest is not None:
            part = nearest[1]
            self.part = part.name
            hand = Pose(tuple(centre.tolist()), tuple(data.xquat[self._body].tolist()))
            engage_weld(simulation, part.grips[self._hand.name], self._body, hand.inverse() @ self._parts.pose(part))

    def _is_taken(self, part: WorldPart) -> bool:
        data = self.simulation.data
        return self._parts.is_locked(part) or any(data.eq_active[weld] for weld in part.grips.values())

    def _release(self, part: WorldPart) -> None:
        self.part = None
        self.simulation.data.eq_active[part.grips[self._hand.name]] = 0
        self.simulation.keep_awake(part.body)

    def _notice_taken(self, part: WorldPart) -> None:
        """Note that a part is no longer in the hand, if it was."""
        if part.name == self.part:
            self.part = None
