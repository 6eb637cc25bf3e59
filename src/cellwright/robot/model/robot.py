"""A robot in the engine: a body for each link, a joint for each that moves, nothing else.

Joints are driven from outside, by `devices/joint_servos.py`. What a URDF leaves open is filled in as the original of
the io_teleop node did: a link without mass weighs 1 kg, and the links that a gripper drives 0.1 kg (measured: with
these the recorded motion of the QingLong is met, without them its wrists are four times too quick).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import mujoco
import numpy as np

from cellwright.config.models.files import ModelFileError
from cellwright.config.parsing.problems import Place, Problem
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import Inertial, Joint, JointType, Link, RobotModel
from cellwright.config.robot.posture import position_of
from cellwright.robot.model.contacts import exclude, joined_pairs, overlapping_pairs
from cellwright.robot.model.floor import add_floor, put_floor_under
from cellwright.robot.model.shapes import ShapeBuilder, placed
from cellwright.util.errors import DescriptionError
from cellwright.util.pose import IDENTITY_QUATERNION

TIMESTEP = Fraction(1, 240)
"""Of the original's physics [s]."""
MASS = 1.0
"""Of a link that the file gives no mass for [kg]; its inertia is that of a box around what is touched of it."""
FINGER_MASS = 0.1
"""Of a link that a gripper's joint moves [kg]."""

_LEAST_MASS, _LEAST_INERTIA = 1e-6, 1e-9  # the engine takes no body that moves and has none
_LEAST_ROOM = 1e-6  # [rad; m]
_HINGE = {
    JointType.REVOLUTE: mujoco.mjtJoint.mjJNT_HINGE,
    JointType.CONTINUOUS: mujoco.mjtJoint.mjJNT_HINGE,
    JointType.PRISMATIC: mujoco.mjtJoint.mjJNT_SLIDE,
    JointType.SPHERICAL: mujoco.mjtJoint.mjJNT_BALL,
}
BASE = "cellwright base"
"""Name of the body that carries the robot: it has no place in the URDF, and moves as `target_base_move` says."""


_TAKEN = ("world", "cellwright ")  # the engine's name of the world, and how ours begin


def body_of(link: str) -> str:
    """Name of a link's body in the engine: the link's own, but for the few names that are taken there."""
    return f"cellwright link {link}" if link == _TAKEN[0] or link.startswith(_TAKEN[1]) else link


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
            if joint.name in positions:
                continue
            place = position_of(robot, joint, positions)
            positions[joint.name] = min(max(place, joint.limits.lower), joint.limits.upper)
        for name, position in positions.items():
            data.qpos[self.model.joint(name).qposadr[0]] = position


def build_robot(config: RobotConfig, *, timestep: Fraction = TIMESTEP, self_collision: bool = False) -> RobotWorld:
    """The world with a robot in it and nothing else, without gravity, as in the original.

    Args:
        config: the robot.
        timestep: length of a step [s].
        self_collision: whether links may touch each other; see `robot_contacts` for those that never do.

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
    moved = frozenset(joint.name for joint in config.robot.joints if joint.type in _HINGE)
    joined = joined_pairs(config.robot, moved, frozenset(builder.touched))
    exclude(spec, [(body_of(one), body_of(other)) for one, other in joined])
    with _refusing(config):
        world = RobotWorld(config, spec.compile())
    data = mujoco.MjData(world.model)
    world.put_in_first_pose(data)
    if overlapping := overlapping_pairs(world.model, data) if self_collision else []:
        exclude(spec, overlapping)
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
        self._spec = spec
        self._robot: RobotModel = config.robot
        self._config = config
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
        base = self._spec.worldbody.add_body(name=BASE, mocap=True, **placed(self._config.base_pose))
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
                grown = body.add_body(name=body_of(other), **placed(origin))
                self._fill(grown, self._robot.links[other])
                if joint.type in _HINGE:
                    self._add_joint(grown, joint, is_turned_over=is_turned_over)
                ahead.append((grown, other, joint))

    def _add_joint(self, body: Any, joint: Joint, *, is_turned_over: bool) -> None:
        """A joint; seen from its child, its axis points the other way and goes through where the child's frame is."""
        axis, at = joint.axis, (0.0, 0.0, 0.0)
        if is_turned_over:
            x, y, z = joint.origin.rotate(axis)
            axis, at = (-x, -y, -z), joint.origin.position
        made = body.add_joint(name=joint.name, type=_HINGE[joint.type], pos=at)
        if joint.is_driven:
            made.axis = axis
            made.limited, made.range = _range(joint)

    def _fill(self, body: Any, link: Link) -> None:
        """Mass and shapes of a link."""
        body.explicitinertial = True
        inertial = link.inertial
        mass = MASS if inertial is None else inertial.mass
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
        extent = self._shapes.extent(link.shapes)
        x, y, z = (0.0, 0.0, 0.0) if extent is None else extent.tolist()
        squares = (y * y + z * z, z * z + x * x, x * x + y * y)
        return (*(max(MASS / 12 * square, _LEAST_INERTIA) for square in squares), 0.0, 0.0, 0.0)


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
