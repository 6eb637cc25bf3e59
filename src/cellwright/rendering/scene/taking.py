"""A scene of the engine's model, and frames of what it does."""

from __future__ import annotations

from collections.abc import Callable, Collection

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.scene.colours import geom_colours
from cellwright.rendering.scene.frame import Frame
from cellwright.rendering.scene.scene import Form, Layer, Mesh, Scene, Shape
from cellwright.util.pose import Pose

_FORMS = {
    int(mujoco.mjtGeom.mjGEOM_PLANE): Form.PLANE,
    int(mujoco.mjtGeom.mjGEOM_SPHERE): Form.SPHERE,
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): Form.CAPSULE,
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): Form.ELLIPSOID,
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): Form.CYLINDER,
    int(mujoco.mjtGeom.mjGEOM_BOX): Form.BOX,
    int(mujoco.mjtGeom.mjGEOM_MESH): Form.MESH,
}


def _nobody() -> Collection[int]:
    return ()


class SceneTaker:
    """The scene of a model, and frames of its state.

    Args:
        model: a compiled model.
        name: what the scene is called.
        hidden: tells the engine's ids of bodies that are not there to be seen at the moment.
    """

    def __init__(
        self, model: mujoco.MjModel, *, name: str = "", hidden: Callable[[], Collection[int]] = _nobody
    ) -> None:
        moving = _moving_bodies(model)
        self._bodies = np.concatenate([[0], np.flatnonzero(moving)])
        self._index = {int(body): index for index, body in enumerate(self._bodies)}
        self._hidden = hidden
        self._newest = [-1], np.empty(0, np.bool_)  # bodies that were hidden last, and what was shown then
        self.scene = Scene(
            name=name,
            bodies=("world", *(model.body(body).name or f"body {body}" for body in self._bodies[1:])),
            shapes=tuple(_shapes(model, moving, self._index)),
            meshes=tuple(_mesh(model, number) for number in range(model.nmesh)),
        )

    def index(self, body: int) -> int:
        """Place in `Scene.bodies` of a body by the engine's id; 0 for what stands still."""
        return self._index.get(body, 0)

    def frame(self, data: mujoco.MjData, time: int) -> Frame:
        """Where the bodies are, as the data's `xpos` and `xquat` say (see `Simulation.refresh`), at `time` [ns]."""
        poses = np.empty((len(self._bodies), 7), np.float32)
        poses[:, :3] = data.xpos.take(self._bodies, axis=0)
        poses[:, 3:] = data.xquat.take(self._bodies, axis=0)
        return Frame(time, poses, self._shown())

    def _shown(self) -> NDArray[np.bool_]:
        """Which bodies are to be seen now: the same array as last time where that has not changed."""
        hidden, shown = list(self._hidden()), self._newest[1]
        if hidden != self._newest[0]:
            shown = np.ones(len(self._bodies), np.bool_)
            shown[[self._index[body] for body in hidden if body in self._index]] = False
            shown.flags.writeable = False
            self._newest = hidden, shown
        return shown


def _moving_bodies(model: mujoco.MjModel) -> NDArray[np.bool_]:
    """Which bodies may move (nbody,): those that hang on a joint, or on a body that is put where it belongs."""
    placed = model.body_mocapid[model.body_rootid] >= 0
    moving: NDArray[np.bool_] = (model.body_weldid != 0) | placed
    return moving


def _shapes(model: mujoco.MjModel, moving: NDArray[np.bool_], index: dict[int, int]) -> list[Shape]:
    still = mujoco.MjData(model)
    mujoco.mj_kinematics(model, still)
    colours = geom_colours(model)
    shapes = []
    for geom in range(model.ngeom):
        form = _FORMS.get(int(model.geom_type[geom]))
        if form is None or colours[geom, 3] <= 0.0:
            continue
        body = int(model.geom_bodyid[geom])
        if moving[body]:
            pose = Pose(tuple(model.geom_pos[geom].tolist()), tuple(model.geom_quat[geom].tolist()))
        else:  # what stands still has its place in the world
            quaternion = np.empty(4)
            mujoco.mju_mat2Quat(quaternion, still.geom_xmat[geom])
            w, x, y, z = quaternion.tolist()
            pose = Pose(tuple(still.geom_xpos[geom].tolist()), (w, x, y, z))
        shapes.append(
            Shape(
                body=index[body] if moving[body] else 0,
                form=form,
                size=tuple(model.geom_size[geom].tolist()),
                pose=pose,
                colour=tuple(colours[geom].tolist()),
                layer=_layer(int(model.geom_group[geom])),
                mesh=int(model.geom_dataid[geom]) if form is Form.MESH else None,
            )
        )
    return shapes


def _layer(group: int) -> Layer:
    """Why a geom is there, by its group; one of the engine's group 0, which nobody chose, is seen and touched."""
    return Layer(min(max(group, Layer.BOTH), Layer.MARK))


def _mesh(model: mujoco.MjModel, number: int) -> Mesh:
    first, count = int(model.mesh_vertadr[number]), int(model.mesh_vertnum[number])
    face, faces = int(model.mesh_faceadr[number]), int(model.mesh_facenum[number])
    return Mesh(
        np.array(model.mesh_vert[first : first + count], np.float32),
        np.array(model.mesh_face[face : face + faces], np.int32),
    )
