"""Robot model of the engine: bodies, joints and shapes of a URDF robot, contact exclusions, and the floor.

`servos.py` drives the joints. Defaults for what a URDF omits are those of the original io_teleop node. A link without
mass weighs 1 kg, and a link that a gripper drives 0.1 kg. (Measured: with these the QingLong follows its recorded
motion. Without them its wrists are four times too quick.)
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

FLOOR = "floor"
"""Name of the floor's geom."""
_VISUAL_GROUP = 2  # group of visual geoms
_BOX_CORNERS = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
DEFAULT_COLOUR = (0.62, 0.64, 0.67, 1.0)
"""Colour of shapes without one."""
MIN_HALF_LENGTH = 1e-4
"""Minimum half length of a shape [m]: the engine takes no thinner one."""
TIMESTEP = Fraction(1, 240)
"""Time step of the original's physics [s]."""
DEFAULT_MASS = 1.0
"""Mass of a link without one in the file [kg]; its inertia is that of a box around its shapes for contact."""
FINGER_MASS = 0.1
"""Mass of a link that a gripper's joint moves [kg]."""
_MIN_MASS, _MIN_INERTIA = 1e-6, 1e-9  # the engine takes no moving body without them
_MIN_RANGE = 1e-6  # [rad; m]
_JOINT_TYPES = {
    JointType.REVOLUTE: mujoco.mjtJoint.mjJNT_HINGE,
    JointType.CONTINUOUS: mujoco.mjtJoint.mjJNT_HINGE,
    JointType.PRISMATIC: mujoco.mjtJoint.mjJNT_SLIDE,
    JointType.SPHERICAL: mujoco.mjtJoint.mjJNT_BALL,
}
BASE_BODY = "cellwright base"
"""Name of the body that carries the robot: it is not in the URDF, and `target_base_move` moves it."""


def joined_pairs(robot: RobotModel, moved: frozenset[str], touched: frozenset[str]) -> list[Pair]:
    """Return pairs of `touched` links that are joined, by one `moved` joint or by any number of other joints.

    They never touch: their shapes overlap there by design. A joint is `moved` if it moves in the engine.
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
    """Return pairs of bodies that overlap in the posture of `data`, each once.

    If they overlap in the initial posture, their shapes are too large, and would push each other apart for ever.
    """
    mujoco.mj_fwdPosition(model, data)
    found = {
        (min(bodies), max(bodies))
        for contact in data.contact[: data.ncon]
        if contact.dist < 0 and (bodies := [int(model.geom_bodyid[geom]) for geom in contact.geom])
    }
    return [(model.body(one).name, model.body(other).name) for one, other in sorted(found)]


def exclude_contacts(spec: Any, pairs: list[Pair]) -> None:
    """Exclude contacts between pairs of bodies."""
    for one, other in pairs:
        spec.add_exclude(bodyname1=one, bodyname2=other)


def add_floor(spec: Any) -> None:
    """Add an infinite floor at height 0, until `put_floor_under` moves it."""
    spec.worldbody.add_geom(
        name=FLOOR,
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=(0.0, 0.0, 1.0),  # a plane of size 0 is infinite
        rgba=colours.FLOOR,
        group=_VISUAL_GROUP,
        contype=0,
        conaffinity=0,
    )


def put_floor_under(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Move the floor to the lowest visible point of the robot, in the posture of `data`."""
    corners = visible_corners(model, data)
    if len(corners):
        floor = model.geom(FLOOR).id
        model.geom_pos[floor, 2] = corners[:, 2].min()
        model.geom_sameframe[floor] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE  # else the engine uses the world's height


def kinematics_of(model: mujoco.MjModel, data: mujoco.MjData) -> mujoco.MjData:
    """Return poses of bodies and shapes in the posture of `data`, which is only read; only its `qpos` matters."""
    still = mujoco.MjData(model)
    still.qpos[:], still.mocap_pos[:], still.mocap_quat[:] = data.qpos, data.mocap_pos, data.mocap_quat
    mujoco.mj_kinematics(model, still)
    return still


def visible_corners(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return corners (n, 3) [m] of the boxes around all visible shapes, in the world; without the floor.

    A box is aligned with the axes of its shape. `data` is only read; only its `qpos` matters.
    """
    still = kinematics_of(model, data)
    visible = np.flatnonzero((model.geom_group <= _VISUAL_GROUP) & (model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE))
    middles, halves = model.geom_aabb[visible, :3], model.geom_aabb[visible, 3:]
    local = middles[:, None, :] + halves[:, None, :] * _BOX_CORNERS
    turned = np.einsum("gij,gkj->gki", still.geom_xmat[visible].reshape(-1, 3, 3), local)
    corners: np.ndarray[Any, np.dtype[np.float64]] = (turned + still.geom_xpos[visible][:, None, :]).reshape(-1, 3)
    return corners


class ShapeBuilder:
    """Builder of the shapes of bodies; a mesh that many links use is loaded once.

    If links cannot touch each other (`is_touched` is false), shapes for contact alone are left out; if they are not
    drawn (`is_seen` is false), shapes that are only seen.
    """

    def __init__(self, spec: Any, *, is_touched: bool, is_seen: bool) -> None:
        self._spec = spec
        self._is_touched, self._is_seen = is_touched, is_seen
        self._files: dict[Path, Mesh] = {}
        self._names: dict[tuple[Path, Vector3], str] = {}

    def add(self, body: Any, shape: ModelShape) -> bool:
        """Add a shape without mass to a body; return True if it is one for contact."""
        is_touched = shape.is_touched and self._is_touched
        if not (is_touched or (shape.is_seen and self._is_seen)):
            return False
        if shape.mesh is not None:
            geom = self._add_mesh(body, shape, shape.mesh, is_touched=is_touched)
        else:
            x, y, z = shape.size
            halves = {"box": (x / 2, y / 2, z / 2), "sphere": (x, 0.0, 0.0)}.get(shape.kind, (x, y / 2, 0.0))
            size = tuple(max(half, MIN_HALF_LENGTH) for half in halves)
            geom = body.add_geom(type=GEOM_TYPES[shape.kind], size=size, **pose_arguments(shape.pose))
        geom.rgba = shape.colour or DEFAULT_COLOUR
        geom.contype = geom.conaffinity = int(is_touched)
        geom.group = 2 if shape.is_seen else 3
        geom.mass = 0.0
        return is_touched

    def extent(self, shapes: Iterable[ModelShape]) -> list[float]:
        """Return edge lengths (3) [m] of the box around the shapes for contact, along the link's axes, or 0."""
        corners = [corner for shape in shapes if shape.is_touched for corner in self._corners(shape)]
        edges: list[float] = np.ptp(corners or [(0.0, 0.0, 0.0)], axis=0).tolist()
        return edges

    def _corners(self, shape: ModelShape) -> list[Vector3]:
        """Return corners [m] of the box around a shape, in the frame of its link."""
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
            # the engine finds no hull around it: its box replaces it
            lower, upper = vertices.min(axis=0), vertices.max(axis=0)
            x, y, z = ((lower + upper) / 2).tolist()
            halves = np.maximum((upper - lower) / 2, MIN_HALF_LENGTH)
            at = shape.pose @ Pose((x, y, z))
            return body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=halves, **pose_arguments(at))
        key = path, shape.size
        if key not in self._names:
            self._names[key] = f"mesh {len(self._names)} {path.name}"
            add_mesh(self._spec, self._names[key], (vertices, triangles))
        return body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=self._names[key], **pose_arguments(shape.pose))

    def _read(self, path: Path, scale: Vector3) -> Mesh:
        """Read a mesh [m], scaled to its shape; the outside of a mirrored one stays outside."""
        if path not in self._files:
            self._files[path] = read_mesh(path)
        vertices, triangles = self._files[path]
        return vertices * scale, triangles if np.prod(scale) > 0 else triangles[:, ::-1]


def pose_arguments(pose: Pose) -> dict[str, Any]:
    """Return a pose as arguments of the engine's specification."""
    return {"pos": pose.position, "quat": pose.quaternion if pose.quaternion != IDENTITY_QUATERNION else (1, 0, 0, 0)}


_Disable = mujoco.mjtDisableBit


def body_of(link: str) -> str:
    """Return the name of a link's body in the engine: the link's own, except for names of the world and our bodies."""
    return f"cellwright link {link}" if link == "world" or link.startswith("cellwright ") else link


@dataclass(frozen=True)
class RobotWorld:
    """A robot and its engine model; joints and actuators have the names of joints, bodies those of `body_of`.

    The actuators exert nothing. Their controls hold the targets of the joints [rad; m], and so are part of the
    engine's state and can be moved in its own window.

    Attributes:
        config: the robot.
        model: the whole model, to be drawn.
        stepping: the same without what is only seen, which would cost in each step: bodies, joints and actuators have
            the same numbers.
    """

    config: RobotConfig
    model: mujoco.MjModel
    stepping: mujoco.MjModel

    def set_initial_posture(self, data: mujoco.MjData) -> None:
        """Write the initial posture.

        A joint that cannot be at 0 starts at the nearest limit. The original puts it at 0 all the same, and the first
        command makes it jump. Mimic joints start where they follow their leader.
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
    """Build a world with a robot in it and nothing else, without gravity, as in the original.

    Args:
        config: the robot.
        timestep: length of a step [s].
        self_collision: enables contacts between links, except for those that are joined or overlap in the initial
            posture.

    Raises:
        DescriptionError: the engine cannot build the robot.
    """
    with _report_refusal(config):
        whole, stepping = (_specify(config, timestep, self_collision, is_seen) for is_seen in (True, False))
        add_floor(whole)
        model = whole.compile()
    world, data = RobotWorld(config, model, model), mujoco.MjData(model)
    world.set_initial_posture(data)
    if overlapping := overlapping_pairs(model, data) if self_collision else []:
        exclude_contacts(whole, overlapping)
        exclude_contacts(stepping, overlapping)
        model = whole.compile()
    put_floor_under(model, data)
    return RobotWorld(config, model, stepping.compile())


def _specify(config: RobotConfig, timestep: Fraction, is_touched: bool, is_seen: bool) -> Any:  # noqa: FBT001
    """Return the specification of a robot's model, with shapes that are touched, seen or both."""
    spec = mujoco.MjSpec()
    spec.modelname = config.name
    spec.compiler.degree = False
    spec.compiler.boundmass, spec.compiler.boundinertia = _MIN_MASS, _MIN_INERTIA
    spec.compiler.balanceinertia = True
    option = spec.option
    option.timestep = float(timestep)
    option.gravity = (0.0, 0.0, 0.0)
    option.integrator = mujoco.mjtIntegrator.mjINT_EULER  # drives are constraints here: nothing needs damping
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.tolerance = 1e-10
    # The actuators exert nothing, joints have neither springs nor damping, and links meet only if they are asked to.
    option.disableflags |= int(_Disable.mjDSBL_ACTUATION | _Disable.mjDSBL_SPRING | _Disable.mjDSBL_DAMPER)
    if not is_touched:
        option.disableflags |= int(_Disable.mjDSBL_CONTACT)
    option.iterations = 100  # two are usual; up to fifty when many drives reach their limits at once
    builder = _RobotBuilder(spec, config, is_touched=is_touched, is_seen=is_seen)
    builder.build()
    moved = frozenset(joint.name for joint in config.robot.joints if joint.type in _JOINT_TYPES)
    joined = joined_pairs(config.robot, moved, frozenset(builder.touched))
    exclude_contacts(spec, [(body_of(one), body_of(other)) for one, other in joined])
    return spec


@contextmanager
def _report_refusal(config: RobotConfig) -> Iterator[None]:
    """Report in one sentence why the engine refuses a robot, or why its meshes can no longer be read."""
    try:
        yield
    except (ValueError, ModelFileError) as error:
        message = f"the engine cannot build this robot: {' '.join(str(error).split())}"
        raise DescriptionError([Problem(Place(0, str(config.urdf_path), 0), "", message)]) from None


class _RobotBuilder:
    def __init__(self, spec: Any, config: RobotConfig, *, is_touched: bool, is_seen: bool) -> None:
        self._spec, self._config, self._robot = spec, config, config.robot
        self._shapes = ShapeBuilder(spec, is_touched=is_touched, is_seen=is_seen)
        self.touched: set[str] = set()
        """Links with shapes for contact."""
        self._fingers = {self._robot.joint(name).child for gripper in config.grippers for name in gripper.joints}
        self._joints_at: dict[str, list[Joint]] = {name: [] for name in self._robot.links}
        for joint in self._robot.joints:
            self._joints_at[joint.parent].append(joint)
            self._joints_at[joint.child].append(joint)

    def build(self) -> None:
        """Build the base with the robot on it, from the link that is fixed to the world."""
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
            body, link, arrived_by = ahead.pop()
            for joint in self._joints_at[link]:
                if joint is arrived_by:
                    continue
                is_reversed = joint.child == link
                other = joint.parent if is_reversed else joint.child
                origin = joint.origin.inverse() if is_reversed else joint.origin
                grown = body.add_body(name=body_of(other), **pose_arguments(origin))
                self._fill(grown, self._robot.links[other])
                if joint.type in _JOINT_TYPES:
                    self._add_joint(grown, joint, is_reversed=is_reversed)
                ahead.append((grown, other, joint))

    def _add_joint(self, body: Any, joint: Joint, *, is_reversed: bool) -> None:
        """Add a joint; seen from its child, its axis is reversed and passes through the child's frame."""
        axis, at = joint.axis, (0.0, 0.0, 0.0)
        if is_reversed:
            x, y, z = joint.origin.rotate(axis)
            axis, at = (-x, -y, -z), joint.origin.position
        made = body.add_joint(name=joint.name, type=_JOINT_TYPES[joint.type], pos=at)
        if joint.is_driven:
            made.axis = axis
            made.limited, made.range = _range(joint)

    def _fill(self, body: Any, link: Link) -> None:
        """Add mass and shapes of a link."""
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
        """Return the inertia of a link without mass: of a 1 kg box around its shapes for contact, or almost 0."""
        x, y, z = self._shapes.extent(link.shapes)
        squares = (y * y + z * z, z * z + x * x, x * x + y * y)
        return (*(max(DEFAULT_MASS / 12 * square, _MIN_INERTIA) for square in squares), 0.0, 0.0, 0.0)


def _range(joint: Joint) -> tuple[bool, tuple[float, float]]:
    """Return whether a joint has limits on both sides, and these [rad; m]; the engine needs some range between them."""
    lower, upper = joint.limits.lower, joint.limits.upper
    if not (math.isfinite(lower) and math.isfinite(upper)):
        return False, (0.0, 0.0)
    room = max(0.0, _MIN_RANGE - (upper - lower)) / 2
    return True, (lower - room, upper + room)


def _in_link_frame(inertial: Inertial) -> tuple[float, ...]:
    """Return the inertia about the centre of mass along the axes of the link, in the order of `Inertial`."""
    xx, yy, zz, xy, xz, yz = inertial.inertia
    if inertial.pose.quaternion == IDENTITY_QUATERNION:
        return inertial.inertia
    rotation = np.array([inertial.pose.rotate(axis) for axis in ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))]).T
    turned = rotation @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ rotation.T
    return tuple(turned[row, column] for row, column in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
