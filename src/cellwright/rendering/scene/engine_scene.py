"""A scene as a model of the engine, to be drawn: bodies that are put where a frame says, and nothing that touches."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import mujoco
import numpy as np

from cellwright.rendering.scene.frame import Frame
from cellwright.rendering.scene.scene import SEEN, Form, Layer, Scene

_TYPES = {
    Form.PLANE: mujoco.mjtGeom.mjGEOM_PLANE,
    Form.SPHERE: mujoco.mjtGeom.mjGEOM_SPHERE,
    Form.CAPSULE: mujoco.mjtGeom.mjGEOM_CAPSULE,
    Form.ELLIPSOID: mujoco.mjtGeom.mjGEOM_ELLIPSOID,
    Form.CYLINDER: mujoco.mjtGeom.mjGEOM_CYLINDER,
    Form.BOX: mujoco.mjtGeom.mjGEOM_BOX,
    Form.MESH: mujoco.mjtGeom.mjGEOM_MESH,
}
_OUT_OF_SIGHT = (0.0, 0.0, -1000.0)  # [m]


class EngineScene:
    """A model and its data that show a scene.

    Args:
        scene: what is to be seen.
        layers: which of its shapes.

    Attributes:
        model: the model, with a body of its own for each of the scene's, in their order.
        data: its state, as the last frame said.
    """

    def __init__(self, scene: Scene, *, layers: Collection[Layer] = SEEN) -> None:
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
        used: list[int] = []
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
                used.append(shape.mesh)
        self.model: Any = spec.compile()
        self.data: Any = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)

    def show(self, frame: Frame) -> None:
        """Put the bodies where a frame says; those that are not shown out of sight."""
        poses = np.where(frame.shown[:, None], frame.poses[:, :3], _OUT_OF_SIGHT)
        self.data.mocap_pos[:] = poses[1:]
        self.data.mocap_quat[:] = frame.poses[1:, 3:]
        mujoco.mj_kinematics(self.model, self.data)
