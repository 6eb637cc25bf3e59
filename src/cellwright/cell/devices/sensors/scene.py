"""The models that a logical camera can tell apart, and the boxes around them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.util.errors import UnknownNameError, UsageError
from cellwright.util.pose import Pose


@dataclass(frozen=True, slots=True)
class SceneModel:
    """A model in the scene.

    Attributes:
        name: full model name (`bin7|piston_rod_part_3`, `agv1`, `kit_tray_1`).
        type: its type (`piston_rod_part`, `agv1`, `kit_tray`).
        body: id of the body whose frame is the model's.
        geoms: ids of its collision geoms.
        nested_in: name of the model that it is nested in, if it is.
    """

    name: str
    type: str
    body: int
    geoms: tuple[int, ...]
    nested_in: str | None = None

    @property
    def short_name(self) -> str:
        """The name without what comes before its last `|`: `piston_rod_part_3`."""
        return self.name.rpartition("|")[2]


def body_poses(data: mujoco.MjData, bodies: NDArray[np.intp]) -> list[Pose]:
    """world_T_body of some bodies, as of the engine's last look at where they are."""
    poses = zip(data.xpos[bodies].tolist(), data.xquat[bodies].tolist(), strict=True)
    return [Pose((x, y, z), (qw, qx, qy, qz)) for (x, y, z), (qw, qx, qy, qz) in poses]


def collision_geoms(model: mujoco.MjModel, body: int) -> tuple[int, ...]:
    """Ids of the geoms of a body, and of all bodies that hang on it, that can touch anything."""
    bodies = {body}
    for child in range(body + 1, model.nbody):  # the engine numbers parents before children
        if int(model.body_parentid[child]) in bodies:
            bodies.add(child)
    touching = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    return tuple(int(geom) for geom in np.flatnonzero(touching) if int(model.geom_bodyid[geom]) in bodies)


class Scene:
    """All models, and the boxes around them as of a moment that was kept: cameras that look in one tick share the work.

    A moment is the engine's `qpos`. Looking at one leaves the engine's data as they are.

    Args:
        model: the engine's model.
        data: the engine's data.
        models: every model that a camera may see.
        own_types: part types that this cell has besides those that every camera knows.

    Raises:
        UsageError: two models of one name, or a model without a collision geom.
        UnknownNameError: a model nested in none of these.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        models: Sequence[SceneModel],
        own_types: Collection[str] = (),
    ) -> None:
        self.models = tuple(models)
        self.own_types = frozenset(own_types)
        self._data = data
        self._looked_at = b""
        self._there = mujoco.MjData(model)
        places: dict[str, int] = {}
        for index, each in enumerate(self.models):
            if each.name in places:
                raise UsageError(f"there are two models named {each.name!r} in the scene")
            if not each.geoms:
                raise UsageError(f"the model {each.name!r} has no collision geom to see")
            places[each.name] = index
        for each in self.models:
            if each.nested_in is not None and each.nested_in not in places:
                raise UnknownNameError("model", each.nested_in, places)
        self.nested_in = np.array(
            [places[each.name if each.nested_in is None else each.nested_in] for each in self.models],
            dtype=np.intp,
        )
        """Index of the model that each is nested in; its own index for those that are not. Shape (n,)."""
        self._bodies = np.array([each.body for each in self.models], dtype=np.intp)
        self._geoms = np.array([geom for each in self.models for geom in each.geoms], dtype=np.intp)
        self._firsts = np.cumsum([0, *(len(each.geoms) for each in self.models[:-1])])
        self._local_centres = model.geom_aabb[self._geoms, :3]
        self._local_halves = model.geom_aabb[self._geoms, 3:]
        types = model.geom_type[self._geoms]
        self._cylinders = np.flatnonzero(types == mujoco.mjtGeom.mjGEOM_CYLINDER)
        self._balls = np.flatnonzero(np.isin(types, (mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_ELLIPSOID)))
        self._model = model
        self._boxes = (np.empty((0, 3)), np.empty((0, 3)))

    def moment(self) -> bytes:
        """The positions of all joints now, as bytes; `poses` and `boxes` take them then or later."""
        return bytes(self._data.qpos)

    def poses(self, indices: NDArray[np.intp], moment: bytes | None = None) -> list[Pose]:
        """`world_T_model` of some models at a moment; now if there is none given."""
        self._look_at(moment)
        return body_poses(self._there, self._bodies[indices])

    def boxes(self, moment: bytes | None = None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Middle and half size of the box along the world's axes around each model [m], both of shape (n, 3).

        They are those of a moment; now if there is none given. They are exact for boxes, cylinders, balls and the own
        boxes of meshes.
        """
        self._look_at(moment)
        return self._boxes

    def _look_at(self, moment: bytes | None) -> None:
        moment = self.moment() if moment is None else moment
        if self._looked_at != moment:
            self._looked_at = moment
            self._there.qpos[:] = np.frombuffer(moment)
            mujoco.mj_kinematics(self._model, self._there)
            if self.models:
                self._boxes = self._compute()

    def _compute(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        rotations = self._there.geom_xmat[self._geoms].reshape(-1, 3, 3)
        centres = self._there.geom_xpos[self._geoms] + np.einsum("gij,gj->gi", rotations, self._local_centres)
        spans = np.abs(rotations) * self._local_halves[:, None, :]
        x, y, z = spans[..., 0], spans[..., 1], spans[..., 2]
        # along a world axis a box reaches |x|+|y|+|z|; a disc, where it is round, only the root of the squares
        halves = x + y + z
        if (some := self._cylinders).size:
            halves[some] = np.hypot(x[some], y[some]) + z[some]
        if (some := self._balls).size:
            halves[some] = np.hypot(np.hypot(x[some], y[some]), z[some])
        lower = np.minimum.reduceat(centres - halves, self._firsts)
        upper = np.maximum.reduceat(centres + halves, self._firsts)
        return (lower + upper) / 2, (upper - lower) / 2
