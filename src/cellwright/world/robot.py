"""A robot in the engine: a body for each link, a joint for each that moves, nothing else.

Joints are driven from outside, by `devices/joint_servos.py`. What a URDF leaves open is filled in as the original of
the io_teleop node did: a link without mass weighs 1 kg, and the links that a gripper drives 0.1 kg (measured: with
these the recorded motion of the QingLong is met, without them its wrists are four times too quick).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import mujoco
import numpy as np

from cellwright.description.model import ModelShape
from cellwright.description.robot.config import RobotConfig
from cellwright.description.robot.model import Inertial, Joint, JointType, Link, RobotModel
from cellwright.pose import IDENTITY_QUATERNION, Pose
from cellwright.world.robot_floor import add_floor, put_floor_under

TIMESTEP = Fraction(1, 240)
"""Of the original's physics [s]."""
MASS = 1.0
"""Of a link that the file gives no mass for [kg]; its inertia is next to nothing."""
FINGER_MASS = 0.1
"""Of a link that a gripper's joint moves [kg]."""
GREY = (0.62, 0.64, 0.67, 1.0)

_LEAST_MASS, _LEAST_INERTIA = 1e-6, 1e-9  # the engine takes no body that moves and has none
_HINGE = {
    JointType.REVOLUTE: mujoco.mjtJoint.mjJNT_HINGE,
    JointType.CONTINUOUS: mujoco.mjtJoint.mjJNT_HINGE,
    JointType.PRISMATIC: mujoco.mjtJoint.mjJNT_SLIDE,
    JointType.SPHERICAL: mujoco.mjtJoint.mjJNT_BALL,
}
_SHAPE = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
}
BASE = "cellwright base"
"""Name of the body that carries the robot: it has no place in the URDF, and moves as `target_base_move` says."""


@dataclass(frozen=True)
class RobotWorld:
    """A robot, and the engine's model of it: bodies are named after links, joints and actuators after joints.

    The actuators exert nothing: their controls are where the targets of the joints stand [rad; m], so that they are
    part of the engine's state and can be moved in its own window.
    """

    config: RobotConfig
    model: mujoco.MjModel

    def put_in_first_pose(self, data: mujoco.MjData) -> None:
        """Write the posture that the robot is put up in."""
        for name, position in self.config.start.items():
            data.qpos[self.model.joint(name).qposadr[0]] = position


def build_robot(config: RobotConfig, *, timestep: Fraction = TIMESTEP, self_collision: bool = False) -> RobotWorld:
    """The world with a robot in it and nothing else, without gravity, as in the original.

    Args:
        config: the robot.
        timestep: length of a step [s].
        self_collision: whether links may touch each other; those that are joined to each other never do.
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
    option.iterations = 20
    builder = _Builder(spec, config, is_touched=self_collision)
    builder.build()
    add_floor(spec)
    world = RobotWorld(config, spec.compile())
    data = mujoco.MjData(world.model)
    world.put_in_first_pose(data)
    put_floor_under(world.model, data)
    return world


class _Builder:
    def __init__(self, spec: Any, config: RobotConfig, *, is_touched: bool) -> None:
        self._spec = spec
        self._robot: RobotModel = config.robot
        self._config = config
        self._is_touched = is_touched
        self._fingers = {self._robot.joint(name).child for gripper in config.grippers for name in gripper.joints}
        self._joints_at: dict[str, list[Joint]] = {name: [] for name in self._robot.links}
        for joint in self._robot.joints:
            self._joints_at[joint.parent].append(joint)
            self._joints_at[joint.child].append(joint)

    def build(self) -> None:
        """The base with the robot on it; it is grown from the link that is fastened to the world."""
        base = self._spec.worldbody.add_body(name=BASE, mocap=True, **_placed(self._config.base_pose))
        first = self._config.fixed_link or self._robot.root
        body = base.add_body(name=first)
        self._fill(body, self._robot.links[first])
        self._grow(body, first, None)
        for joint in self._robot.driven:
            limits = joint.limits
            actuator = self._spec.add_actuator(name=joint.name, target=joint.name)
            actuator.trntype = mujoco.mjtTrn.mjTRN_JOINT
            actuator.gainprm[0] = 0.0
            actuator.ctrllimited = math.isfinite(limits.lower) and math.isfinite(limits.upper)
            actuator.ctrlrange = (limits.lower, limits.upper) if actuator.ctrllimited else (0.0, 0.0)

    def _grow(self, body: Any, link: str, come_by: Joint | None) -> None:
        for joint in self._joints_at[link]:
            if joint is come_by:
                continue
            is_turned_over = joint.child == link
            other = joint.parent if is_turned_over else joint.child
            placed = joint.origin.inverse() if is_turned_over else joint.origin
            grown = body.add_body(name=other, **_placed(placed))
            self._fill(grown, self._robot.links[other])
            if joint.type in _HINGE:
                self._add_joint(grown, joint, is_turned_over=is_turned_over)
            self._grow(grown, other, joint)

    def _add_joint(self, body: Any, joint: Joint, *, is_turned_over: bool) -> None:
        """A joint; seen from its child, its axis points the other way and goes through where the child's frame is."""
        axis, at = joint.axis, (0.0, 0.0, 0.0)
        if is_turned_over:
            x, y, z = joint.origin.rotate(axis)
            axis, at = (-x, -y, -z), joint.origin.position
        made = body.add_joint(name=joint.name, type=_HINGE[joint.type], pos=at)
        if joint.is_driven:
            made.axis = axis
            limits = joint.limits
            made.limited = math.isfinite(limits.lower) and math.isfinite(limits.upper)
            made.range = (limits.lower, limits.upper) if made.limited else (0.0, 0.0)

    def _fill(self, body: Any, link: Link) -> None:
        """Mass and shapes of a link."""
        body.explicitinertial = True
        inertial = link.inertial
        mass = MASS if inertial is None else inertial.mass
        inertia = (_LEAST_INERTIA,) * 3 + (0.0,) * 3 if inertial is None else _in_link_frame(inertial)
        if link.name in self._fingers:
            factor = FINGER_MASS / mass if mass > 0 else 0.0
            mass, inertia = FINGER_MASS, tuple(factor * value for value in inertia)
        body.mass = mass
        body.fullinertia = inertia
        body.ipos = (0.0, 0.0, 0.0) if inertial is None else inertial.pose.position
        for shape in link.shapes:
            self._add_shape(body, shape)

    def _add_shape(self, body: Any, shape: ModelShape) -> None:
        if shape.kind == "mesh":  # TODO: read it
            return
        x, y, z = shape.size
        half = {"box": (x / 2, y / 2, z / 2), "sphere": (x, 0.0, 0.0)}.get(shape.kind, (x, y / 2, 0.0))
        is_touched = shape.is_touched and self._is_touched
        geom = body.add_geom(
            type=_SHAPE[shape.kind],
            size=half,
            rgba=shape.colour or GREY,
            contype=int(is_touched),
            conaffinity=int(is_touched),
            group=2 if shape.is_seen else 3,
            **_placed(shape.pose),
        )
        geom.mass = 0.0


def _in_link_frame(inertial: Inertial) -> tuple[float, ...]:
    """The inertia about the centre of mass along the axes of the link, in the order of `Inertial`."""
    xx, yy, zz, xy, xz, yz = inertial.inertia
    if inertial.pose.quaternion == IDENTITY_QUATERNION:
        return inertial.inertia
    rotation = np.array([inertial.pose.rotate(axis) for axis in ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))]).T
    turned = rotation @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ rotation.T
    return tuple(turned[row, column] for row, column in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))


def _placed(pose: Pose) -> dict[str, Any]:
    return {"pos": pose.position, "quat": pose.quaternion if pose.quaternion != IDENTITY_QUATERNION else (1, 0, 0, 0)}
