"""Drives of joints in the engine: servos with position and velocity set points, and what resists at the joint.

A stiff drive follows a joint as a second-order system of angular frequency w, critically damped: p = w^2 I, d = 2 w I.
I is the largest inertia that the joint has in any posture, so the drive is at least as fast in all others. With
w = 80 rad/s and the arm's weight compensated, quintic motions at 70 % of the speed limits stay within 10 mrad of their
course: measured were 0.7 mrad (Panda, iiwa7), 1.2 (xArm7, UR10) and 2.3 (UR5, UR5e).
"""

import math
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from cellwright.config.robot.given_drives import GivenDrive
from cellwright.config.robot.model import Joint, JointType, Link, RobotModel
from cellwright.mechanism.chain import add_chain, give_mass, inertia_along_link
from cellwright.util.halton import halton

BANDWIDTH = 80.0
"""Angular frequency of a stiff drive [rad/s]."""

ARMATURE = 0.1
"""Inertia of the drive of a turning joint [kg m^2], where a description states none.

Without it a part of 0.5 kg at the cup turns a wrist by 14 mrad.
"""

_POSTURES = 200  # in which the inertia of each joint is looked up
_HALF_RANGE = 3.0  # [rad; m] for joints without limits
_NO_MASS, _NO_INERTIA = 1e-6, 1e-9  # of links that are frames alone
# softer dry friction creeps under a steady load instead of holding it
_FRICTION_TIME, _FRICTION_HOLD = (0.004, 1.0), (0.9999, 0.9999, 0.001, 0.5, 2.0)


@dataclass(frozen=True, slots=True)
class Drive:
    """Servo of a joint and what resists there, in N, m, s for a sliding and N m, rad, s for a turning joint.

    Attributes:
        p: force for each unit of position error.
        d: force for each unit of velocity error; None: critically damped, as the engine finds it.
        i: force for each unit of position error and second.
        i_clamp: largest force of the integral term; 0: there is none.
        effort: largest force.
        damping: viscous friction at the joint.
        armature: inertia of the drive at the joint [kg; kg m^2].
        dry_friction: force that dry friction can hold.
    """

    p: float
    d: float | None = None
    i: float = 0.0
    i_clamp: float = 0.0
    effort: float = math.inf
    damping: float = 0.0
    armature: float = 0.0
    dry_friction: float = 0.0


def add_drive(spec: Any, joint: Any, drive: Drive, name: str = "") -> None:
    """Add the servo of a joint to a model specification: its controls are a position and a velocity.

    The engine clamps the integral itself; `i_clamp` is in units of force.

    Args:
        spec: model specification.
        joint: joint of the specification, as `add_chain` returns it.
        drive: the figures.
        name: name of the actuator; that of the joint by default.
    """
    servo = spec.add_actuator(name=name or joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=joint.name)
    if drive.d is None:
        servo.set_to_pid(kp=drive.p, dampratio=1.0)
    elif drive.i and drive.i_clamp:
        servo.set_to_pid(kp=drive.p, kv=drive.d, ki=drive.i, imax=drive.i_clamp / abs(drive.i))
    else:
        servo.set_to_pid(kp=drive.p, kv=drive.d)
    if math.isfinite(drive.effort):
        servo.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
        servo.forcerange = (-drive.effort, drive.effort)
    joint.armature = drive.armature
    joint.damping[0] = drive.damping
    if drive.dry_friction:
        joint.frictionloss = drive.dry_friction
        joint.solref_friction, joint.solimp_friction = _FRICTION_TIME, _FRICTION_HOLD


def stiff_drives(robot: RobotModel, bandwidth: float = BANDWIDTH) -> dict[str, Drive]:
    """Return stiff drives for all joints of a robot, by name, whose weight has to be compensated.

    Args:
        robot: the robot; joints have the efforts of its file.
        bandwidth: angular frequency of the drives [rad/s].
    """
    drives = {}
    for joint, inertia in zip(robot.driven, _largest_inertias(robot), strict=True):
        armature = 0.0 if joint.type is JointType.PRISMATIC else ARMATURE
        total = inertia + armature
        drives[joint.name] = Drive(
            p=bandwidth**2 * total, d=2.0 * bandwidth * total, effort=joint.limits.effort, armature=armature
        )
    return drives


def given_drive(given: GivenDrive, effort: float) -> Drive:
    """Return the drive of a joint as its file gives it.

    In the file its set point is a position alone, so it lags behind a motion; here it has the velocity too.

    Args:
        given: the file's figures.
        effort: its largest force [N; N m].
    """
    servo, dynamics = given.servo, given.dynamics
    return Drive(
        p=servo.kp,
        d=servo.kv,
        effort=effort,
        damping=dynamics.damping,
        armature=dynamics.armature,
        dry_friction=dynamics.friction,
    )


def give_link_mass(body: Any, link: Link) -> None:
    """Set the mass of a link; one without a mass is a frame alone."""
    inertial = link.inertial
    if inertial is None or inertial.mass <= 0.0 or not any(inertial.inertia):
        give_mass(body, _NO_MASS, (0.0, 0.0, 0.0), (_NO_INERTIA,) * 3)
    else:
        give_mass(body, inertial.mass, inertial.pose.position, inertia_along_link(inertial))


def _largest_inertias(robot: RobotModel) -> list[float]:
    """Return the largest inertia [kg; kg m^2] that each driven joint has in a sample of postures.

    The postures are Halton points over the joints' ranges: the same for each call.
    """
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.compiler.boundmass, spec.compiler.boundinertia, spec.compiler.balanceinertia = _NO_MASS, _NO_INERTIA, True
    add_chain(spec.worldbody, robot, give_link_mass, body_of=lambda link: f"link {link}")
    model = spec.compile()
    data, inertias = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    places = [model.joint(joint.name).qposadr[0] for joint in robot.driven]
    dofs = [model.joint(joint.name).dofadr[0] for joint in robot.driven]
    lower, upper = np.array([_finite_range(joint) for joint in robot.driven]).reshape(-1, 2).T
    largest = np.zeros(len(dofs))
    for point in halton(_POSTURES, len(dofs)):
        data.qpos[places] = lower + (upper - lower) * point
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fullM(model, data, inertias)
        largest = np.maximum(largest, inertias.diagonal()[dofs])
    return [float(value) for value in largest]


def _finite_range(joint: Joint) -> tuple[float, float]:
    """Return the limits of a joint [rad; m], or some range where it has none."""
    lower, upper = joint.limits.lower, joint.limits.upper
    return (max(lower, -_HALF_RANGE), min(upper, _HALF_RANGE)) if lower < upper else (-_HALF_RANGE, _HALF_RANGE)
