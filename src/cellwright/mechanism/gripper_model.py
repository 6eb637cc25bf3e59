"""Parallel gripper in a model specification: its links as bodies, with pads that grip, and their servos.

Servos drive both fingers, and a stiff coupling keeps them at equal distances from the middle, as a rack does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco

from cellwright.config.gripper import ParallelGripperSettings
from cellwright.config.gripper_links import FINGER_MASS, PALM_MASS, GripperNames, gripper_links, palm_T_grasp
from cellwright.config.models.model import ModelShape
from cellwright.config.robot.model import Joint
from cellwright.engine import colours
from cellwright.engine.shapes import Colour, Role, add_shape, box, cylinder
from cellwright.mechanism.drives import Drive, add_drive
from cellwright.mechanism.shapes import pose_arguments

PAD_SOLIMP = (0.99, 0.999, 0.001, 0.5, 2.0)
"""Impedance of the pads' contacts. With the engine's default a part of 0.5 kg creeps by 0.1 mm a second."""

STIFFNESS = 5000.0
"""Gain of the servos [N/m]: with 0.1 kg they settle within 20 ms, and 2 ms steps are short enough for that."""

_STIFF_TIME = 0.004
"""Time constant of the coupling and of the ends of the fingers' ways [s]."""


@dataclass(frozen=True, slots=True)
class Contacts:
    """Contacts of a gripper.

    Attributes:
        bits: contype and conaffinity of all its shapes; none of them touch each other.
        time: time constant of the contacts [s].
    """

    bits: tuple[int, int]
    time: float


def add_parallel_gripper(
    spec: Any,
    body: Any,
    settings: ParallelGripperSettings,
    names: GripperNames,
    contacts: Contacts,
    distance: float = 0.0,
) -> Any:
    """Add a parallel gripper to a body of a model specification, after the servos of the arm that carries it.

    Its parts have no weight: the arm's description says what it carries. Welds to parts are the caller's, with
    `add_weld` for the palm; so is the distance between the pads in the first pose, which is 0 in the model's own.

    Args:
        spec: model specification (`MjSpec`), in radians.
        body: the body that carries it (`MjsBody`).
        settings: settings of the gripper.
        names: names of what is added.
        contacts: contacts of its shapes.
        distance: distance of the palm from that body's frame, along its z axis [m].

    Returns:
        The palm (`MjsBody`).
    """
    links, (mount, *joints) = gripper_links(settings, names, "", distance)
    palm = body.add_body(name=names.palm, **pose_arguments(mount.origin))
    block, *rods = links[names.palm].shapes
    _add(palm, block, colours.STEEL_DARK, contacts, PALM_MASS)
    for rod in rods:
        _add(palm, rod, colours.STEEL, contacts, 0.0)
    palm.add_site(name=names.grasp, pos=palm_T_grasp(settings).position)
    for joint, name in zip(joints, names.pads, strict=True):
        finger = palm.add_body(name=joint.child, **pose_arguments(joint.origin))
        bar, face = links[joint.child].shapes
        _add(finger, bar, colours.STEEL, contacts, FINGER_MASS)
        pad = _add(finger, face, colours.RUBBER, contacts, 0.0)
        pad.name = name
        # the options of the same effect, `impratio` and `noslip_iterations`, are the whole model's
        pad.solimp = PAD_SOLIMP
        pad.priority = 1
        pad.friction[0] = settings.pad.friction
        _add_joint(spec, finger, joint)
    coupling = spec.add_equality(
        name=names.coupling, type=mujoco.mjtEq.mjEQ_JOINT, name1=names.joints[0], name2=names.joints[1]
    )
    # the first finger's position as a polynomial of the second one's: equal
    coupling.data = (0.0, 1.0) + (0.0,) * 10
    coupling.solref = (_STIFF_TIME, 1.0)
    return palm


def _add_joint(spec: Any, finger: Any, joint: Joint) -> None:
    """Add the joint of a finger and its servo."""
    limits = joint.limits
    made = finger.add_joint(
        name=joint.name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=joint.axis, range=(limits.lower, limits.upper)
    )
    made.limited = mujoco.mjtLimited.mjLIMITED_TRUE
    # the engine's default lets the pads go past each other by millimetres
    made.solref_limit = (_STIFF_TIME, 1.0)
    add_drive(spec, made, Drive(p=STIFFNESS, effort=limits.effort))


def _add(body: Any, shape: ModelShape, colour: Colour, contacts: Contacts, mass: float) -> Any:
    """Add a shape that touches, and is drawn, to a body without weight; return its geom."""
    x, y, z = shape.size
    solid = box(x, y, z, shape.pose, colour, 1.0) if shape.kind == "box" else cylinder(x, y, shape.pose, colour)
    geom = add_shape(body, solid, Role.BOTH, mass=mass)
    geom.contype, geom.conaffinity = contacts.bits
    geom.solref = (contacts.time, 1.0)
    body.gravcomp = 1.0
    return geom
