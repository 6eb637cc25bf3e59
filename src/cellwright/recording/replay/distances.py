"""Distances and contacts between the bodies of a scene, in its recorded frames.

The engine computes distances from the shapes that it collides: boxes, cylinders and the convex hulls of meshes. A
robot's shapes are mostly seen only, and stand for its links. A pair
is skipped where the gap between the shapes' bounding boxes, which is a lower bound, is larger than any of interest.
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from itertools import product

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.engine.clock import seconds
from cellwright.rendering.scene import Scene, SceneFrame, SceneShape
from cellwright.rendering.scene.engine import EngineScene
from cellwright.rendering.scene.scene import SEEN, TOUCHED
from cellwright.util.errors import RecordingError, UnknownNameError, UsageError

TOUCHING = 1e-4
"""Bodies closer than this [m] touch: bodies at rest overlap by some micrometres."""

FLOOR, STATIC = "floor", "static"
"""Names of static shapes: of the engine's world, and of unknown bodies in older recordings."""

_MAX_DISTANCE = 1e3  # [m]
_SLACK = 1e-5  # [m] that bounds are lowered by: the box of the floor is so large that rounding shows


@dataclass(frozen=True, slots=True)
class Clearance:
    """Least distance between two groups of bodies.

    Attributes:
        distance: the distance [m]; 0 where they touch.
        time: simulation time [s] of the frame; of the first one if they touch.
        one: name of the body of the first group.
        other: name of the body of the second group.
    """

    distance: float
    time: float
    one: str
    other: str


@dataclass(frozen=True, slots=True)
class Contact:
    """Period in which two bodies touch.

    Attributes:
        one: name of the body of the first group.
        other: name of the body of the second group.
        begin: simulation time [s] of the first frame in which they touch.
        end: simulation time [s] of the last such frame.
    """

    one: str
    other: str
    begin: float
    end: float

    @property
    def duration(self) -> float:
        """Simulation time [s] from the first frame to the last; 0 for one frame."""
        return self.end - self.begin


class BodyDistances:
    """Distances between the bodies of a scene. Bodies are selected by names or patterns such as `bin*`.

    Args:
        scene: the scene.
        seen_too: True if bodies without shapes that touch count, with the shapes that are seen; else they are left out.

    Attributes:
        names: names of all bodies that count, static ones included.
    """

    def __init__(self, scene: Scene, *, seen_too: bool = False) -> None:
        statics = {"world": FLOOR, "": STATIC}

        def name_of(shape: SceneShape) -> str:
            return scene.bodies[shape.body] if shape.body else statics.get(shape.static_body, shape.static_body)

        touched = {name_of(shape) for shape in scene.shapes if shape.layer in TOUCHED}
        shapes = [
            shape
            for shape in scene.shapes
            if shape.layer in TOUCHED or (seen_too and shape.layer in SEEN and name_of(shape) not in touched)
        ]
        shapes.sort(key=lambda shape: shape.body)  # as the engine does
        self._engine = EngineScene(replace(scene, shapes=tuple(shapes)), layers=TOUCHED | SEEN)
        self._name = [name_of(shape) for shape in shapes]
        self._body = np.array([shape.body for shape in shapes], np.intp)
        self.names = tuple(dict.fromkeys(self._name))

    def select(self, bodies: str | Sequence[str]) -> frozenset[str]:
        """Return the names that fit a pattern, or any of several.

        Raises:
            UnknownNameError: no body fits a pattern.
        """
        found: set[str] = set()
        for pattern in [bodies] if isinstance(bodies, str) else bodies:
            fitting = [name for name in self.names if fnmatchcase(name, pattern)]
            if not fitting:
                raise UnknownNameError("body", pattern, self.names)
            found.update(fitting)
        return frozenset(found)

    def clearance(self, frames: Iterable[SceneFrame], one: Collection[str], other: Collection[str]) -> Clearance | None:
        """Return the least distance between two groups in some frames; None if no frame shows a pair of them."""
        pairs, least = self._pairs(one, other), _MAX_DISTANCE
        found: Clearance | None = None
        for frame in frames:
            bounds = self._bounds(frame, pairs)
            # From the smallest bound on: once a bound reaches the least distance so far, no later pair can be nearer.
            for index in np.argsort(bounds):
                if bounds[index] >= least:
                    break
                distance = self._distance(pairs[index], least)
                if distance < least:
                    least, names = distance, [self._name[shape] for shape in pairs[index]]
                    found = Clearance(max(0.0, distance), seconds(frame.time), *names)
                    if distance < TOUCHING:
                        return Clearance(0.0, found.time, found.one, found.other)
        return found

    def contacts(
        self, frames: Iterable[SceneFrame], one: Collection[str], other: Collection[str]
    ) -> tuple[Contact, ...]:
        """Return the contacts between two groups in some frames, in the order of their begins."""
        pairs = self._pairs(one, other)
        lasting: dict[tuple[str, str], tuple[float, float]] = {}
        found: list[Contact] = []
        for frame in frames:
            touching: set[tuple[str, str]] = set()
            for index in np.flatnonzero(self._bounds(frame, pairs) < TOUCHING):
                first, second = pairs[index]
                names = self._name[first], self._name[second]
                if names not in touching and self._distance(pairs[index], 2 * TOUCHING) < TOUCHING:
                    touching.add(names)
            found += [Contact(*names, *lasting.pop(names)) for names in lasting.keys() - touching]
            now = seconds(frame.time)
            lasting |= {names: (lasting.get(names, (now, now))[0], now) for names in touching}
        found += [Contact(*names, *period) for names, period in lasting.items()]
        return tuple(sorted(found, key=lambda contact: (contact.begin, contact.one, contact.other)))

    def _pairs(self, one: Collection[str], other: Collection[str]) -> NDArray[np.intp]:
        """Return the pairs of shapes (n, 2) of two groups, without those that stay as they are and repeated ones.

        Raises:
            UsageError: there are none, so that an assertion would hold whatever happened.
        """
        groups = [[shape for shape, name in enumerate(self._name) if name in names] for names in (one, other)]
        found: dict[tuple[int, int], None] = {}
        for first, second in product(*groups):
            moves = self._body[first] or self._body[second]
            if moves and self._name[first] != self._name[second] and (second, first) not in found:
                found[first, second] = None
        if not found:
            raise UsageError(
                f"bodies: no pair of the two groups can move (got {_listed(one)}, and {_listed(other)}); "
                "name other bodies"
            )
        return np.array(list(found), np.intp)

    def _bounds(self, frame: SceneFrame, pairs: NDArray[np.intp]) -> NDArray[np.float64]:
        """Show a frame; return a lower bound [m] of the distance of each pair, infinite where one is hidden."""
        if len(frame.poses) != self._engine.model.nbody:
            raise RecordingError(f"frame at {seconds(frame.time):.3f} s is of another scene; the recording is damaged")
        self._engine.show(frame)
        model, data = self._engine.model, self._engine.data
        turns = data.geom_xmat.reshape(-1, 3, 3)
        centres = data.geom_xpos + np.einsum("nij,nj->ni", turns, model.geom_aabb[:, :3])
        # Half the extent of a turned box along a world axis is the sum of its own halves times the |cosines| (Arvo,
        # Graphics Gems, 1990).
        halves = np.einsum("nij,nj->ni", np.abs(turns), model.geom_aabb[:, 3:])
        one, other = pairs.T
        gaps = np.abs(centres[one] - centres[other]) - halves[one] - halves[other]
        bounds: NDArray[np.float64] = np.linalg.norm(np.maximum(gaps, 0.0), axis=1) - _SLACK
        shown = frame.shown[self._body]
        bounds[~(shown[one] & shown[other])] = np.inf
        return bounds

    def _distance(self, pair: NDArray[np.intp], most: float) -> float:
        """Return the distance [m] of two shapes in the shown frame; `most` if it is larger."""
        return float(mujoco.mj_geomDistance(self._engine.model, self._engine.data, *pair, most, None))


def _listed(names: Collection[str]) -> str:
    """Return some names in words."""
    first = sorted(names)[:3]
    return ", ".join(first) + (" …" if len(names) > len(first) else "") or "none"
