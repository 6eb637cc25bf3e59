"""Parts that were put into something: they stay where they were put, as in the original.

The original's contact surfaces correct a penetration at a limited speed; the engine's would push parts apart at metres
per second. So the pairs of bodies that overlap at the start of a run, or after a part was put somewhere, are watched
until they are apart. The penetration that they have then counts as none, but for what a limited speed needs: what is
pressed deeper is pushed back, friction holds, and no energy comes out of the overlap. Where no pair overlaps the device
rests and costs nothing.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.cell.devices.parts import Parts
from cellwright.cell.model.parts import separation_speed
from cellwright.engine.device import Device, State
from cellwright.engine.simulation import Simulation

DEPTH = 0.0002
"""Penetration [m] from which on bodies overlap; parts at rest sink in by a few micrometres."""

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
        self._pairs: dict[int, tuple[int, float]] = {}
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
        """The pairs, and the parts that were put somewhere in this tick.

        A pair has a number that says which bodies it is of, the steps that these have been apart, and how deep they lie
        in one another [m].
        """
        return {
            "pairs": [[key, apart, depth] for key, (apart, depth) in sorted(self._pairs.items())],
            "put": sorted(self._put or ()),
        }

    def set_state(self, state: State) -> None:
        """Watch what `get_state` returned."""
        self._put = set(state["put"])
        self._set_pairs({key: (apart, depth) for key, apart, depth in state["pairs"]})

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
        depths = -data.contact.dist
        if self._put:
            is_new = np.isin(bodies, list(self._put)).any(axis=1) & self._is_part[bodies].any(axis=1)
            found = _deepest(keys, depths, is_new & (depths > DEPTH))
            self._set_pairs({**self._pairs, **{key: (0, depth) for key, depth in found.items()}})
            self._put = None
        watched = np.isin(keys, self._keys)
        for index in np.flatnonzero(watched).tolist():
            self._hold_back(data, index, bodies[index], self._pairs[int(keys[index])][1])
        self._follow(_deepest(keys, depths, watched & (depths > DEPTH)))

    def _hold_back(self, data: mujoco.MjData, index: int, bodies: NDArray[np.int64], known: float) -> None:
        """Take off a contact's reference acceleration what the known penetration [m] adds to it."""
        row = int(data.contact.efc_address[index])
        if row < 0:
            return
        stiffness, damping, impedance, _ = data.efc_KBIP[row]
        most = damping * float(self._speeds[bodies].min()) / (stiffness * impedance)
        depth = float(data.efc_margin[row] - data.efc_pos[row])
        excess = min(depth, known) - most
        if excess > 0.0:
            data.efc_aref[row] -= stiffness * impedance * excess

    def _follow(self, deepest: dict[int, float]) -> None:
        """Take note of how deep each pair is now; forget those that have been apart for a while."""
        awake = self.simulation.data.body_awake
        pairs = {}
        for key, (steps, depth) in self._pairs.items():
            one, other = divmod(key, len(self._is_part))
            if key in deepest:
                pairs[key] = (0, min(depth, deepest[key]))
            elif steps == 0 and awake[one] != _AWAKE and awake[other] != _AWAKE:
                pairs[key] = (0, depth)  # what sleeps has no contacts
            elif steps + 1 < APART:
                pairs[key] = (steps + 1, depth)
        if pairs != self._pairs:
            self._set_pairs(pairs)
        if not pairs:
            self.set_stepping(False)

    def _set_pairs(self, pairs: dict[int, tuple[int, float]]) -> None:
        self._pairs = pairs
        self._is_counting = any(apart for apart, _ in pairs.values())
        self._keys = np.array(sorted(pairs), dtype=np.int64)
        self._watched = np.unique(np.array([divmod(key, len(self._is_part)) for key in pairs], dtype=np.int64))


def _deepest(keys: NDArray[np.int64], depths: NDArray[np.float64], chosen: NDArray[np.bool_]) -> dict[int, float]:
    """The largest depth [m] of each pair among the chosen contacts."""
    found: dict[int, float] = {}
    for key, depth in zip(keys[chosen].tolist(), depths[chosen].tolist(), strict=True):
        found[key] = max(depth, found.get(key, 0.0))
    return found
