"""Clearance of the kitter's arm: the distance of its links and its load to the cell and to each other, along a path."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.clients.agents.kitter.part_figures import PartFigures
from cellwright.motion import Joints, link_poses
from cellwright.util.pose import Pose

CLEARANCE = 0.010
"""Least distance [m] that every motion keeps, but for what it means to touch."""

PLANNED_CLEARANCE = 0.014
"""Least distance [m] of places that are chosen: the servos need some of it."""

_GRIPPER, _LOAD, _RAIL = "vacuum_gripper_link", "load", "linear_arm_actuator"
_ARM, _CELL, _BEAM = 1, 2, 4
"""Bits of contact: links and load, the cell, and the beam of the rail, which carries the lowest links."""

_AXES = ((0, 1, 0), (0, 0, 1), (0, 1, 0), (0, 1, 0), (0, 1, 0), (0, 0, 1), (0, 1, 0))
"""Axes of the joints in the frames of the links that they move, from the rail on."""

_LEVEL = 0.7
"""Vertical part of a contact's normal from which it is with a surface that things lie on, and not with a wall."""

Array: TypeAlias = "NDArray[np.float64]"

_STEPS = np.array((0.05, 0.1, 0.06, 0.06, 0.15, 0.15, 0.3))
"""Largest motion of each joint [m for the rail; rad] between two places of a path that are looked at: about 5 cm."""


class Load(NamedTuple):
    """A part on the cup."""

    kind: PartFigures
    gripper_T_part: Pose


class Obstacle(NamedTuple):
    """The nearest obstacle on a path: its distance [m], and what comes near to what."""

    distance: float
    moving: str
    other: str

    def __str__(self) -> str:
        return f"{self.moving} would come within {max(0.0, self.distance) * 1e3:.0f} mm of {self.other}"


class Clearance:
    """Distances between arm, load and cell, by the shapes that the cell describes.

    Args:
        solids: shapes by frame, as `Client.solids` returns them.
        arm_T_world: pose of the world in the arm's frame.
    """

    def __init__(self, solids: Mapping[str, Sequence[Mapping[str, Any]]], arm_T_world: Pose) -> None:
        self._solids = solids
        self._arm_T_world = arm_T_world
        self._links = [name for name in solids if name != "world"]
        self._loads: list[PartFigures] = []
        self._build()

    def obstacle(
        self,
        path: Iterable[Sequence[float]],
        load: Load | None = None,
        *,
        touches: bool = False,
        least: float = CLEARANCE,
    ) -> Obstacle | None:
        """Return the first obstacle nearer than `least` [m] at places of a path; None if there is none.

        With `touches` the path goes to a part or puts one down: cup and load may come near to what lies below them.
        """
        if load is not None and load.kind not in self._loads:
            self._loads.append(load.kind)
            self._build()
        for kind, body in self._load_bodies.items():
            is_held = load is not None and kind == load.kind
            if load is not None and is_held:
                self._model.body_pos[body] = load.gripper_T_part.position
                self._model.body_quat[body] = load.gripper_T_part.quaternion
            first = self._model.body_geomadr[body]
            self._model.geom_conaffinity[first : first + len(kind.outline)] = _CELL | _BEAM | _ARM if is_held else 0
        for joints in path:
            found = self._nearest(joints, least, touches=touches)
            if found is not None:
                return found
        return None

    def _nearest(self, joints: Sequence[float], least: float, *, touches: bool) -> Obstacle | None:
        model, data = self._model, self._data
        data.qpos[:] = joints
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        # The shapes have a margin: the engine reports those within it before they touch, with their distance.
        for contact in data.contact[: data.ncon] if data.ncon else ():
            if contact.dist >= least:
                continue
            names = [self._names[geom] for geom in contact.geom]
            # The cup may only meet what is below it: the normal of such a contact is nearly vertical.
            is_meant = _LOAD in names or (_GRIPPER in names and abs(contact.frame[2]) > _LEVEL)
            if touches and is_meant:
                continue
            return Obstacle(float(contact.dist), *sorted(names, key=lambda name: name not in (*self._links, _LOAD)))
        return None

    def _build(self) -> None:
        """Make a model of the cell around the chain of the arm's links; its positions are those of the joints."""
        spec = mujoco.MjSpec()
        names: dict[str, str] = {}
        for each in self._solids["world"]:
            here = _in_frame(self._arm_T_world, each)
            names[_add(spec, spec.worldbody, here, _BEAM if here["body"] == _RAIL else _CELL, 0)] = here["body"]
        parent, world_T_parent = spec.worldbody, Pose()
        axes = dict(zip(self._links, _AXES, strict=False))
        for name, world_T_link in link_poses(Joints(*(0.0,) * 7)).items():
            parent_T_link = world_T_parent.inverse() @ world_T_link
            parent = parent.add_body(name=name, pos=parent_T_link.position, quat=parent_T_link.quaternion)
            world_T_parent = world_T_link
            if name in axes:
                is_rail = name == self._links[0]
                kind = mujoco.mjtJoint.mjJNT_SLIDE if is_rail else mujoco.mjtJoint.mjJNT_HINGE
                parent.add_joint(type=kind, axis=axes[name])
            reach = _ARM | _CELL | (0 if name in self._links[:2] else _BEAM)
            for shape in self._solids[name]:
                names[_add(spec, parent, shape, _ARM, reach)] = name
        for number, kind in enumerate(self._loads):
            body = parent.add_body(name=f"{_LOAD}{number}")
            for disc in kind.outline:
                size = [disc.radius, kind.height / 2]
                place = [disc.x, disc.y, kind.top - kind.height / 2]
                shape = {"type": "cylinder", "size": size, "position": place, "quaternion": [1.0, 0.0, 0.0, 0.0]}
                names[_add(spec, body, shape, 0, _CELL | _BEAM | _ARM)] = _LOAD
            spec.add_exclude(bodyname1=body.name, bodyname2="wrist_2_link")
        # The engine leaves out parent and child; links two joints apart meet at the short link between them.
        for one, other in zip(self._links, self._links[2:], strict=False):
            spec.add_exclude(bodyname1=one, bodyname2=other)
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._names = [names[self._model.geom(number).name] for number in range(self._model.ngeom)]
        self._load_bodies = {kind: self._model.body(f"{_LOAD}{each}").id for each, kind in enumerate(self._loads)}


def _in_frame(frame_T_world: Pose, shape: Mapping[str, Any]) -> dict[str, Any]:
    """Return a shape of the world in another frame."""
    px, py, pz = shape["position"]
    w, x, y, z = shape["quaternion"]
    pose = frame_T_world @ Pose((px, py, pz), (w, x, y, z))
    return {**shape, "position": pose.position, "quaternion": pose.quaternion}


def _add(spec: Any, body: Any, shape: Mapping[str, Any], contype: int, conaffinity: int) -> str:
    """Add a shape to a body of a model specification; return its name there."""
    size = [*(shape["size"] or (1.0, 1.0, 1.0)), 0.0, 0.0][:3]
    geom = body.add_geom(name=f"shape{len(spec.geoms)}", size=size, margin=PLANNED_CLEARANCE)
    geom.type = getattr(mujoco.mjtGeom, f"mjGEOM_{shape['type'].upper()}")
    geom.pos, geom.quat = shape["position"], shape["quaternion"]
    geom.contype, geom.conaffinity = contype, conaffinity
    if shape["type"] == "mesh":
        vertices = [coordinate for vertex in shape["vertices"] for coordinate in vertex]
        mesh = spec.add_mesh(name=f"mesh{len(spec.meshes)}", uservert=vertices)
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
        geom.meshname = mesh.name
    return str(geom.name)


def places_along(path: Sequence[Sequence[float]]) -> Array:
    """Return places of a path of joint positions, shape (n, 7), that are close enough to each other to look at.

    Both ends are among them.
    """
    knots = np.array(path, dtype=float)
    # A stretch gets as many steps as the joint needs that moves farthest, measured in its own steps.
    steps = np.max(np.abs(np.diff(knots, axis=0)) / _STEPS, axis=1, initial=0.0)
    marks = np.concatenate(([0.0], np.cumsum(steps)))
    places = np.linspace(0.0, marks[-1], max(2, math.ceil(marks[-1]) + 1))
    return np.stack([np.interp(places, marks, column) for column in knots.T], axis=1)
