"""The arm of 2017 in the engine: its chain with masses, collision shapes, servos and suction cup."""

from collections.abc import Collection
from dataclasses import replace
from typing import Any

from cellwright.cell.model import arm_looks
from cellwright.config.arm import ArmSettings, JointGains
from cellwright.config.layout.arms import Arm
from cellwright.config.robot.model import Link
from cellwright.config.ur10 import FIGURES, GRIPPER, UR10, WRIST_3_T_TOOL
from cellwright.engine.shapes import Visuals
from cellwright.mechanism.chain import add_chain, give_mass
from cellwright.mechanism.drives import Drive, add_drive
from cellwright.util.errors import UnknownNameError

CUP_GEOM = "vacuum_gripper_cup"

CUP_FACE_GEOM = "vacuum_gripper_face"
"""Plain disc that the cup stands for: the suction acts on what comes near its face."""


def gains_of(settings: ArmSettings) -> dict[str, JointGains]:
    """Return the original's gains of each joint, overridden by those in the settings."""
    return {name: settings.gains.get(name, figures.gains) for name, figures in FIGURES.items()}


def check_joints(joints: Collection[str], *names: str) -> None:
    """Raise UnknownNameError unless an arm has joints of all these names."""
    for name in names:
        if name not in joints:
            raise UnknownNameError("arm joint", name, joints)


def add_arm(spec: Any, visuals: Visuals, settings: ArmSettings, contact_time: float, arm: Arm) -> None:
    """Add rail, arm and cup to a model specification.

    Args:
        spec: model specification.
        visuals: receives what is only seen of it.
        settings: servo profile and gains.
        contact_time: time constant [s] of the cup's contacts.
        arm: the arm.
    """
    prefix = arm.prefix

    def fill(body: Any, link: Link) -> None:
        if link.inertial is None:
            arm_looks.dress_rail(body, visuals)
            return
        # the principal axes are those of the link
        give_mass(body, link.inertial.mass, link.inertial.pose.position, link.inertial.inertia[:3])
        if settings.servo == "precise":
            body.gravcomp = 1.0
        if link.name == GRIPPER:
            arm_looks.dress_cup(spec, visuals, body, prefix + CUP_GEOM, prefix + CUP_FACE_GEOM, contact_time)
            return
        arm_looks.dress_link(spec, visuals, body, link.name)
        if link.name == "base_link":
            body.add_site(name=f"{prefix}base", quat=(0.0, 0.0, 0.0, 1.0))
        elif link.name == "wrist_3_link":
            for name, pose in WRIST_3_T_TOOL.items():
                body.add_site(name=prefix + name, pos=pose.position, quat=pose.quaternion)

    joints = add_chain(spec.worldbody, UR10, fill, pose=arm.pose, body_of=lambda link: prefix + link)
    for name, drive in drives_of(settings).items():
        joints[name].name = prefix + name
        add_drive(spec, joints[name], drive)


def drives_of(settings: ArmSettings) -> dict[str, Drive]:
    """Return the drive of each joint by name.

    `original`: the effort controller's gains and the joint's damping. `precise`: an ideal, critically damped drive,
    free of damping and weight. Gains in the settings still override it.
    """
    is_precise, drives = settings.servo == "precise", {}
    for name, gains in gains_of(settings).items():
        figures = FIGURES[name]
        is_ideal = is_precise and name not in settings.gains
        drives[name] = replace(
            Drive(figures.stiffness) if is_ideal else Drive(gains.p, gains.d, gains.i, gains.i_clamp),
            effort=UR10.joint(name).limits.effort,
            damping=0.0 if is_precise else figures.damping,
            armature=figures.armature if is_precise else 0.0,
            dry_friction=settings.dry_friction.get(name, 0.0),
        )
    return drives
