"""The parts on the floor: where each one is, and how one appears, is dropped elsewhere or goes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cellwright.cell.model.build import WorldPart
from cellwright.engine.device import Device, State
from cellwright.engine.simulation import Simulation
from cellwright.util.errors import UnknownNameError
from cellwright.util.pose import Pose

Removal: TypeAlias = Literal["deletion wall", "delivery", "clearing"]
"""What takes a part out of the cell: the end of the belt, an AGV that arrives with it, or a hand that clears a tray."""


class Parts(Device):
    """Every part of the cell, also those that wait in a pool or have gone.

    A part is `in_play` from the moment it appears until it is put away; the others stand on their shelf slots.
    """

    def __init__(self, parts: Sequence[WorldPart]) -> None:
        super().__init__("parts")
        self.all = tuple(parts)
        self.by_name: Mapping[str, WorldPart] = {part.name: part for part in parts}
        self.by_body: Mapping[int, WorldPart] = {part.body: part for part in parts}
        self.in_play: set[str] = set()
        self.on_taken: list[Callable[[WorldPart], None]] = []
        """Those who are told when a part was taken out of the cup, if it was in it: put elsewhere, or locked."""
        self.on_placed: list[Callable[[int], None]] = []
        """Those who are told the body of a part that was put somewhere in a run."""
        self.on_removed: list[Callable[[WorldPart, Removal], None]] = []
        """Called with a part that leaves the cell, and what takes it."""
        rows = np.array([part.qpos for part in parts], dtype=np.int64).reshape(-1, 1)
        self._position_rows = rows + np.arange(3)

    def reset(self) -> None:
        """Every part that does not wait in a pool is in play."""
        self.in_play = {part.name for part in self.all if not part.pooled}

    def get_state(self) -> dict[str, Any]:
        """The parts in play."""
        return {"in_play": sorted(self.in_play)}

    def set_state(self, state: State) -> None:
        """Remember what `get_state` returned."""
        self.in_play = set(state["in_play"])

    def part(self, name: str) -> WorldPart:
        """A part by its full model name.

        Raises:
            UnknownNameError: there is none of this name.
        """
        try:
            return self.by_name[name]
        except KeyError:
            raise UnknownNameError("part", name, self.by_name) from None

    def positions(self) -> NDArray[np.float64]:
        """Positions of all parts [m], shape (parts, 3), world frame, as of this tick."""
        positions: NDArray[np.float64] = self.simulation.data.qpos[self._position_rows]
        return positions

    def inside(self, lower: Sequence[float], upper: Sequence[float]) -> list[WorldPart]:
        """The parts in play whose origin is in a box of the world frame [m], in the order of the parts."""
        if not self.all:
            return []
        positions = self.positions()
        hit = np.all((positions >= np.asarray(lower)) & (positions <= np.asarray(upper)), axis=1)
        return [self.all[index] for index in np.flatnonzero(hit) if self.all[index].name in self.in_play]

    def pose(self, part: WorldPart) -> Pose:
        """world_T_part as of this tick."""
        values = [float(value) for value in self.simulation.data.qpos[part.qpos : part.qpos + 7]]
        return Pose((values[0], values[1], values[2]), (values[3], values[4], values[5], values[6]))

    def place(self, part: WorldPart, world_T_part: Pose) -> None:
        """Have a part stand at a pose, at rest and held by nothing: it appears there, or was dropped there."""
        self._teleport(part, world_T_part)
        self.in_play.add(part.name)
        for listener in self.on_placed:
            listener(part.body)

    def put_away(self, part: WorldPart, by: Removal = "clearing") -> None:
        """Take a part out of play, onto its shelf slot."""
        self._teleport(part, part.shelf)
        self.in_play.discard(part.name)
        for listener in self.on_removed:
            listener(part, by)

    def take_from_cup(self, part: WorldPart) -> None:
        """Have the cup hold a part no longer, if it does."""
        if part.grip is not None:
            self.simulation.data.eq_active[part.grip] = 0
        for listener in self.on_taken:
            listener(part)

    def is_locked(self, part: WorldPart) -> bool:
        """Whether a part is locked to a tray."""
        return any(self.simulation.data.eq_active[lock] for lock in part.locks)

    def _teleport(self, part: WorldPart, world_T_part: Pose) -> None:
        simulation: Simulation = self.simulation
        data = simulation.data
        self.take_from_cup(part)
        for lock in part.locks:
            data.eq_active[lock] = 0
        data.qpos[part.qpos : part.qpos + 3] = world_T_part.position
        data.qpos[part.qpos + 3 : part.qpos + 7] = world_T_part.quaternion
        data.qvel[part.dof : part.dof + 6] = 0.0
        simulation.keep_awake(part.body)
        simulation.touch()
