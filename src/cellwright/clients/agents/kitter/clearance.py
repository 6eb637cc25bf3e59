"""Clearance of the kitter's arm: the distance of its links and its load to the cell and to each other, along a path."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, Protocol, TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.clients.agents.kitter.part_figures import PartFigures
from cellwright.motion.chain import Chain
from cellwright.motion.solver import Vector
from cellwright.util.pose import Pose

CLEARANCE = 0.010
"""Least distance [m] that every motion keeps, but for what it means to touch."""

PLANNED_CLEARANCE = 0.014
"""Least distance [m] of places that are chosen: the servos need some of it."""

ARMS_APART = 0.05
"""Least distance [m] to other arms, unless the cell wants more."""

SERVOS = 0.005
"""Part of the distance to other arms that the servos need [m]."""

CUP_FACE = 0.005
"""Distance [m] of the cup's face below the gripper link."""

_LOAD = "load"
_ARM, _CELL, _CARRIER = 1, 2, 4
"""Bits of contact: links and load, the cell, and what carries the arm, which its lowest links touch."""

_LEVEL = 0.7
"""Vertical part of a contact's normal from which it is with a surface that things lie on, and not with a wall."""

Array: TypeAlias = "NDArray[np.float64]"


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


class Body(Protocol):
    """Figures of an arm for its distances; attributes as of `ArmFigures`."""

    @property
    def gripper(self) -> str:
        """Name of the link of the cup."""
        ...

    @property
    def home(self) -> Vector:
        """A posture in which no link hits another."""
        ...

    @property
    def carriers(self) -> frozenset[str]:
        """Names of the bodies that carry it."""
        ...


class Standing(Protocol):
    """Place of an arm, and its figures; see `Postures`."""

    @property
    def figures(self) -> Body:
        """Its figures."""
        ...

    @property
    def world_T_frame(self) -> Pose:
        """Pose of the frame of postures in the world."""
        ...

    @property
    def frame_T_base(self) -> Pose:
        """Pose of the frame of its mount."""
        ...


class Clearance:
    """Distances between arm, load and cell, by the shapes that the cell describes.

    Args:
        solids: shapes by frame, as `Client.solids` returns them.
        chain: the arm, from the frame of its mount to its cup, as `Client.chains` returns it.
        postures: its place and its figures, such as a kitter's postures.
        others: other arms, whose homes are kept free, as chains with their postures.
        apart: least distance to them [m].
    """

    def __init__(
        self,
        solids: Mapping[str, Sequence[Mapping[str, Any]]],
        chain: Chain,
        postures: Standing,
        others: Iterable[tuple[Chain, Standing]] = (),
        apart: float = ARMS_APART,
    ) -> None:
        self._solids = solids
        self._apart = apart + SERVOS
        self._standing = [shape for each in others for shape in _standing(solids, *each)]
        self._others = {shape["body"] for shape in self._standing}
        self._chain = chain
        self._postures = postures
        self._gripper = postures.figures.gripper
        self._links = [name for name in solids if name in chain.links]
        # The engine leaves out parent and child; links two joints apart meet at the short link between them.
        self._joined = {*zip(self._links, self._links[2:], strict=False)}
        self._loads: list[PartFigures] = []
        self._build()
        near = self._near_each_other(postures.figures.home)
        if near:
            self._joined |= near
            self._build()

    def obstacle(
        self,
        path: Iterable[Sequence[float]],
        load: Load | None = None,
        *,
        touches: bool = False,
        least: float = CLEARANCE,
    ) -> Obstacle | None:
        """Return the nearest obstacle of the first place of a path that has one within `least` [m]; None without one.

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
            self._model.geom_conaffinity[first : first + len(kind.outline)] = _CELL | _CARRIER | _ARM if is_held else 0
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
        near = np.flatnonzero(data.contact.dist < max(least, self._apart)) if data.ncon else np.zeros(0, np.intp)
        for row in near[np.argsort(data.contact.dist[near], kind="stable")].tolist() if len(near) else ():
            contact = data.contact[row]
            names = self._names_of(contact)
            if names[1] in self._others:
                return Obstacle(float(contact.dist), *names)
            if contact.dist >= least:
                continue
            # The cup may only meet what is below it: the normal of such a contact is nearly vertical.
            is_meant = _LOAD in names or (self._gripper in names and abs(contact.frame[2]) > _LEVEL)
            if touches and is_meant:
                continue
            return Obstacle(float(contact.dist), *names)
        return None

    def _near_each_other(self, home: Sequence[float]) -> set[tuple[str, str]]:
        """Return the links that are near each other at home, or near what carries the arm: each with the other."""
        self._data.qpos[:] = home
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_collision(self._model, self._data)
        own = (*self._links, *self._postures.figures.carriers)
        pairs = [self._names_of(contact) for contact in self._data.contact[: self._data.ncon]]
        return {(one, other) for one, other in pairs if one in own and other in own}

    def _names_of(self, contact: Any) -> tuple[str, str]:
        """Return what comes near to what, a link or the load first."""
        one, other = (self._names[geom] for geom in contact.geom)
        return (one, other) if one in (*self._links, _LOAD) else (other, one)

    def _build(self) -> None:
        """Make a model of the cell around the chain of the arm's links; its positions are those of the joints."""
        spec = mujoco.MjSpec()
        names: dict[str, str] = {}
        frame_T_world, carriers = self._postures.world_T_frame.inverse(), self._postures.figures.carriers
        for each in self._solids["world"]:
            here = _in_frame(frame_T_world, each)
            bit = _CARRIER if here["body"] in carriers else _CELL
            names[add_shape(spec, spec.worldbody, here, bit, 0)] = here["body"]
        for each in self._standing:
            names[add_shape(spec, spec.worldbody, each, _CELL, 0, self._apart)] = each["body"]
        # the lowest links are those that a rail and the first joint behind it move
        lowest = 2 if self._chain.joints[0].is_prismatic else 1
        standing = {one for one, other in self._joined if other in carriers}
        for number, name, link in add_chain(spec, self._chain, self._postures.frame_T_base):
            touched = _ARM | _CELL | (0 if number <= lowest or name in standing else _CARRIER)
            for shape in self._solids.get(name, ()):
                names[add_shape(spec, link, shape, _ARM, touched)] = name
            if name == self._gripper:
                self._add_loads(spec, link, names)
        for one, other in self._joined:
            if other in self._links:
                spec.add_exclude(bodyname1=one, bodyname2=other)
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._names = [names[self._model.geom(number).name] for number in range(self._model.ngeom)]
        self._load_bodies = {kind: self._model.body(f"{_LOAD}{each}").id for each, kind in enumerate(self._loads)}

    def _add_loads(self, spec: Any, gripper: Any, names: dict[str, str]) -> None:
        """Add a body to the gripper for each kind of load."""
        for number, kind in enumerate(self._loads):
            body = gripper.add_body(name=f"{_LOAD}{number}")
            for disc in kind.outline:
                size = [disc.radius, kind.height / 2]
                place = [disc.x, disc.y, kind.top - kind.height / 2]
                shape = {"type": "cylinder", "size": size, "position": place, "quaternion": [1.0, 0.0, 0.0, 0.0]}
                names[add_shape(spec, body, shape, 0, _CELL | _CARRIER | _ARM)] = _LOAD


def below_cup(solids: Mapping[str, Sequence[Mapping[str, Any]]], chain: Chain, gripper: str) -> tuple[float, str]:
    """Return by how much another link of the hand reaches below the cup's face, at most [m], and its name."""
    links = {name: link for name, link in chain.links.items() if link.joints == len(chain.joints)}
    gripper_T_hand = links[gripper].pose.inverse()
    found = [
        (-_lowest(_in_frame(gripper_T_hand @ link.pose, shape)) - CUP_FACE, name)
        for name, link in links.items()
        if name != gripper
        for shape in solids.get(name, ())
    ]
    return max(found, default=(-math.inf, gripper))


def _lowest(shape: Mapping[str, Any]) -> float:
    """Return the height [m] of the lowest point of a shape in its frame."""
    pose, size = Pose(shape["position"], shape["quaternion"]), shape["size"]
    # directions of the shape's axes along the vertical one of the frame
    x, y, z = pose.inverse().rotate((0.0, 0.0, 1.0))
    match shape["type"]:
        case "mesh":
            return min(pose.transform(vertex)[2] for vertex in shape["vertices"])
        case "box":
            reach = abs(x) * size[0] + abs(y) * size[1] + abs(z) * size[2]
        case "ellipsoid":
            reach = math.hypot(x * size[0], y * size[1], z * size[2])
        case "sphere":
            reach = size[0]
        case "capsule":
            reach = size[0] + abs(z) * size[1]
        case _:  # a cylinder
            reach = math.hypot(x, y) * size[0] + abs(z) * size[1]
    return float(pose.position[2] - reach)


def _in_frame(frame_T_world: Pose, shape: Mapping[str, Any]) -> dict[str, Any]:
    """Return a shape of the world in another frame."""
    px, py, pz = shape["position"]
    w, x, y, z = shape["quaternion"]
    pose = frame_T_world @ Pose((px, py, pz), (w, x, y, z))
    return {**shape, "position": pose.position, "quaternion": pose.quaternion}


def _standing(
    solids: Mapping[str, Sequence[Mapping[str, Any]]], chain: Chain, postures: Standing
) -> Iterator[dict[str, Any]]:
    """Yield the shapes of an arm at home, in the frame of the kitter."""
    for name, base_T_link in chain.link_poses(postures.figures.home).items():
        for shape in solids.get(name, ()):
            yield {**_in_frame(postures.frame_T_base @ base_T_link, shape), "body": name}


def add_chain(spec: Any, chain: Chain, base: Pose) -> Iterator[tuple[int, str, Any]]:
    """Add a chain to a model specification; yield each moving link: the number of its last joint, its name and body."""
    body, origin = spec.worldbody.add_body(pos=base.position, quat=base.quaternion), (0.0, 0.0, 0.0)
    for number, joint in enumerate(chain.joints, start=1):
        body = body.add_body(pos=np.subtract(joint.point, origin))
        kind = mujoco.mjtJoint.mjJNT_SLIDE if joint.is_prismatic else mujoco.mjtJoint.mjJNT_HINGE
        body.add_joint(type=kind, axis=joint.axis)
        # the engine takes no moving body without mass; only distances are computed
        body.explicitinertial, body.mass, body.inertia = True, 1.0, (1.0, 1.0, 1.0)
        origin = joint.point
        for name, link in chain.links.items():
            if link.joints == number:
                place = np.subtract(link.pose.position, origin)
                yield number, name, body.add_body(name=name, pos=place, quat=link.pose.quaternion)


def add_shape(
    spec: Any, body: Any, shape: Mapping[str, Any], contype: int, conaffinity: int, margin: float = PLANNED_CLEARANCE
) -> str:
    """Add a shape to a body of a model specification; return its name there."""
    size = [*(shape["size"] or (1.0, 1.0, 1.0)), 0.0, 0.0][:3]
    geom = body.add_geom(name=f"shape{len(spec.geoms)}", size=size, margin=margin)
    geom.type = getattr(mujoco.mjtGeom, f"mjGEOM_{shape['type'].upper()}")
    geom.pos, geom.quat = shape["position"], shape["quaternion"]
    geom.contype, geom.conaffinity = contype, conaffinity
    if shape["type"] == "mesh":
        vertices = [coordinate for vertex in shape["vertices"] for coordinate in vertex]
        mesh = spec.add_mesh(name=f"mesh{len(spec.meshes)}", uservert=vertices)
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
        geom.meshname = mesh.name
    return str(geom.name)


def places_along(path: Sequence[Sequence[float]], steps: Vector) -> Array:
    """Return places of a path of joint positions, shape (n, joints), including both ends.

    No joint moves farther between two of them than in `steps` [rad; m].
    """
    knots = np.array(path, dtype=float)
    # A stretch gets as many steps as the joint needs that moves farthest, measured in its own steps.
    counts = np.max(np.abs(np.diff(knots, axis=0)) / np.array(steps), axis=1, initial=0.0)
    marks = np.concatenate(([0.0], np.cumsum(counts)))
    places = np.linspace(0.0, marks[-1], max(2, math.ceil(marks[-1]) + 1))
    return np.stack([np.interp(places, marks, column) for column in knots.T], axis=1)
