"""Distances of the arm's links in a cell's own model, by the engine's own measure."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from cellwright.cell.cell import Cell
from cellwright.config.arm import ARM_FRAMES, ARM_JOINTS
from cellwright.motion import Joints

LINKS = ARM_FRAMES[1:]
RAIL = ARM_FRAMES[0]
NEIGHBOURS = 2
"""Links up to which two of the chain are as near as they are built."""


class LinkDistances:
    """Distances of links to all but parts: to what is fixed, to AGVs, and to links that are not their neighbours.

    The base and the link on it are not compared with the beam that carries them.

    Args:
        cell: the cell.
        links: the links that are looked at.
    """

    def __init__(self, cell: Cell, links: tuple[str, ...] = LINKS) -> None:
        self._cell = cell
        model = cell.world.model
        self._data = mujoco.MjData(model)
        cell.world.set_initial_posture(self._data)
        self._joints = [int(model.joint(name).qposadr[0]) for name in ARM_JOINTS]
        parts = {part.body for part in (*cell.world.parts, *cell.world.bodies)}
        self._names = {
            geom: model.body(int(model.geom_bodyid[geom])).name
            for geom in range(model.ngeom)
            if model.geom_bodyid[geom] not in parts and (model.geom_contype[geom] or model.geom_conaffinity[geom])
        }
        pairs = [
            (one, other)
            for one, link in self._names.items()
            for other, body in self._names.items()
            if link in links and self._can_meet(link, body)
        ]
        self._pairs = np.array(pairs)
        reach = model.geom_rbound[self._pairs]
        self._reach = reach.sum(axis=1)
        self._is_plane = model.geom_type[self._pairs[:, 1]] == mujoco.mjtGeom.mjGEOM_PLANE

    @staticmethod
    def _can_meet(link: str, body: str) -> bool:
        if body in LINKS:
            return LINKS.index(body) > LINKS.index(link) + NEIGHBOURS
        return body != RAIL or LINKS.index(link) >= NEIGHBOURS

    def at(self, joints: Joints, limit: float) -> dict[tuple[str, str], float]:
        """Return the distances [m] of links to bodies below a limit, by their names, in a posture at the start."""
        self._data.qpos[self._joints] = joints
        return self._near(self._cell.world.model, self._data, limit)

    def now(self, limit: float) -> dict[tuple[str, str], float]:
        """Return the distances [m] below a limit at the present state of the simulation, which stays as it is."""
        model, qpos = self._cell.simulation.model, self._cell.simulation.data.qpos
        if len(self._data.qpos) != len(qpos):  # it has more of the belt's parts now
            self._data = mujoco.MjData(model)
        self._data.qpos[:] = qpos
        return self._near(model, self._data, limit)

    def _near(self, model: Any, data: Any, limit: float) -> dict[tuple[str, str], float]:
        mujoco.mj_kinematics(model, data)
        places = data.geom_xpos[self._pairs]
        apart = np.linalg.norm(places[:, 0] - places[:, 1], axis=1) - self._reach
        found: dict[tuple[str, str], float] = {}
        for one, other in self._pairs[self._is_plane | (apart < limit)].tolist():
            distance = mujoco.mj_geomDistance(model, data, one, other, limit, None)
            if distance < limit:
                pair = self._names[one], self._names[other]
                found[pair] = min(distance, found.get(pair, limit))
        return found
