"""Robot model of the engine: bodies, joints and shapes of a URDF robot, contact exclusions, and the floor.

Joints are driven from outside, by `servos.py`. What a URDF leaves open is filled in as the original of the io_teleop
node did: a link without mass weighs 1 kg, and the links that a gripper drives 0.1 kg (measured: with these the recorded
motion of the QingLong is met, without them its wrists are four times too quick).
"""

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations, product
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from cellwright.config.models.files import ModelFileError
from cellwright.config.models.meshes import is_flat, read_mesh
from cellwright.config.models.model import ModelShape
from cellwright.config.parsing.tree import Place, Problem
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import Inertial, Joint, JointType, Link, RobotModel, position_of
from cellwright.engine import colours
from cellwright.engine.shapes import GEOM_TYPES, Mesh, add_mesh
from cellwright.util.errors import DescriptionError
from cellwright.util.pose import IDENTITY_QUATERNION, Pose, Vector3

Pair = tuple[str, str]


def joined_pairs(robot: RobotModel, moved: frozenset[str], touched: frozenset[str]) -> list[Pair]:
    """Pairs of `touched` links that are joined, by one joint that is `moved` in the engine or by any number of others.

    They never touch: their shapes overlap there by design.
    """
    group_of = {robot.root: 0}
    groups: list[list[str]] = [[robot.root]]
    neighbours: list[tuple[int, int]] = []
    for joint in robot.joints:
        parent = group_of[joint.parent]
        if joint.name in moved:
            neighbours.append((parent, len(groups)))
            group_of[joint.child] = len(groups)
            groups.append([joint.child])
        else:
            group_of[joint.child] = parent
            groups[parent].append(joint.child)
    solid = [[link for link in group if link in touched] for group in groups]
    inside = [pair for group in solid for pair in combinations(group, 2)]
    return inside + [pair for one, other in neighbours for pair in product(solid[one], solid[other])]


def overlapping_pairs(model: mujoco.MjModel, data: mujoco.MjData) -> list[Pair]:
    """Pairs of bodies that reach into each other in the posture of `data`, each once.

    Where they do as the robot is put up, the shapes are too large, and would push each other apart for ever.
    """
    mujoco.mj_fwdPosition(model, data)
    found = {
        (min(bodies), max(bodies))
        for contact in data.contact[: data.ncon]
        if contact.dist < 0 and (bodies := [int(model.geom_bodyid[geom]) for geom in contact.geom])
    }
    return [(model.body(one).name, model.body(other).name) for one, other in sorted(found)]


def exclude_contacts(spec: Any, pairs: list[Pair]) -> None:
    """Keep pairs of bodies from touching each other."""
    for one, other in pairs:
        spec.add_exclude(bodyname1=one, bodyname2=other)


FLOOR = "floor"
"""Name of the geom."""

_VISUAL_GROUP = 2  # the group of geoms that are only seen
_BOX_CORNERS = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


def add_floor(spec: Any) -> None:
    """An endless floor at height 0, until `put_floor_under` says where it is."""
    spec.worldbody.add_geom(
        name=FLOOR,
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=(0.0, 0.0, 1.0),  # a plane of size 0 has no end
        rgba=colours.FLOOR,
        group=_VISUAL_GROUP,
        contype=0,
        conaffinity=0,
    )


def put_floor_under(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Put the floor where the lowest point of what is seen stands on it, in the posture of `data`."""
    corners = seen_corners(model, data)
    if len(corners):
        floor = model.geom(FLOOR).id
        model.geom_pos[floor, 2] = corners[:, 2].min()
        model.geom_sameframe[floor] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE  # else the engine takes the world's height


def kinematics_of(model: mujoco.MjModel, data: mujoco.MjData) -> mujoco.MjData:
    """Where bodies and shapes are in the posture of `data`, which is only read, and of which only `qpos` matters."""
    still = mujoco.MjData(model)
    still.qpos[:], still.mocap_pos[:], still.mocap_quat[:] = data.qpos, data.mocap_pos, data.mocap_quat
    mujoco.mj_kinematics(model, still)
    return still


def seen_corners(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Corners (n, 3) [m] of the boxes around all shapes that are seen, in the world; the floor has none.

    A box lies along the axes of its shape. `data` is only read; what was computed from `qpos` before does not matter.
    """
    still = kinematics_of(model, data)
    seen = np.flatnonzero((model.geom_group <= _VISUAL_GROUP) & (model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE))
    middles, halves = model.geom_aabb[seen, :3], model.geom_aabb[seen, 3:]
    local = middles[:, None, :] + halves[:, None, :] * _BOX_CORNERS
    turned = np.einsum("gij,gkj->gki", still.geom_xmat[seen].reshape(-1, 3, 3), local)
    corners: np.ndarray[Any, np.dtype[np.float64]] = (turned + still.geom_xpos[seen][:, None, :]).reshape(-1, 3)
    return corners


DEFAULT_COLOUR = (0.62, 0.64, 0.67, 1.0)
"""Of shapes that have no colour."""
LEAST_LENGTH = 1e-4
"""Least half length of a shape [m]: the engine takes none that is thinner."""


class ShapeBuilder:
    """Gives bodies their shapes; a mesh that many links use is loaded once.

    Where links may not touch each other (`is_touched`), what is only touched is left out.
    """

    def __init__(self, spec: Any, *, is_touched: bool) -> None:
        self._spec = spec
        self._is_touched = is_touched
        self._files: dict[Path, Mesh] = {}
        self._names: dict[tuple[Path, Vector3], str] = {}

    def add(self, body: Any, shape: ModelShape) -> bool:
        """Give a body a shape, without weight; returns whether it is one that is touched."""
        is_touched = shape.is_touched and self._is_touched
        if not (is_touched or shape.is_seen):
            return False
        if shape.mesh is not None:
            geom = self._add_mesh(body, shape, shape.mesh, is_touched=is_touched)
        else:
            x, y, z = shape.size
            halves = {"box": (x / 2, y / 2, z / 2), "sphere": (x, 0.0, 0.0)}.get(shape.kind, (x, y / 2, 0.0))
            size = tuple(max(half, LEAST_LENGTH) for half in halves)
            geom = body.add_geom(type=GEOM_TYPES[shape.kind], size=size, **pose_arguments(shape.pose))
        geom.rgba = shape.colour or DEFAULT_COLOUR
        geom.contype = geom.conaffinity = int(is_touched)
        geom.group = 2 if shape.is_seen else 3
        geom.mass = 0.0
        return is_touched

    def extent(self, shapes: Iterable[ModelShape]) -> list[float]:
        """Edge lengths (3) [m] of the box around what is touched, along the axes of the link; 0 where nothing is."""
        corners = [corner for shape in shapes if shape.is_touched for corner in self._corners(shape)]
        edges: list[float] = np.ptp(corners or [(0.0, 0.0, 0.0)], axis=0).tolist()
        return edges

    def _corners(self, shape: ModelShape) -> list[Vector3]:
        """Corners [m] of the box around a shape, in the frame of its link."""
        if shape.mesh is not None:
            vertices, _ = self._read(shape.mesh, shape.size)
            lower, upper = vertices.min(axis=0), vertices.max(axis=0)
        else:
            x, y, z = shape.size
            halves = {"box": (x / 2, y / 2, z / 2), "sphere": (x, x, x), "cylinder": (x, x, y / 2)}
            upper = np.array(halves.get(shape.kind, (x, x, x + y / 2)))
            lower = -upper
        return [shape.pose.transform((x, y, z)) for x, y, z in product(*zip(lower, upper, strict=True))]

    def _add_mesh(self, body: Any, shape: ModelShape, path: Path, *, is_touched: bool) -> Any:
        vertices, triangles = self._read(path, shape.size)
        if len(vertices) < 4 or (is_touched and is_flat(vertices)):
            # the engine finds no hull around it: its box stands for it
            lower, upper = vertices.min(axis=0), vertices.max(axis=0)
            x, y, z = ((lower + upper) / 2).tolist()
            halves = np.maximum((upper - lower) / 2, LEAST_LENGTH)
            at = shape.pose @ Pose((x, y, z))
            return body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=halves, **pose_arguments(at))
        key = path, shape.size
        if key not in self._names:
            self._names[key] = f"mesh {len(self._names)} {path.name}"
            add_mesh(self._spec, self._names[key], (vertices, triangles))
        return body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=self._names[key], **pose_arguments(shape.pose))

    def _read(self, path: Path, scale: Vector3) -> Mesh:
        """A mesh [m], as large as a shape has it; a mirrored one keeps its outside outside."""
        if path not in self._files:
            self._files[path] = read_mesh(path)
        vertices, triangles = self._files[path]
        return vertices * scale, triangles if np.prod(scale) > 0 else triangles[:, ::-1]


def pose_arguments(pose: Pose) -> dict[str, Any]:
    """A pose as the engine's specification takes it."""
    return {"pos": pose.position, "quat": pose.quaternion if pose.quaternion != IDENTITY_QUATERNION else (1, 0, 0, 0)}


TIMESTEP = Fraction(1, 240)
"""Of the original's physics [s]."""
DEFAULT_MASS = 1.0
"""Of a link that the file gives no mass for [kg]; its inertia is that of a box around what is touched of it."""
FINGER_MASS = 0.1
"""Of a link that a gripper's joint moves [kg]."""

_LEAST_MASS, _LEAST_INERTIA = 1e-6, 1e-9  # the engine takes no body that moves and has none
_LEAST_ROOM = 1e-6  # [rad; m]
_JOINT_TYPES = {
    JointType.REVOLUTE: mujoco.mjtJoint.mjJNT_HINGE,
    JointType.CONTINUOUS: mujoco.mjtJoint.mjJNT_HINGE,
    JointType.PRISMATIC: mujoco.mjtJoint.mjJNT_SLIDE,
    JointType.SPHERICAL: mujoco.mjtJoint.mjJNT_BALL,
}
BASE_BODY = "cellwright base"
"""Name of the body that carries the robot: it has no place in the URDF, and moves as `target_base_move` says."""


def body_of(link: str) -> str:
    """Name of a link's body in the engine: the link's own, but for those of the world and of bodies that are ours."""
    return f"cellwright link {link}" if link == "world" or link.startswith("cellwright ") else link


@dataclass(frozen=True)
class RobotWorld:
    """A robot, and the engine's model of it; joints and actuators have the names of joints, bodies those of `body_of`.

    The actuators exert nothing: their controls are where the targets of the joints stand [rad; m], so that they are
    part of the engine's state and can be moved in its own window.
    """

    config: RobotConfig
    model: mujoco.MjModel

    def put_in_first_pose(self, data: mujoco.MjData) -> None:
        """Write the posture that the robot is put up in.

        A joint that cannot be at 0 stands at the limit nearest to it: the original puts it up at 0 all the same, and
        the first command makes it jump. Joints that follow another stand where that has them.
        """
        robot, positions = self.config.robot, dict(self.config.start)
        leaders_first = sorted(robot.driven, key=lambda joint: joint.mimic is not None)
        for joint in leaders_first:
            if joint.name not in positions:
                place = position_of(robot, joint, positions)
                positions[joint.name] = min(max(place, joint.limits.lower), joint.limits.upper)
        for name, position in positions.items():
            data.qpos[self.model.joint(name).qposadr[0]] = position


def build_robot(config: RobotConfig, *, timestep: Fraction = TIMESTEP, self_collision: bool = False) -> RobotWorld:
    """The world with a robot in it and nothing else, without gravity, as in the original.

    With `self_collision` links may touch each other, but for those that are joined or overlap as the robot is put up.

    Raises:
        DescriptionError: it is a robot that the engine cannot build.
    """
    spec = mujoco.MjSpec()
    spec.modelname = config.name
    spec.compiler.degree = False
    spec.compiler.boundmass, spec.compiler.boundinertia = _LEAST_MASS, _LEAST_INERTIA
    spec.compiler.balanceinertia = True
    option = spec.option
    option.timestep = float(timestep)
    option.gravity = (0.0, 0.0, 0.0)
    option.integrator = mujoco.mjtIntegrator.mjINT_EULER  # drives are constraints here: nothing is left to be damped
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.tolerance = 1e-10
    option.iterations = 100  # two are usual; when many drives come to their bounds at once it takes up to fifty
    builder = _Builder(spec, config, is_touched=self_collision)
    with _refusing(config):
        builder.build()
    add_floor(spec)
    moved = frozenset(joint.name for joint in config.robot.joints if joint.type in _JOINT_TYPES)
    joined = joined_pairs(config.robot, moved, frozenset(builder.touched))
    exclude_contacts(spec, [(body_of(one), body_of(other)) for one, other in joined])
    with _refusing(config):
        world = RobotWorld(config, spec.compile())
    data = mujoco.MjData(world.model)
    world.put_in_first_pose(data)
    if overlapping := overlapping_pairs(world.model, data) if self_collision else []:
        exclude_contacts(spec, overlapping)
        world = RobotWorld(config, spec.compile())
    put_floor_under(world.model, data)
    return world


@contextmanager
def _refusing(config: RobotConfig) -> Iterator[None]:
    """Say in one sentence what the engine does not like about a robot, or what has become of its meshes meanwhile."""
    try:
        yield
    except (ValueError, ModelFileError) as error:
        message = f"the engine cannot build this robot: {' '.join(str(error).split())}"
        raise DescriptionError([Problem(Place(0, str(config.urdf_path), 0), "", message)]) from None


class _Builder:
    def __init__(self, spec: Any, config: RobotConfig, *, is_touched: bool) -> None:
        self._spec, self._config, self._robot = spec, config, config.robot
        self._shapes = ShapeBuilder(spec, is_touched=is_touched)
        self.touched: set[str] = set()
        """Links with shapes that are touched."""
        self._fingers = {self._robot.joint(name).child for gripper in config.grippers for name in gripper.joints}
        self._joints_at: dict[str, list[Joint]] = {name: [] for name in self._robot.links}
        for joint in self._robot.joints:
            self._joints_at[joint.parent].append(joint)
            self._joints_at[joint.child].append(joint)

    def build(self) -> None:
        """The base with the robot on it; it is grown from the link that is fastened to the world."""
        base = self._spec.worldbody.add_body(name=BASE_BODY, mocap=True, **pose_arguments(self._config.base_pose))
        first = self._config.fixed_link or self._robot.root
        body = base.add_body(name=body_of(first))
        self._fill(body, self._robot.links[first])
        self._grow(body, first)
        for joint in self._robot.driven:
            actuator = self._spec.add_actuator(name=joint.name, target=joint.name)
            actuator.trntype = mujoco.mjtTrn.mjTRN_JOINT
            actuator.gainprm[0] = 0.0
            actuator.ctrllimited, actuator.ctrlrange = _range(joint)

    def _grow(self, first: Any, first_link: str) -> None:
        ahead: list[tuple[Any, str, Joint | None]] = [(first, first_link, None)]
        while ahead:
            body, link, come_by = ahead.pop()
            for joint in self._joints_at[link]:
                if joint is come_by:
                    continue
                is_turned_over = joint.child == link
                other = joint.parent if is_turned_over else joint.child
                origin = joint.origin.inverse() if is_turned_over else joint.origin
                grown = body.add_body(name=body_of(other), **pose_arguments(origin))
                self._fill(grown, self._robot.links[other])
                if joint.type in _JOINT_TYPES:
                    self._add_joint(grown, joint, is_turned_over=is_turned_over)
                ahead.append((grown, other, joint))

    def _add_joint(self, body: Any, joint: Joint, *, is_turned_over: bool) -> None:
        """A joint; seen from its child, its axis points the other way and goes through where the child's frame is."""
        axis, at = joint.axis, (0.0, 0.0, 0.0)
        if is_turned_over:
            x, y, z = joint.origin.rotate(axis)
            axis, at = (-x, -y, -z), joint.origin.position
        made = body.add_joint(name=joint.name, type=_JOINT_TYPES[joint.type], pos=at)
        if joint.is_driven:
            made.axis = axis
            made.limited, made.range = _range(joint)

    def _fill(self, body: Any, link: Link) -> None:
        """Mass and shapes of a link."""
        body.explicitinertial = True
        inertial = link.inertial
        mass = DEFAULT_MASS if inertial is None else inertial.mass
        inertia = self._inertia_of_shapes(link) if inertial is None else _in_link_frame(inertial)
        if link.name in self._fingers:
            factor = FINGER_MASS / mass if mass > 0 else 0.0
            mass, inertia = FINGER_MASS, tuple(factor * value for value in inertia)
        body.mass = mass
        body.fullinertia = inertia
        body.ipos = (0.0, 0.0, 0.0) if inertial is None else inertial.pose.position
        for shape in link.shapes:
            if self._shapes.add(body, shape):
                self.touched.add(link.name)

    def _inertia_of_shapes(self, link: Link) -> tuple[float, ...]:
        """Of a link without mass: that of a box of 1 kg around what is touched; next to nothing where nothing is."""
        x, y, z = self._shapes.extent(link.shapes)
        squares = (y * y + z * z, z * z + x * x, x * x + y * y)
        return (*(max(DEFAULT_MASS / 12 * square, _LEAST_INERTIA) for square in squares), 0.0, 0.0, 0.0)


def _range(joint: Joint) -> tuple[bool, tuple[float, float]]:
    """Whether a joint has bounds on both sides, and these [rad; m]; the engine wants some room between them."""
    lower, upper = joint.limits.lower, joint.limits.upper
    if not (math.isfinite(lower) and math.isfinite(upper)):
        return False, (0.0, 0.0)
    room = max(0.0, _LEAST_ROOM - (upper - lower)) / 2
    return True, (lower - room, upper + room)


def _in_link_frame(inertial: Inertial) -> tuple[float, ...]:
    """The inertia about the centre of mass along the axes of the link, in the order of `Inertial`."""
    xx, yy, zz, xy, xz, yz = inertial.inertia
    if inertial.pose.quaternion == IDENTITY_QUATERNION:
        return inertial.inertia
    rotation = np.array([inertial.pose.rotate(axis) for axis in ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))]).T
    turned = rotation @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ rotation.T
    return tuple(turned[row, column] for row, column in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
