"""Regions of the arms of a cell: the postures that each may take until it goes on, and who waits for whom.

Before an arm goes on, it compares the postures on its way with all that the others may take meanwhile. No timing is
assumed. If two come too near, it waits where it is. An arm at home is in no one's way: every motion keeps away from
homes (`clearance`). So an arm that waits in the way of another one goes home.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.clients.agents.kitter.clearance import (
    ARMS_APART,
    CUP_FACE,
    SERVOS,
    Array,
    Obstacle,
    add_chain,
    add_shape,
    places_along,
)
from cellwright.clients.agents.kitter.part_figures import PartFigures
from cellwright.clients.agents.kitter.postures import Postures
from cellwright.clients.client import Client
from cellwright.motion.chain import Chain

HALF_STEP = 0.025
"""Largest distance [m] of a shape, on its way, from where it is at one of the places that are compared."""

FINER = 3
"""Number of places for each one at which the clearance from the cell is computed: several joints move at once."""

MAX_CHECKS = 4000
"""Pairs of shapes whose distance is computed; two regions with more that are near each other count as too near."""

_NO_LOAD = 1e-6
"""Radius [m] of the ball around a load without one."""

PATIENCE = 2.0
"""Time [s] after which an arm that waits makes way for one that comes after it in the cell, too."""


class Region(NamedTuple):
    """Shapes of an arm at some postures.

    Attributes:
        centres: positions of the shapes [m], shape (postures, shapes, 3). The last one is a ball around the load.
        turns: their rotation matrices, shape (postures, shapes, 9).
        load: radius of that ball [m]; 0 without a load.
    """

    centres: Array
    turns: Array
    load: float


class Regions:
    """Regions of all arms.

    Args:
        solids: shapes by frame, as `Client.solids` returns them.
        arms: each arm, from the frame of its mount to its cup, and its postures.
        apart: least distance between arms [m].
    """

    def __init__(
        self,
        solids: Mapping[str, Sequence[Mapping[str, Any]]],
        arms: Sequence[tuple[Chain, Postures]],
        apart: float = ARMS_APART,
    ) -> None:
        # between two places that are compared, both arms may come nearer by their half steps, across the line between
        self._apart = math.hypot(apart, 2 * HALF_STEP) + SERVOS
        spec = mujoco.MjSpec()
        self._shapes = [_Shapes(spec, solids, *arm) for arm in arms]
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        for each in self._shapes:
            each.measure(self._model)
        self.held: list[Region | None] = [None for _ in arms]
        """Region of each arm; None at home."""
        self.wanted: list[Region | None] = [None for _ in arms]
        """Region for which it waits."""
        self._compared: dict[tuple[int, int], tuple[Region, Region, bool]] = {}

    def of(self, arm: int, path: Sequence[Sequence[float]], load: PartFigures | None) -> Region:
        """Return the region of an arm along a path, with a load on the cup."""
        return self._shapes[arm].along(self._model, self._data, path, load)

    def conflict(self, arm: int, region: Region) -> tuple[int, Obstacle] | None:
        """Return the arm that another one would come too near to in a region, and where."""
        for other, held in enumerate(self.held):
            if other != arm and held is not None:
                found = self._too_near(arm, region, other, held)
                if found is not None:
                    return other, found
        return None

    def waiting_for(self, arm: int) -> Iterator[int]:
        """Yield the arms that wait for one to leave where it is."""
        held = self.held[arm]
        for other, wanted in enumerate(self.wanted):
            if other != arm and held is not None and wanted is not None and self._is_wanted(other, wanted, arm, held):
                yield other

    def _is_wanted(self, arm: int, wanted: Region, other: int, held: Region) -> bool:
        """Return whether a region is in the way of one for which an arm waits; asked in every tick meanwhile."""
        known = self._compared.get((arm, other))
        if known is None or known[0] is not wanted or known[1] is not held:
            known = wanted, held, self._too_near(arm, wanted, other, held) is not None
            self._compared[arm, other] = known
        return known[2]

    def _too_near(self, arm: int, region: Region, other: int, held: Region) -> Obstacle | None:
        own, its = self._shapes[arm], self._shapes[other]
        one, two = own.balls(region), its.balls(held)
        # most of an arm is far from all of the other one
        one = one.near(two, self._apart)
        two = two.near(one, self._apart)
        squares = sum((a[:, np.newaxis] - b) ** 2 for a, b in zip(one.centres.T, two.centres.T, strict=True))
        gaps = np.sqrt(squares) - one.radii[:, np.newaxis] - two.radii
        found = np.argwhere(gaps < self._apart)
        found = found[np.argsort(gaps[found[:, 0], found[:, 1]], kind="stable")]
        pairs = dict.fromkeys(zip(one.shapes[found[:, 0]].tolist(), two.shapes[found[:, 1]].tolist(), strict=True))
        if len(pairs) > MAX_CHECKS:
            return Obstacle(0.0, own.names[-1], its.names[-1])
        for shapes, what in ((own, region), (its, held)):
            self._model.geom_size[shapes.first + shapes.count - 1, 0] = max(what.load, _NO_LOAD)
        centres, turns = self._data.geom_xpos, self._data.geom_xmat
        for first, second in pairs:
            (i, shape), (j, its_shape) = divmod(first, own.count), divmod(second, its.count)
            geom, other_geom = own.first + shape, its.first + its_shape
            centres[geom], turns[geom] = region.centres[i, shape], region.turns[i, shape]
            centres[other_geom], turns[other_geom] = held.centres[j, its_shape], held.turns[j, its_shape]
            gap = mujoco.mj_geomDistance(self._model, self._data, geom, other_geom, self._apart, None)
            if gap < self._apart:
                return Obstacle(float(gap), own.names[shape], its.names[its_shape])
        return None


class _Balls(NamedTuple):
    """Balls that cover the shapes of a region: centres [m], shape (n, 3), radii [m], and the number of the shape."""

    centres: Array
    radii: Array
    shapes: NDArray[np.intp]

    def near(self, other: _Balls, distance: float) -> _Balls:
        """Return those that are near the box around others."""
        if not len(other.radii):
            return _Balls(self.centres[:0], self.radii[:0], self.shapes[:0])
        low = np.min(other.centres - other.radii[:, np.newaxis], axis=0) - distance
        high = np.max(other.centres + other.radii[:, np.newaxis], axis=0) + distance
        radii = self.radii[:, np.newaxis]
        is_near = np.all((self.centres + radii > low) & (self.centres - radii < high), axis=1)
        return _Balls(self.centres[is_near], self.radii[is_near], self.shapes[is_near])


class _Shapes:
    """Shapes of an arm in a model of the engine."""

    def __init__(
        self, spec: Any, solids: Mapping[str, Sequence[Mapping[str, Any]]], chain: Chain, postures: Postures
    ) -> None:
        self._first_joint, self.first = len(spec.joints), len(spec.geoms)
        self._joints = len(chain.joints)
        self._steps = postures.figures.steps
        self.names: list[str] = []
        """Link of each shape; the last one is the load."""
        for _, name, link in add_chain(spec, chain, postures.frame_T_base):
            for shape in solids.get(name, ()):
                add_shape(spec, link, shape, 0, 0)
                self.names.append(name)
        # the cup is the last link
        ball = {"type": "sphere", "size": [_NO_LOAD], "position": [0.0, 0.0, 0.0], "quaternion": [1.0, 0.0, 0.0, 0.0]}
        add_shape(spec, spec.body(postures.figures.gripper), ball, 0, 0)
        self.names.append("load")
        self.count = len(self.names)

    def measure(self, model: Any) -> None:
        """Cover each shape with balls along its longest axis."""
        owners, centres, radii = [], [], []
        for shape in range(self.count - 1):
            centre, half = np.split(model.geom_aabb[self.first + shape], 2)
            longest = int(np.argmax(half))
            radius = float(np.linalg.norm(np.delete(half, longest)))
            number = max(2, math.ceil(half[longest] / radius) + 1)
            for along in np.linspace(-half[longest], half[longest], number):
                place = centre.copy()
                place[longest] += along
                owners.append(shape)
                centres.append(place)
                radii.append(math.hypot(radius, half[longest] / (number - 1)))
        self._owners = np.array([*owners, self.count - 1])
        self._centres, self._radii = np.array([*centres, np.zeros(3)]), np.array([*radii, 0.0])

    def along(self, model: Any, data: Any, path: Sequence[Sequence[float]], load: PartFigures | None) -> Region:
        """Return the region of the arm along a path."""
        model.geom_pos[self.first + self.count - 1] = 0.0, 0.0, -CUP_FACE - (0.0 if load is None else load.height / 2)
        joints, shapes = (
            slice(one, one + n) for one, n in ((self._first_joint, self._joints), (self.first, self.count))
        )
        centres: list[Array] = []
        turns: list[Array] = []
        for q in places_along(path, tuple(each / FINER for each in self._steps)):
            data.qpos[joints] = q
            mujoco.mj_kinematics(model, data)
            points = data.geom_xpos[shapes]
            if not centres or np.max(np.abs(points - centres[-1])) > HALF_STEP:
                centres.append(points.copy())
                turns.append(data.geom_xmat[shapes].copy())
        centres.append(data.geom_xpos[shapes].copy())
        turns.append(data.geom_xmat[shapes].copy())
        radius = 0.0 if load is None else math.hypot(load.extent + math.hypot(*load.grip), load.height / 2)
        return Region(np.array(centres), np.array(turns), radius)

    def balls(self, region: Region) -> _Balls:
        """Return the balls that cover a region."""
        count = len(self._owners) - (0 if region.load else 1)
        owners, places = self._owners[:count], self._centres[:count]
        turns = region.turns[:, owners].reshape(len(region.turns), -1, 3, 3)
        centres = region.centres[:, owners] + np.einsum("npij,pj->npi", turns, places)
        radii = np.where(owners == self.count - 1, region.load, self._radii[:count])
        shapes = self.count * np.arange(len(centres))[:, np.newaxis] + owners
        return _Balls(centres.reshape(-1, 3), np.tile(radii, len(centres)), shapes.ravel())


class Lane:
    """One arm among the regions of all."""

    def __init__(self, regions: Regions, number: int) -> None:
        self._regions = regions
        self._number = number
        self._wanted: Region | None = None
        self._blocking = number

    def enter(self, path: Sequence[Sequence[float]], load: PartFigures | None) -> Obstacle | None:
        """Take the region of a path; return what is in the way if it cannot."""
        region = self._regions.of(self._number, path, load)
        found = self._regions.conflict(self._number, region)
        if found is None:
            self._regions.held[self._number] = region
            return None
        self._wanted = region
        self._blocking, obstacle = found
        return obstacle

    def keep(self, path: Sequence[Sequence[float]], load: PartFigures | None) -> None:
        """Give back all of the region but a path in it."""
        self._regions.held[self._number] = self._regions.of(self._number, path, load)

    def leave(self) -> None:
        """Give back the region: the arm is at home."""
        self._regions.held[self._number] = None

    @property
    def is_in_the_way(self) -> bool:
        """True if another arm waits until this one leaves where it is."""
        return next(self._regions.waiting_for(self._number), None) is not None

    def wait(self, client: Client, timeout: float) -> None:
        """Wait until what was in the way has moved, or this arm has to make way; at most `timeout` [s].

        Of two that are in each other's way, the later one in the cell makes way first.
        """
        regions, began = self._regions, client.time
        before = regions.held[self._blocking]

        def may_go_on() -> bool:
            if regions.held[self._blocking] is not before:
                return True
            patience = client.time - began > PATIENCE
            return any(patience or other < self._number for other in regions.waiting_for(self._number))

        regions.wanted[self._number] = self._wanted
        try:
            client.wait_until(may_go_on, timeout)
        finally:
            regions.wanted[self._number] = None
