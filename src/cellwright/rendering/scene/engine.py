"""Scenes from MuJoCo models and visuals, and MuJoCo models from scenes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from operator import itemgetter
from types import MappingProxyType
from typing import Any, Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.engine.shapes import Visuals
from cellwright.middleware.bus import Node
from cellwright.rendering.camera import Camera
from cellwright.rendering.scene.scene import SEEN, Mesh, Scene, SceneFrame, SceneShape, ShapeLayer, ShapeType
from cellwright.rendering.views import gear2017_views
from cellwright.util.pose import Pose

_TYPES = {
    ShapeType.PLANE: mujoco.mjtGeom.mjGEOM_PLANE,
    ShapeType.SPHERE: mujoco.mjtGeom.mjGEOM_SPHERE,
    ShapeType.CAPSULE: mujoco.mjtGeom.mjGEOM_CAPSULE,
    ShapeType.ELLIPSOID: mujoco.mjtGeom.mjGEOM_ELLIPSOID,
    ShapeType.CYLINDER: mujoco.mjtGeom.mjGEOM_CYLINDER,
    ShapeType.BOX: mujoco.mjtGeom.mjGEOM_BOX,
    ShapeType.MESH: mujoco.mjtGeom.mjGEOM_MESH,
}
_FORMS = {int(kind): form for form, kind in _TYPES.items()}
_OUT_OF_SIGHT = (0.0, 0.0, -1000.0)  # [m]


class DrawnNode(Node, Protocol):
    """Node that is seen: a cell, a robot or a recording."""

    @property
    def drawn(self) -> tuple[mujoco.MjModel, Visuals]:
        """Model whose shapes are drawn, with the bodies of the simulation's, and more shapes on these bodies."""

    @property
    def views(self) -> Mapping[str, Camera]:
        """Named views of a cell; none of a robot."""

    def scene_parts(self) -> tuple[tuple[str, int, bool], ...]:
        """Return name, engine's body and visibility of each part of a cell; see `SceneCapture`."""


class SceneCapture:
    """Capture of a model: its scene, and frames of its state.

    Args:
        model: the engine's model.
        visuals: shapes that are only seen, on the model's bodies; None if there are none.
        name: name of the scene.
        views: named views of a cell.
        parts: returns the parts of a cell as they are now: of each its name, the engine's body that it has, and whether
            it is shown. A hidden part may name any body that looks like it; its pose is the world's origin. Names and
            order stay, and the tuple is the same object until something changes. The parts are the last bodies of the
            model and of the scene.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        visuals: Visuals | None = None,
        *,
        name: str = "",
        views: Mapping[str, Camera] = MappingProxyType({}),
        parts: Callable[[], tuple[tuple[str, int, bool], ...]] = tuple,
    ) -> None:
        # bodies on a joint, and mocap bodies with what is fixed to them
        moving = (model.body_weldid != 0) | (model.body_mocapid[model.body_rootid] >= 0)
        bodies = np.concatenate([[0], np.flatnonzero(moving)])
        self._parts, self._newest = parts, parts()
        first = min((body for _, body, _ in self._newest), default=model.nbody)
        self._own = bodies[bodies < first]
        self._index = {int(body): index for index, body in enumerate(self._own)}
        self._bodies, self._shown = self._arrange()
        names = (model.body(body).name or f"body {body}" for body in self._own[1:])
        shapes = _shapes(model, visuals or Visuals(), moving, {int(body): index for index, body in enumerate(bodies)})
        of_body: dict[int, list[SceneShape]] = defaultdict(list)
        for shape in shapes:
            of_body[int(bodies[shape.body])].append(shape)
        parts_shapes = (
            replace(shape, body=index)
            for index, (_, body, _) in enumerate(self._newest, len(self._own))
            for shape in of_body[body]
        )
        self.scene = Scene(
            name=name,
            bodies=("world", *names, *(name for name, _, _ in self._newest)),
            shapes=(*(shape for shape in shapes if shape.body < len(self._own)), *parts_shapes),
            meshes=_meshes(model, visuals or Visuals()),
            # readers know those of 2017, whose recordings name none
            views={} if not views or views == gear2017_views() else dict(views),
        )

    @classmethod
    def of(cls, node: DrawnNode) -> SceneCapture:
        """Return the capture of a cell or a robot."""
        return cls(*node.drawn, name=node.name, views=node.views, parts=node.scene_parts)

    def index(self, body: int) -> int:
        """Return the index in `Scene.bodies` of a body by the engine's id; 0 for a static one and for a part."""
        return self._index.get(body, 0)

    def frame(self, data: mujoco.MjData, time: int) -> SceneFrame:
        """Return the poses of the data's `xpos` and `xquat` (see `Simulation.refresh`) as a frame at `time` [ns]."""
        if (parts := self._parts()) is not self._newest:
            self._newest = parts
            self._bodies, self._shown = self._arrange()
        poses = np.empty((len(self._bodies), 7), np.float32)
        poses[:, :3] = data.xpos.take(self._bodies, axis=0)
        poses[:, 3:] = data.xquat.take(self._bodies, axis=0)
        return SceneFrame(time, poses, self._shown)

    def _arrange(self) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
        """Return the engine's body for each body of the scene, 0 where it is hidden; and flags of those shown."""
        shown = np.array([True] * len(self._own) + [is_shown for _, _, is_shown in self._newest])
        shown.flags.writeable = False
        bodies = np.array([*self._own, *(body for _, body, _ in self._newest)], np.intp)
        return np.where(shown, bodies, 0), shown


def _shapes(
    model: mujoco.MjModel, visuals: Visuals, moving: NDArray[np.bool_], index: dict[int, int]
) -> tuple[SceneShape, ...]:
    """Return the shapes of the model and its visuals, body by body."""
    found: list[tuple[int, SceneShape]] = []
    for geom in range(model.ngeom):
        body, form = int(model.geom_bodyid[geom]), _FORMS.get(int(model.geom_type[geom]))
        if form is not None:
            shape = SceneShape(
                body=index.get(body, 0),
                form=form,
                size=tuple(model.geom_size[geom].tolist()),
                pose=_pose(model.geom_pos[geom], model.geom_quat[geom]),
                colour=tuple(model.geom_rgba[geom].tolist()),
                # the layer is the geom's group; the engine's default group 0 counts as seen and touched
                layer=ShapeLayer(min(max(int(model.geom_group[geom]), ShapeLayer.BOTH), ShapeLayer.MARK)),
                mesh=int(model.geom_dataid[geom]) if form is ShapeType.MESH else None,
            )
            found.append((body, shape))
    meshes = {name: model.nmesh + number for number, name in enumerate(visuals.meshes)}
    bodies = {name: int(model.body(name).id) for name, _ in visuals.shapes}
    for name, seen in visuals.shapes:
        body, mesh = bodies[name], meshes[seen.mesh] if seen.kind == "mesh" else None
        form, layer = ShapeType(seen.kind), ShapeLayer.LOOKS
        found.append((body, SceneShape(index.get(body, 0), form, seen.size, seen.pose, seen.colour, layer, mesh)))
    found.sort(key=itemgetter(0))
    still = mujoco.MjData(model)
    mujoco.mj_kinematics(model, still)
    frames = [None if moving[body] else _pose(still.xpos[body], still.xquat[body]) for body in range(model.nbody)]
    return tuple(
        shape  # static shapes are in the world
        if (frame := frames[body]) is None
        else replace(shape, pose=frame @ shape.pose, static_body=model.body(body).name or f"body {body}")
        for body, shape in found
        if shape.colour[3] > 0.0
    )


def _pose(position: NDArray[np.float64], quaternion: NDArray[np.float64]) -> Pose:
    return Pose(tuple(position.tolist()), tuple(quaternion.tolist()))


def _meshes(model: mujoco.MjModel, visuals: Visuals) -> tuple[Mesh, ...]:
    """Return the meshes of the model, and behind them those of the visuals."""
    found = []
    for number in range(model.nmesh):
        first, count = int(model.mesh_vertadr[number]), int(model.mesh_vertnum[number])
        face, faces = int(model.mesh_faceadr[number]), int(model.mesh_facenum[number])
        found.append((model.mesh_vert[first : first + count], model.mesh_face[face : face + faces]))
    found += visuals.meshes.values()
    return tuple(Mesh(np.array(vertices, np.float32), np.array(faces, np.int32)) for vertices, faces in found)


class EngineScene:
    """Model and data that show a scene.

    Args:
        scene: the scene.
        layers: layers of the shapes to include.
        prepare: changes the engine's specification before it is compiled.

    Attributes:
        model: the model, with a body for each of the scene's, in their order.
        data: its state, from the last frame.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        layers: Collection[ShapeLayer] = SEEN,
        prepare: Callable[[Any], None] = lambda _spec: None,
    ) -> None:
        spec = mujoco.MjSpec()
        spec.modelname = scene.name
        for number, mesh in enumerate(scene.meshes):
            spec.add_mesh(
                name=f"mesh {number}",
                uservert=mesh.vertices.reshape(-1),
                userface=mesh.faces.reshape(-1),
                inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,  # flat and open surfaces have no volume
            )
        bodies: list[Any] = [spec.worldbody]
        bodies += [spec.worldbody.add_body(name=f"{index}", mocap=True) for index in range(1, len(scene.bodies))]
        for shape in scene.shapes:
            if shape.layer not in layers:
                continue
            geom = bodies[shape.body].add_geom(
                type=_TYPES[shape.form],
                size=shape.size,
                pos=shape.pose.position,
                quat=shape.pose.quaternion,
                rgba=shape.colour,
                group=int(shape.layer),
                contype=0,
                conaffinity=0,
            )
            if shape.mesh is not None:
                geom.meshname = f"mesh {shape.mesh}"
        prepare(spec)
        self.model: Any = spec.compile()
        self.data: Any = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)

    def show(self, frame: SceneFrame) -> None:
        """Move the bodies to a frame's poses, and hidden ones far away."""
        poses = np.where(frame.shown[:, None], frame.poses[:, :3], _OUT_OF_SIGHT)
        self.data.mocap_pos[:] = poses[1:]
        self.data.mocap_quat[:] = frame.poses[1:, 3:]
        mujoco.mj_kinematics(self.model, self.data)
