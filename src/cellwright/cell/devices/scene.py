"""Scene of logical cameras: models with the boxes around them, and the models in each camera's view."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.config.layout.layout import Carrier
from cellwright.engine.simulation import Simulation
from cellwright.util.pose import Pose, Vector3

_PLANES = 6
"""Number of planes of a frustum."""
_NOWHERE = 1e6
"""Coordinate of the box of a part that is not in play [m]."""
_ORIGIN = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


class Frustum:
    """Pyramid without its top, along the +x axis of a camera; +y is left and +z is up in its view.

    Its tip is the camera's origin. The planes lie at distances `near` and `far` from it [m]. The angle between the
    left and the right side is `horizontal_fov` [rad]. The width of the view over its height is `aspect`.
    """

    def __init__(self, world_T_camera: Pose, *, near: float, far: float, horizontal_fov: float, aspect: float) -> None:
        slope_y = math.tan(horizontal_fov / 2)
        slope_z = slope_y / aspect
        camera_normals = [
            (1.0, 0.0, 0.0),
            (-1.0, 0.0, 0.0),
            _unit((slope_y, 1.0, 0.0)),
            _unit((slope_y, -1.0, 0.0)),
            _unit((slope_z, 0.0, 1.0)),
            _unit((slope_z, 0.0, -1.0)),
        ]
        normals = np.array([world_T_camera.rotate(normal) for normal in camera_normals]).T
        self.offsets = np.array([near, -far, 0.0, 0.0, 0.0, 0.0]) + np.array(world_T_camera.position) @ normals
        """Offsets of its planes [m], shape (6,): a point p is on the inner side of one when normal . p >= offset."""
        self.bound_weights = np.concatenate([np.minimum(normals, 0.0), np.maximum(normals, 0.0)])
        """Weights of a box's bounds, shape (6, 6).

        (lower x, y, z, upper x, y, z) @ weights is normal . p for the point of the box that is furthest inside.
        """

    def meets(self, centres: NDArray[np.float64], halves: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return the mask of boxes in view: those that do not lie wholly behind any of its six planes. Shape (n,).

        This is the test of `gazebo::LogicalCamera`: nothing occludes anything. A box that lies outside across an edge
        of the view, in front of each single plane, counts as seen.

        Args:
            centres: middles of boxes along the world's axes [m], shape (n, 3).
            halves: half their sizes [m], shape (n, 3).
        """
        bounds = np.concatenate([centres - halves, centres + halves], axis=1)
        return np.asarray((bounds @ self.bound_weights >= self.offsets).all(axis=1))


def _unit(vector: Vector3) -> Vector3:
    x, y, z = vector
    length = math.hypot(x, y, z)
    return x / length, y / length, z / length


@dataclass(frozen=True, slots=True)
class SceneModel:
    """Model in the scene: its body has the model's frame, and its geoms are those that collide.

    Attributes:
        name: full model name (`bin7|piston_rod_part_3`, `agv1`, `kit_tray_1`).
        nested_in: name of the model that it is nested in, or None.
        tray: the carrier with its tray, if it is one.
    """

    name: str
    type: str
    body: int
    geoms: tuple[int, ...]
    nested_in: str | None = None
    tray: Carrier | None = None


def collision_geoms(model: mujoco.MjModel, body: int) -> tuple[int, ...]:
    """Return the ids of the colliding geoms of a body and of all bodies below it."""
    bodies = {body}
    # the engine numbers parents before children
    for child in range(body + 1, model.nbody):
        if int(model.body_parentid[child]) in bodies:
            bodies.add(child)
    touching = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    return tuple(int(geom) for geom in np.flatnonzero(touching) if int(model.geom_bodyid[geom]) in bodies)


class SeenModels(NamedTuple):
    """Models that a camera reports, in the order of the scene.

    Attributes:
        indices: their indices in the scene.
        poses: x, y, z [m] and quaternion (w, x, y, z) of each in the world, shape (n, 7).
    """

    indices: list[int]
    poses: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class StoredState:
    """State of a scene: the engine's model, the positions of all its joints, and the parts as they were then."""

    model: mujoco.MjModel
    qpos: bytes
    parts: tuple[tuple[str, int, bool], ...]

    def equals(self, other: StoredState | None) -> bool:
        """Return whether another state is the same."""
        return self is other or (other is not None and self.qpos == other.qpos and self.parts is other.parts)


class ModelSnapshot:
    """All models and their boxes in a stored state: cameras that measure in one tick share the work.

    Reading a state leaves the engine's data unchanged. Each model has a unique name and a colliding geom.

    Args:
        simulation: the simulation.
        models: the models in the scene, in their order.
        own_types: this cell's part types besides those that every camera knows.
        parts: returns name, body and visibility of those models that are parts, as `Parts.shown`. The body of another
            model stays. A part that is not in play is in no view.
    """

    def __init__(
        self,
        simulation: Simulation,
        models: Sequence[SceneModel],
        own_types: Collection[str] = (),
        parts: Callable[[], tuple[tuple[str, int, bool], ...]] = tuple,
    ) -> None:
        model = simulation.model
        self.models = tuple(models)
        self.own_types = frozenset(own_types)
        self._simulation = simulation
        self._parts = parts
        self._loaded: StoredState | None = None
        self._saved: StoredState | None = None
        self._stored = mujoco.MjData(model)
        self._stored_model = model
        self._geoms_of = {each.body: each.geoms for each in self.models}
        places = {each.name: index for index, each in enumerate(self.models)}
        self.nested_in = np.array(
            [places[each.name if each.nested_in is None else each.nested_in] for each in self.models], dtype=np.intp
        )
        """Index of the model that each is nested in, or its own index. Shape (n,)."""
        self._places = places
        self._arrange(self.save())
        self._counts = np.array([len(each.geoms) for each in self.models], dtype=np.intp)
        self._owners = np.repeat(np.arange(len(self.models)), self._counts)
        self._rows = np.split(np.arange(len(self._owners)), np.cumsum(self._counts)[:-1])
        self._local_centres = model.geom_aabb[self._geoms, None, :3]
        self._local_halves = model.geom_aabb[self._geoms, None, 3:]
        types = model.geom_type[self._geoms]
        self._is_round = (types == mujoco.mjtGeom.mjGEOM_CYLINDER)[:, None]
        self._is_ball = np.isin(types, (mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_ELLIPSOID))[:, None]
        welded = model.body_weldid[model.geom_bodyid[self._geoms]] == model.body_weldid[self._bodies[self._owners]]
        count = len(self.models)
        self._is_jointed = np.bincount(self._owners, ~welded, count) > 0
        # x, y, z and quaternion of each model
        self._poses = np.empty((count, 7))
        # lower and upper bound of each box
        self._bounds = np.empty((count, 6))
        self._boxes: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
        self._views, self._offsets = np.empty((6, 0)), np.empty(0)
        self._reported = self._in_view = np.empty((count, 0), dtype=np.bool_)
        self._seen: list[SeenModels] | None = None

    def save(self) -> StoredState:
        """Return the present state, which `poses`, `boxes` and `seen` accept then or later."""
        simulation, saved = self._simulation, self._saved
        qpos, parts = simulation.data.qpos.tobytes(), self._parts()
        # cameras that measure in one tick share a state
        if saved is None or saved.qpos != qpos or saved.parts is not parts or saved.model is not simulation.model:
            self._saved = saved = StoredState(simulation.model, qpos, parts)
        return saved

    def poses(self, indices: NDArray[np.intp], state: StoredState | None = None) -> list[Pose]:
        """Return `world_T_model` of some models in a stored state; None is now."""
        self._load(state)
        return [Pose((x, y, z), (qw, qx, qy, qz)) for x, y, z, qw, qx, qy, qz in self._poses[indices].tolist()]

    def boxes(self, state: StoredState | None = None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return middle and half size of the box along the world's axes around each model [m], both of shape (n, 3).

        They are those of a stored state; None is now. They are exact for boxes, cylinders, balls and the own boxes of
        meshes.
        """
        self._load(state)
        if self._boxes is None:
            lower, upper = self._bounds[:, :3], self._bounds[:, 3:]
            self._boxes = (lower + upper) / 2, (upper - lower) / 2
        return self._boxes

    def add_view(self, frustum: Frustum, reported: NDArray[np.bool_]) -> int:
        """Add a camera, and return its number for `seen`.

        Args:
            frustum: its view.
            reported: mask of the models that it reports, shape (n,).
        """
        self._views = np.column_stack([self._views, frustum.bound_weights])
        self._offsets = np.concatenate([self._offsets, frustum.offsets])
        self._reported = np.column_stack([self._reported, reported])
        self._in_view = np.zeros_like(self._reported)
        self._loaded = None
        return self._reported.shape[1] - 1

    def seen(self, view: int, state: StoredState | None = None) -> SeenModels:
        """Return the models that a camera reports in a stored state; None is now."""
        self._load(state)
        if self._seen is None:
            self._seen = self._find_seen()
        return self._seen[view]

    def _load(self, state: StoredState | None) -> None:
        loaded = self._loaded
        if state is not None and state.equals(loaded):
            return
        present = self.save()
        state = state or present
        if state.equals(loaded):
            return
        if state.equals(present):
            self._simulation.refresh()
            source = self._simulation.data
        else:
            if state.model is not self._stored_model:
                self._stored, self._stored_model = mujoco.MjData(state.model), state.model
            source = self._stored
            source.qpos[:] = np.frombuffer(state.qpos)
            mujoco.mj_kinematics(state.model, source)
        if loaded is None or state.parts is not loaded.parts:
            self._arrange(state)
        poses = np.concatenate([source.xpos.take(self._bodies, 0), source.xquat.take(self._bodies, 0)], axis=1)
        poses[self._absent] = _ORIGIN
        # most parts rest: only what moved since the state before is computed again
        is_moved = (poses != self._poses).any(axis=1) | self._is_jointed
        moved = is_moved.nonzero()[0] if loaded is not None else np.arange(len(self.models))
        self._loaded, self._poses = state, poses
        self._boxes = self._seen = None
        if moved.size:
            self._update(source, moved)

    def _arrange(self, state: StoredState) -> None:
        """Look up the bodies and the geoms that the models have in a state."""
        bodies = [each.body for each in self.models]
        for name, body, _ in state.parts:
            bodies[self._places[name]] = body
        for body in bodies:
            if body not in self._geoms_of:
                self._geoms_of[body] = collision_geoms(state.model, body)
        absent = [self._places[name] for name, _, is_shown in state.parts if not is_shown]
        self._absent = np.array(absent, dtype=np.intp)
        self._bodies = np.array(bodies, dtype=np.intp)
        self._geoms = np.array([geom for body in bodies for geom in self._geoms_of[body]], dtype=np.intp)

    def _update(self, source: mujoco.MjData, moved: NDArray[np.intp]) -> None:
        """Compute the bounds of some models, and the views that they are in."""
        rows = np.concatenate([self._rows[model] for model in moved.tolist()])
        geoms = self._geoms.take(rows)
        rotations = source.geom_xmat.take(geoms, 0).reshape(-1, 3, 3)
        centres = source.geom_xpos.take(geoms, 0) + (rotations * self._local_centres.take(rows, 0)).sum(axis=2)
        x, y, z = (np.abs(rotations) * self._local_halves.take(rows, 0)).T
        # along a world axis a box extends |x|+|y|+|z|; a disc, where it is round, only the root of the squares
        halves = np.where(self._is_round.take(rows), np.hypot(x, y), x + y) + z
        if (some := self._is_ball.take(rows)).any():
            halves = np.where(some, np.hypot(np.hypot(x, y), z), halves)
        counts = self._counts.take(moved)
        firsts = np.cumsum(counts) - counts
        self._bounds[moved] = np.concatenate(
            [np.minimum.reduceat(centres - halves.T, firsts), np.maximum.reduceat(centres + halves.T, firsts)], axis=1
        )
        self._bounds[self._absent] = _NOWHERE
        bounds = self._bounds.take(moved, 0)
        inside = (bounds @ self._views >= self._offsets).reshape(len(bounds), -1, _PLANES)
        self._in_view[moved] = inside.all(axis=2)

    def _find_seen(self) -> list[SeenModels]:
        """Find what each camera reports."""
        views, models = (self._in_view[self.nested_in] & self._reported).T.nonzero()
        poses = self._poses[models]
        ends = np.searchsorted(views, np.arange(self._reported.shape[1] + 1)).tolist()
        indices = models.tolist()
        return [SeenModels(indices[begin:end], poses[begin:end]) for begin, end in pairwise(ends)]
