"""Parts that were put into something: they stay where they were put, as in the original.

The original's contact surfaces correct a penetration at a limited speed; the engine's would push parts apart at metres
per second. So the pairs of bodies that overlap at the start of a run, or after a part was put somewhere, are watched
until they are apart. While they are, the engine's position term is taken off their contacts, but for what a limited
speed needs: nothing comes nearer, friction holds, and no energy comes out of the overlap. Where no pair overlaps the
device rests and costs nothing.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.devices.parts import Parts
from cellwright.simulation.device import Device, State
from cellwright.simulation.simulation import Simulation
from cellwright.world.parts import separation_speed

DEPTH = 0.0002
"""Penetration [m] from which on bodies overlap; parts at rest sink in by a few micrometres."""

SUPPORT = 16e-6
"""Penetration [m] that is left to what a part lies on, so that it bears the part: about that of a part at rest."""

APART = 50
"""After so many steps without a penetration two bodies are apart for good."""

_AWAKE = 1  # of MjData.body_awake; 0 is asleep, -1 static


class Overlaps(Device):
    """Watches the parts that overlap something.

    Args:
        parts: the parts of the cell.
    """

    def __init__(self, parts: Parts) -> None:
        super().__init__("overlaps")
        self._parts = parts
        self._put: set[int] | None = None
        self._pairs: dict[int, int] = {}
        parts.on_placed.append(self._take_placed)

    def attach(self, simulation: Simulation) -> None:
        """Take a place in a simulation."""
        super().attach(simulation)
        model = simulation.model
        self._bodies = np.asarray(model.geom_bodyid, dtype=np.int64)
        self._is_part = np.zeros(model.nbody, dtype=np.bool_)
        self._speeds = np.full(model.nbody, np.inf)
        for part in self._parts.all:
            self._is_part[part.body] = True
            self._speeds[part.body] = separation_speed(part.type)
        for body in range(model.nbody):
            if model.body(body).name.endswith("::tray"):
                self._speeds[body] = 0.0
        self._set_pairs({})

    # ---------------------------------------------------------------- life

    def reset(self) -> None:
        """Begin a run: every part was put where it is."""
        self._put = {part.body for part in self._parts.all}
        self._set_pairs({})
        self.set_stepping(True)

    def get_state(self) -> State:
        """The pairs, with the steps that each has been apart, and the parts that were put somewhere in this tick."""
        return {"pairs": sorted(self._pairs.items()), "put": sorted(self._put or ())}

    def set_state(self, state: State) -> None:
        """Watch what `get_state` returned."""
        self._put = set(state["put"])
        self._set_pairs(dict(state["pairs"]))

    def _take_placed(self, body: int) -> None:
        self._put = {*(self._put or ()), body}
        self.set_stepping(True)

    # ---------------------------------------------------------------- in a step

    def drive(self) -> None:
        """Find pairs that overlap now, and hold back what would push the known ones apart."""
        data = self.simulation.data
        if not (self._put or self._is_counting or (data.body_awake[self._watched] == _AWAKE).any()):
            self.set_stepping(bool(self._pairs))
            return
        bodies = self._bodies[data.contact.geom]
        keys = bodies.min(axis=1) * len(self._is_part) + bodies.max(axis=1)
        deep = data.contact.dist < -DEPTH
        if self._put:
            is_new = np.isin(bodies, list(self._put)).any(axis=1) & self._is_part[bodies].any(axis=1)
            self._set_pairs({**self._pairs, **dict.fromkeys(keys[is_new & deep].tolist(), 0)})
            self._put = None
        watched = np.isin(keys, self._keys)
        for index in np.flatnonzero(watched).tolist():
            self._hold_back(data, index, bodies[index])
        self._count(set(keys[watched & deep].tolist()))

    def _hold_back(self, data: mujoco.MjData, index: int, bodies: NDArray[np.int64]) -> None:
        """Take off a contact's reference acceleration what a penetration beyond the limit adds to it."""
        row = int(data.contact.efc_address[index])
        if row < 0:
            return
        stiffness, damping, impedance, _ = data.efc_KBIP[row]
        speed = float(self._speeds[bodies].min())
        most = damping * speed / (stiffness * impedance)
        if not self._is_part[bodies].all():
            most = max(most, SUPPORT)
        depth = float(data.efc_margin[row] - data.efc_pos[row])
        if depth > most:
            data.efc_aref[row] -= stiffness * impedance * (depth - most)

    def _count(self, deep: set[int]) -> None:
        """Forget pairs that have been apart for a while; those that fell asleep in one another have no contacts."""
        awake = self.simulation.data.body_awake
        pairs = {}
        for key, steps in self._pairs.items():
            one, other = divmod(key, len(self._is_part))
            sleeps = awake[one] != _AWAKE and awake[other] != _AWAKE
            apart = 0 if key in deep or (sleeps and not steps) else steps + 1
            if apart < APART:
                pairs[key] = apart
        if pairs != self._pairs:
            self._set_pairs(pairs)
        if not pairs:
            self.set_stepping(False)

    def _set_pairs(self, pairs: dict[int, int]) -> None:
        self._pairs = pairs
        self._is_counting = any(pairs.values())
        self._keys = np.array(sorted(pairs), dtype=np.int64)
        self._watched = np.unique(np.array([divmod(key, len(self._is_part)) for key in pairs], dtype=np.int64))
