"""UR10 arm on its rail: chain, masses, collision shapes, servos and suction cup.

Kinematics: Denavit-Hartenberg constants of the UR10 (CB3) [m], d1 .1273, a2 .612, a3 .5723, d4 .163941, d5 .1157,
d6 .0922. The frames are those of its public robot description, on a rail along world y. A link has the inertia of a
solid cylinder, as in that description.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mujoco

from cellwright.cell.model import arm_looks
from cellwright.config.arm import ARM_JOINTS
from cellwright.config.trial.trial import ArmSettings, JointGains, ServoProfile
from cellwright.engine.shapes import Visuals
from cellwright.util.errors import UnknownNameError
from cellwright.util.pose import Pose, Vector3

GRIPPER = "vacuum_gripper_link"
"""Link that holds the cup; its z axis points out of the back of the cup, up when the tool points down."""

CUP_GEOM = "vacuum_gripper_cup"

CUP_FACE_GEOM = "vacuum_gripper_face"
"""Plain disc that the cup stands for: the suction acts on what comes near its face."""

_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
_TURN = 2 * math.pi
_BENT = (0.0, math.pi / 2, 0.0)
INITIAL_POSITIONS: Mapping[str, float] = dict(zip(ARM_JOINTS, (0.0, 3.14, -1.13, 1.51, 3.77, -1.51, 0.0), strict=True))
"""Default initial joint positions [rad], [m]."""
WRIST_3_T_TOOL = {
    "ee_link": Pose.from_rpy((0.0, 0.0922, 0.0), (0.0, 0.0, math.pi / 2)),
    "tool0": Pose.from_rpy((0.0, 0.0922, 0.0), (-math.pi / 2, 0.0, 0.0)),
}
"""Frames of the flange in that of the last link."""
WRIST_3_T_GRIPPER = Pose.from_rpy((0.0, 0.1, 0.0), (90 * 0.0174533, 0.0, 0.0))
"""The cup on the last link, turned with the original's rounding."""


@dataclass(frozen=True, slots=True)
class ArmJoint:
    """Joint with the link behind it and the original's servo figures.

    Attributes:
        pose: pose of that link in the frame of the previous link, at joint value 0.
        gains: gains of the original's effort controller.
        limit: the joint runs from -limit to limit [rad] or [m].
        effort: maximum force [N] or torque [N m] of the drive.
        velocity: published limit [m/s] or [rad/s]. As in the original, no command is clamped to it.
        damping: viscous [N s/m] or [N m s/rad].
        friction: dry [N] or [N m], as published. In the original it never acted. The engine dropped the motor that
            carries it, since it sets both stops of a damped joint to one value. Only the URDF contains it.
        stiffness: position gain of the `precise` profile.
        armature: inertia of the drive at the joint, `precise` profile [kg] or [kg m^2].
    """

    name: str
    link: str
    pose: Pose
    axis: Vector3
    gains: JointGains
    limit: float
    effort: float
    velocity: float
    damping: float
    friction: float
    stiffness: float
    armature: float


@dataclass(frozen=True, slots=True)
class Cylinder:
    """Link as a solid cylinder along z, for its inertia: mass [kg], radius and length [m].

    Its middle is at this height [m] in the link's frame.
    """

    mass: float
    radius: float
    length: float
    middle: float = 0.0

    @property
    def across(self) -> float:
        """Moment of inertia [kg m^2] about a diameter through the middle."""
        return self.mass * (3 * self.radius**2 + self.length**2) / 12

    @property
    def along(self) -> float:
        """Moment of inertia [kg m^2] about the cylinder's axis."""
        return self.mass * self.radius**2 / 2


JOINTS: tuple[ArmJoint, ...] = (
    ArmJoint(
        "linear_arm_actuator_joint", "base_link", Pose((0.0, 0.0, 0.1)), _Y,
        JointGains(10000, 500, 0, 1), 2.1, 1000, 3.0, 20, 500, 6e5, 10.0,
    ),
    ArmJoint(
        "shoulder_pan_joint", "shoulder_link", Pose((0.0, 0.0, 0.1273)), _Z,
        JointGains(10000, 150, 0, 1), _TURN, 530, 2.16, 20, 20, 1.2e5, 1.0,
    ),
    ArmJoint(
        "shoulder_lift_joint", "upper_arm_link", Pose.from_rpy((0.0, 0.220941, 0.0), _BENT), _Y,
        JointGains(50000, 150, 10, 50), _TURN, 330, 2.16, 20, 0, 1.2e5, 1.0,
    ),
    ArmJoint(
        "elbow_joint", "forearm_link", Pose((0.0, -0.1719, 0.612)), _Y,
        JointGains(50000, 150, 1, 25), _TURN, 150, 3.15, 20, 0, 1.2e5, 0.5,
    ),
    ArmJoint(
        "wrist_1_joint", "wrist_1_link", Pose.from_rpy((0.0, 0.0, 0.5723), _BENT), _Y,
        JointGains(100, 5, 0, 1), _TURN, 54, 3.2, 1, 0, 1.2e4, 0.1,
    ),
    ArmJoint(
        "wrist_2_joint", "wrist_2_link", Pose((0.0, 0.1149, 0.0)), _Z,
        JointGains(75, 2, 0, 1), _TURN, 54, 3.2, 1, 0, 1.2e4, 0.1,
    ),
    ArmJoint(
        "wrist_3_joint", "wrist_3_link", Pose((0.0, 0.0, 0.1157)), _Y,
        JointGains(25, 1, 0, 1), _TURN, 54, 3.2, 0.5, 0, 1.2e4, 0.1,
    ),
)  # fmt: skip
"""Joints in the order of the chain, which is the controller's order."""


BODIES: Mapping[str, Cylinder] = {
    "base_link": Cylinder(4.0, 0.075, 0.038),
    "shoulder_link": Cylinder(7.778, 0.075, 0.178),
    "upper_arm_link": Cylinder(12.93, 0.075, 0.612, 0.306),
    "forearm_link": Cylinder(3.87, 0.075, 0.5723, 0.28615),
    "wrist_1_link": Cylinder(1.96, 0.075, 0.12),
    "wrist_2_link": Cylinder(1.96, 0.075, 0.12),
    "wrist_3_link": Cylinder(0.202, 0.075, 0.12),
    GRIPPER: Cylinder(0.01, 0.05, 0.01),
}
"""Mass and form of each link that the arm moves."""


def gains_of(settings: ArmSettings) -> dict[str, JointGains]:
    """Return the original's gains of each joint, overridden by those in the settings."""
    return {joint.name: settings.gains.get(joint.name, joint.gains) for joint in JOINTS}


def check_joints(*names: str) -> None:
    """Raise UnknownNameError unless the arm has joints of all these names."""
    for name in names:
        if name not in ARM_JOINTS:
            raise UnknownNameError("arm joint", name, ARM_JOINTS)


def add_arm(spec: Any, visuals: Visuals, settings: ArmSettings, contact_time: float, rail_pose: Pose) -> None:
    """Add rail, arm and cup to a model specification, before everything else: the solver prefers the long tree first.

    Args:
        spec: model specification.
        visuals: receives what is only seen of it.
        settings: servo profile and gains.
        contact_time: time constant [s] of the cup's contacts.
        rail_pose: frame of the rail, `linear_arm_actuator`, in the world.
    """
    rail = spec.worldbody.add_body(name="linear_arm_actuator", pos=rail_pose.position, quat=rail_pose.quaternion)
    arm_looks.dress_rail(rail, visuals)
    gains = gains_of(settings)
    link = rail
    for joint in JOINTS:
        link = link.add_body(name=joint.link, pos=joint.pose.position, quat=joint.pose.quaternion)
        _give_mass(link, BODIES[joint.link], settings.servo)
        _add_joint(spec, link, joint, settings, gains[joint.name])
        arm_looks.dress_link(spec, visuals, link, joint.link)
        if joint.link == "base_link":
            link.add_site(name="base", quat=(0.0, 0.0, 0.0, 1.0))
    for name, pose in WRIST_3_T_TOOL.items():
        link.add_site(name=name, pos=pose.position, quat=pose.quaternion)
    gripper = link.add_body(name=GRIPPER, pos=WRIST_3_T_GRIPPER.position, quat=WRIST_3_T_GRIPPER.quaternion)
    _give_mass(gripper, BODIES[GRIPPER], settings.servo)
    arm_looks.dress_cup(spec, visuals, gripper, CUP_GEOM, CUP_FACE_GEOM, contact_time)


def _give_mass(link: Any, form: Cylinder, servo: ServoProfile) -> None:
    """Set mass and inertia of a link; the `precise` profile compensates the arm's weight."""
    link.explicitinertial = True
    link.mass = form.mass
    link.ipos = (0.0, 0.0, form.middle)
    link.inertia = (form.across, form.across, form.along)
    if servo == "precise":
        link.gravcomp = 1.0


def _add_joint(spec: Any, link: Any, joint: ArmJoint, settings: ArmSettings, gains: JointGains) -> None:
    """Add a joint and its servo: a `pid` actuator with position and velocity setpoints and a force limit.

    `original`: the effort controller's gains and the joint's damping. The integral term is clamped to +-i_clamp in
    units of force; the engine clamps the integral itself.

    `precise`: an ideal, critically damped drive, free of damping and weight. Gains in the settings still override it.
    """
    prismatic = joint.name == "linear_arm_actuator_joint"
    kind = mujoco.mjtJoint.mjJNT_SLIDE if prismatic else mujoco.mjtJoint.mjJNT_HINGE
    dof = link.add_joint(name=joint.name, type=kind, axis=joint.axis, range=(-joint.limit, joint.limit))
    dof.limited = mujoco.mjtLimited.mjLIMITED_TRUE
    servo = spec.add_actuator(name=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=joint.name)
    if settings.servo == "precise" and joint.name not in settings.gains:
        servo.set_to_pid(kp=joint.stiffness, dampratio=1.0)
    elif gains.i and gains.i_clamp:
        servo.set_to_pid(kp=gains.p, kv=gains.d, ki=gains.i, imax=gains.i_clamp / abs(gains.i))
    else:
        servo.set_to_pid(kp=gains.p, kv=gains.d)
    servo.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
    servo.forcerange = (-joint.effort, joint.effort)
    if settings.servo == "precise":
        dof.armature = joint.armature
    else:
        dof.damping[0] = joint.damping
    if friction := settings.dry_friction.get(joint.name, 0.0):
        dof.frictionloss = friction
        # softer dry friction creeps under a steady load instead of holding it
        dof.solref_friction = (0.004, 1.0)
        dof.solimp_friction = (0.9999, 0.9999, 0.001, 0.5, 2.0)
