"""Parts in the cell: their poses, how they appear and disappear, the welds that hold them, and overlapping parts.

The original's contact surfaces correct a penetration at a limited speed; the engine's would push parts apart at metres
per second. So this module tracks the pairs of bodies that overlap when a run starts, or after a part was placed,
until they are apart. Their initial penetration counts as none, except for what the limited speed needs. Deeper
penetration is pushed back, friction holds, and no energy comes out of the overlap. Where no pair overlaps the device
stops stepping and costs nothing.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.cell.kitting.fates import Removal
from cellwright.cell.model.build import World, WorldPart
from cellwright.cell.model.clones import more_bodies
from cellwright.cell.model.parts import separation_speed
from cellwright.cell.model.rearrangement import rearrange
from cellwright.config.trial.trial import Trial
from cellwright.engine.device import Device, State
from cellwright.engine.simulation import Simulation
from cellwright.util.errors import UnknownNameError, UsageError
from cellwright.util.pose import Pose

MAX_PART_SIZE = 0.4
"""Maximum extent of a part [m]: one whose origin is further from an object than this does not touch it."""

OVERLAP_DEPTH = 0.0002
"""Minimum penetration [m] of an overlap; parts at rest sink in by a few micrometres."""
APART_STEPS = 50
"""Number of steps without a penetration after which two bodies are apart for good."""
_MAX_BODIES = 1 << 20  # base of the numbers of pairs
_AWAKE = 1  # value of MjData.body_awake; 0 is asleep, -1 static


class Parts(Device):
    """All parts of the cell, including those that wait or have left.

    A part is `in_play` from its appearance until it is put away. A clone of the belt has a body of the engine only
    meanwhile: the first free one of its type. Every other part has its own body. A body that is not in play stands on
    its shelf slot.

    At the begin of a step each type has a free body, or as many bodies as clones: if a clone took the last one, the
    engine's model gets more.

    Args:
        world: the model that a run begins with.
        build: returns a model with bodies of these types for the clones.
    """

    def __init__(self, world: World, build: Callable[[Sequence[str]], World]) -> None:
        super().__init__("parts")
        self.world = world
        """The model now."""
        self._first = world
        self._build = build
        self._clones = dict(world.clones)
        self._pools = Counter(self._clones.values())
        # index of the body in `World.bodies` of each clone that has one
        self._bodies: dict[str, int] = {}
        waiting = [part.name for part in world.parts if part.pooled]
        self.names = (*(part.name for part in world.parts if not part.pooled), *self._clones, *waiting)
        """Names of all parts, in their order."""
        self.in_play: set[str] = set()
        self.on_taken: list[Callable[[WorldPart], None]] = []
        """Callbacks for a part that is placed elsewhere or locked; if it was in the cup, it no longer is."""
        self.on_placed: list[Callable[[int], None]] = []
        """Callbacks for the body of a part that was placed during a run."""
        self.on_removed: list[Callable[[WorldPart, Removal], None]] = []
        """Callbacks for a part that leaves the cell, with the reason."""
        self._list_parts()

    def reset(self) -> None:
        """Put every part into play that does not wait in a pool."""
        self.world, self._bodies = self._first, {}
        self.in_play = {part.name for part in self.world.parts if not part.pooled}
        self._list_parts()
        self.set_stepping(False)

    def rearrange(self, trial: Trial) -> World:
        """Begin the next run with another variation of the trial; return its model."""
        self._first = rearrange(self._first, trial)
        return self._first

    def get_state(self) -> dict[str, Any]:
        """Return the parts in play, the bodies of the clones, and the types of the bodies since the first model."""
        return {"in_play": sorted(self.in_play), "bodies": dict(self._bodies), "grown": self._grown()}

    def set_state(self, state: State) -> None:
        """Restore what `get_state` returned, with as many bodies in the engine's model."""
        self.in_play, self._bodies = set(state["in_play"]), dict(state["bodies"])
        if state["grown"] != self._grown():
            first = [body.type for body in self._first.bodies]
            self.world = self._build([*first, *state["grown"]]) if state["grown"] else self._first
            self.simulation.use_model(self.world.model)
        self._list_parts()

    def before_step(self) -> None:
        """Add bodies of the types that have no free one, if clones of them may still come."""
        if missing := self._missing():
            self._grow(missing)
        self.set_stepping(False)

    def part(self, name: str) -> WorldPart:
        """Return a part by its full model name.

        Raises:
            UnknownNameError: there is none of this name.
            UsageError: it is a clone that is not in play, and so has no body.
        """
        try:
            return self.by_name[name]
        except KeyError:
            if name in self._clones:
                raise UsageError(f"part {name!r} is not in play, and has no body; `appear` gives it one") from None
            raise UnknownNameError("part", name, self.names) from None

    def positions(self) -> NDArray[np.float64]:
        """Return the positions of all parts with a body [m], shape (parts, 3), world frame, as of this tick."""
        positions: NDArray[np.float64] = self.simulation.data.qpos.take(self._position_rows)
        return positions

    def inside(self, lower: Sequence[float], upper: Sequence[float]) -> list[WorldPart]:
        """Return the parts in play whose origin is in a box of the world frame [m], in the order of the parts."""
        if not self.all:
            return []
        positions = self.positions()
        (hit,) = np.nonzero(((positions >= lower) & (positions <= upper)).all(axis=1))
        return [each for index in hit.tolist() if (each := self.all[index]).name in self.in_play]

    def pose(self, part: WorldPart) -> Pose:
        """Return world_T_part as of this tick."""
        values = [float(value) for value in self.simulation.data.qpos[part.qpos : part.qpos + 7]]
        return Pose((values[0], values[1], values[2]), (values[3], values[4], values[5], values[6]))

    def appear(self, name: str, world_T_part: Pose) -> None:
        """Place a part by its full model name; if it is a clone that has no body, give it one.

        Raises:
            UnknownNameError: there is no part of this name.
        """
        if name in self._clones and name not in self._bodies:
            kind = self._clones[name]
            if not self._free(kind):
                self._grow([kind])
            self._bodies[name] = self._free(kind)[0]
            self._list_parts()
            self.set_stepping(bool(self._missing()))
        self.place(self.part(name), world_T_part)

    def place(self, part: WorldPart, world_T_part: Pose) -> None:
        """Place a part at a pose, at rest and free: it appears there, or was dropped there."""
        self._teleport(part, world_T_part)
        if part.name not in self.in_play:
            self.in_play.add(part.name)
            self._list_parts()
        for listener in self.on_placed:
            listener(part.body)

    def put_away(self, part: WorldPart, cause: Removal = Removal.CLEARING) -> None:
        """Take a part out of play, and its body onto its shelf slot, for this reason."""
        self._teleport(part, part.shelf)
        self.in_play.discard(part.name)
        for listener in self.on_removed:
            listener(part, cause)
        self._bodies.pop(part.name, None)
        self._list_parts()
        self.set_stepping(bool(self._missing()))

    def take_from_cup(self, part: WorldPart) -> None:
        """Make the cups release a part, those that hold it."""
        for grip in part.grips.values():
            self.simulation.data.eq_active[grip] = 0
        for listener in self.on_taken:
            listener(part)

    def touches(self, part: WorldPart, geom: int, *, within: float = 0.0, cutoff: float) -> bool:
        """Return whether a part is near a geom.

        Args:
            part: the part.
            geom: id of the geom.
            within: maximum distance [m].
            cutoff: distance [m] up to which distances are exact.
        """
        model, data = self.simulation.model, self.simulation.data
        return any(mujoco.mj_geomDistance(model, data, each, geom, cutoff, None) <= within for each in part.geoms)

    def is_locked(self, part: WorldPart) -> bool:
        """Return whether a part is locked to a tray."""
        return any(self.simulation.data.eq_active[lock] for lock in part.locks.values())

    def _free(self, kind: str) -> list[int]:
        """Return the indices of the bodies of a type that no clone has."""
        taken = set(self._bodies.values())
        return [index for index, body in enumerate(self.world.bodies) if body.type == kind and index not in taken]

    def _missing(self) -> list[str]:
        """Return the types that have no free body, and fewer bodies than clones."""
        bodies = Counter(body.type for body in self.world.bodies)
        return [kind for kind, pool in self._pools.items() if bodies[kind] < pool and not self._free(kind)]

    def _grown(self) -> list[str]:
        return [body.type for body in self.world.bodies[len(self._first.bodies) :]]

    def _grow(self, kinds: Sequence[str]) -> None:
        """Add bodies of these types to the engine's model."""
        bodies: Sequence[str] = [body.type for body in self.world.bodies]
        for kind in kinds:
            bodies = more_bodies(bodies, kind, self._pools[kind])
        self.world = self._build(bodies)
        self.simulation.grow(self.world.model)

    def _list_parts(self) -> None:
        """List the parts that have a body."""
        found = {part.name: part for part in self.world.parts}
        found |= {name: replace(self.world.bodies[index], name=name) for name, index in self._bodies.items()}
        self.by_name: Mapping[str, WorldPart] = {name: found[name] for name in self.names if name in found}
        self.by_body: Mapping[int, WorldPart] = {part.body: part for part in found.values()}
        self.all = tuple(self.by_name.values())
        """The parts that have a body, in their order."""
        rows = np.array([part.qpos for part in self.all], dtype=np.int64).reshape(-1, 1)
        self._position_rows = rows + np.arange(3)
        alike = {body.type: body.body for body in self.world.bodies}
        bodies = [found[name].body if name in found else alike[self._clones[name]] for name in self.names]
        self.shown = tuple((name, body, name in self.in_play) for name, body in zip(self.names, bodies, strict=True))
        """Name, body and visibility of each part. The body of a clone that has none is one that looks like it."""

    def _teleport(self, part: WorldPart, world_T_part: Pose) -> None:
        simulation: Simulation = self.simulation
        data = simulation.data
        self.take_from_cup(part)
        for lock in part.locks.values():
            data.eq_active[lock] = 0
        data.qpos[part.qpos : part.qpos + 3] = world_T_part.position
        data.qpos[part.qpos + 3 : part.qpos + 7] = world_T_part.quaternion
        data.qvel[part.dof : part.dof + 6] = 0.0
        simulation.keep_awake(part.body)
        simulation.touch()


class Overlaps(Device):
    """Device that limits the speed at which overlapping parts separate."""

    def __init__(self, parts: Parts) -> None:
        super().__init__("overlaps")
        self._parts = parts
        self._placed: set[int] | None = None
        self._pairs: dict[int, tuple[int, float]] = {}
        parts.on_placed.append(self._take_placed)
        parts.on_removed.append(self._forget)

    def attach(self, simulation: Simulation) -> None:
        """Attach to a simulation."""
        super().attach(simulation)
        self._look_up()
        self._set_pairs({})

    def _look_up(self) -> None:
        self._model = model = self.simulation.model
        self._bodies = np.asarray(model.geom_bodyid, dtype=np.int64)
        self._is_part = np.zeros(model.nbody, dtype=np.bool_)
        self._speeds = np.full(model.nbody, np.inf)
        for part in (*self._parts.world.parts, *self._parts.world.bodies):
            self._is_part[part.body] = True
            self._speeds[part.body] = separation_speed(part.type)
        for body in range(model.nbody):
            if model.body(body).name.endswith("::tray"):
                self._speeds[body] = 0.0

    @property
    def bodies(self) -> frozenset[int]:
        """Bodies of the known pairs, and of the parts that were placed in this tick."""
        return frozenset((*self._watched.tolist(), *(self._placed or ())))

    def reset(self) -> None:
        """Begin a run: every part was just placed."""
        self._placed = {part.body for part in self._parts.all}
        self._set_pairs({})
        self.set_stepping(True)

    def get_state(self) -> State:
        """Return the pairs, and the parts that were placed in this tick.

        A pair has a number that encodes its two bodies, the number of steps that these have been apart, and their
        penetration [m].
        """
        return {
            "pairs": [[key, apart, depth] for key, (apart, depth) in sorted(self._pairs.items())],
            "put": sorted(self._placed or ()),
        }

    def set_state(self, state: State) -> None:
        """Restore what `get_state` returned."""
        self._placed = set(state["put"])
        self._set_pairs({key: (apart, depth) for key, apart, depth in state["pairs"]})

    def _take_placed(self, body: int) -> None:
        self._placed = {*(self._placed or ()), body}
        self.set_stepping(True)

    def _forget(self, part: WorldPart, _cause: Removal) -> None:
        """Forget the pairs of a part that has left: its body may soon be another's."""
        pairs = {key: pair for key, pair in self._pairs.items() if part.body not in divmod(key, _MAX_BODIES)}
        if len(pairs) < len(self._pairs):
            self._set_pairs(pairs)

    def drive(self) -> None:
        """Find new overlapping pairs, and hold back the contact forces that would push the known ones apart."""
        if self.simulation.model is not self._model:
            self._look_up()
        data = self.simulation.data
        if not (self._placed or self._is_counting or (data.body_awake[self._watched] == _AWAKE).any()):
            self.set_stepping(bool(self._pairs))
            return
        bodies = self._bodies[data.contact.geom]
        keys = bodies.min(axis=1) * _MAX_BODIES + bodies.max(axis=1)
        depths = -data.contact.dist
        if self._placed:
            is_new = np.isin(bodies, list(self._placed)).any(axis=1) & self._is_part[bodies].any(axis=1)
            overlaps = _deepest(keys, depths, is_new & (depths > OVERLAP_DEPTH))
            self._set_pairs({**self._pairs, **{key: (0, depth) for key, depth in overlaps.items()}})
            self._placed = None
        watched = np.isin(keys, self._keys)
        for index in np.flatnonzero(watched).tolist():
            self._hold_back(data, index, bodies[index], self._pairs[int(keys[index])][1])
        self._follow(_deepest(keys, depths, watched & (depths > OVERLAP_DEPTH)))

    def _hold_back(self, data: mujoco.MjData, index: int, bodies: NDArray[np.int64], known: float) -> None:
        """Remove the known penetration's share [m] from a contact's reference acceleration."""
        row = int(data.contact.efc_address[index])
        if row < 0:
            return
        stiffness, damping, impedance, _ = data.efc_KBIP[row]
        allowed = damping * float(self._speeds[bodies].min()) / (stiffness * impedance)
        depth = float(data.efc_margin[row] - data.efc_pos[row])
        excess = min(depth, known) - allowed
        if excess > 0.0:
            data.efc_aref[row] -= stiffness * impedance * excess

    def _follow(self, deepest: dict[int, float]) -> None:
        """Update the penetration of each pair; forget pairs that have been apart for a while."""
        awake = self.simulation.data.body_awake
        pairs = {}
        for key, (steps, depth) in self._pairs.items():
            one, other = divmod(key, _MAX_BODIES)
            if key in deepest:
                pairs[key] = (0, min(depth, deepest[key]))
            elif steps == 0 and awake[one] != _AWAKE and awake[other] != _AWAKE:
                pairs[key] = (0, depth)  # sleeping bodies have no contacts
            elif steps + 1 < APART_STEPS:
                pairs[key] = (steps + 1, depth)
        if pairs != self._pairs:
            self._set_pairs(pairs)
        if not pairs:
            self.set_stepping(False)

    def _set_pairs(self, pairs: dict[int, tuple[int, float]]) -> None:
        self._pairs = pairs
        self._is_counting = any(apart for apart, _ in pairs.values())
        self._keys = np.array(sorted(pairs), dtype=np.int64)
        self._watched = np.unique(np.array([divmod(key, _MAX_BODIES) for key in pairs], dtype=np.int64))


def _deepest(keys: NDArray[np.int64], depths: NDArray[np.float64], chosen: NDArray[np.bool_]) -> dict[int, float]:
    """Return the maximum depth [m] of each pair among the chosen contacts."""
    deepest: dict[int, float] = {}
    for key, depth in zip(keys[chosen].tolist(), depths[chosen].tolist(), strict=True):
        deepest[key] = max(depth, deepest.get(key, 0.0))
    return deepest
