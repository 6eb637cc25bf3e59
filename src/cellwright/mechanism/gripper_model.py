"""Parallel gripper in a model specification: palm, two prismatic fingers with pads, and their servos.

The palm's frame has z along the fingers, out of the flange, and y across them: the fingers close along y. Servos drive
both fingers, and a stiff coupling keeps them at equal distances from the middle, as a rack does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco

from cellwright.config.gripper import ParallelGripperSettings
from cellwright.engine import colours
from cellwright.engine.shapes import Role, Shape, add_shape, at, box
from cellwright.mechanism.drives import Drive, add_drive
from cellwright.util.pose import Pose

SIDES = ("left", "right")
"""The fingers: `left` moves to +y when the gripper opens."""

PALM_DEPTH = 0.06
"""Extent of the palm along z [m]."""
FINGER_GAP = 0.02
"""Distance from the palm to the pads [m]: parts may stand out that far above them."""

PAD_SOLIMP = (0.99, 0.999, 0.001, 0.5, 2.0)
"""Impedance of the pads' contacts. With the engine's default a part of 0.5 kg creeps by 0.1 mm a second."""

STIFFNESS = 5000.0
"""Gain of the servos [N/m]: with 0.1 kg they settle within 20 ms, and 2 ms steps are short enough for that."""

_PALM_WIDTH, _PALM_MASS = 0.06, 0.5
_FINGER_THICKNESS, _PAD_THICKNESS = 0.012, 0.006
_FINGER_MASS = 0.1
"""Mass of a finger [kg], its drive included.

With an inertia of the joint instead, which the arm does not move, fingers follow too slowly: they let go of a disc
when the arm's acceleration along y jumps by 10 m/s^2.
"""
_STIFF_TIME = 0.004
"""Time constant of the coupling and of the ends of the fingers' ways [s]."""


@dataclass(frozen=True, slots=True)
class GripperNames:
    """Names of a parallel gripper in the engine, each with the same prefix.

    Attributes:
        prefix: the prefix; empty for none.

    Example:
        >>> GripperNames("arm1_").joints
        ('arm1_left_finger_joint', 'arm1_right_finger_joint')
    """

    prefix: str = ""

    @property
    def palm(self) -> str:
        """The body that holds parts by a weld."""
        return f"{self.prefix}gripper_palm"

    @property
    def grasp(self) -> str:
        """The site between the pads, with the palm's orientation."""
        return f"{self.prefix}gripper_grasp"

    @property
    def fingers(self) -> tuple[str, str]:
        """The fingers' bodies, left and right."""
        return self._of_sides("finger")

    @property
    def joints(self) -> tuple[str, str]:
        """The fingers' joints, which are also their servos; a position is half the distance between the pads."""
        return self._of_sides("finger_joint")

    @property
    def pads(self) -> tuple[str, str]:
        """The geoms that grip."""
        return self._of_sides("pad")

    @property
    def coupling(self) -> str:
        """The constraint that keeps the fingers at equal distances from the middle."""
        return f"{self.prefix}finger_coupling"

    def _of_sides(self, kind: str) -> tuple[str, str]:
        left, right = (f"{self.prefix}{side}_{kind}" for side in SIDES)
        return left, right


@dataclass(frozen=True, slots=True)
class Contacts:
    """Contacts of a gripper.

    Attributes:
        bits: contype and conaffinity of all its shapes; none of them touch each other.
        time: time constant of the contacts [s].
    """

    bits: tuple[int, int]
    time: float


def palm_T_grasp(settings: ParallelGripperSettings) -> Pose:
    """Return the pose of the middle between the pads in the palm's frame."""
    return Pose((0.0, 0.0, PALM_DEPTH + FINGER_GAP + settings.pad.size[1] / 2))


def add_parallel_gripper(
    spec: Any, body: Any, body_T_palm: Pose, settings: ParallelGripperSettings, names: GripperNames, contacts: Contacts
) -> Any:
    """Add a parallel gripper to a body of a model specification, after the servos of the arm that carries it.

    Its parts have no weight: the arm's description says what it carries. Welds to parts are the caller's, with
    `add_weld` for the palm; so is the distance between the pads in the first pose, which is 0 in the model's own.

    Args:
        spec: model specification (`MjSpec`), in radians.
        body: the body that carries it (`MjsBody`).
        body_T_palm: pose of the palm in the frame of that body.
        settings: settings of the gripper.
        names: names of what is added.
        contacts: contacts of its shapes.

    Returns:
        The palm (`MjsBody`).
    """
    palm = body.add_body(name=names.palm, pos=body_T_palm.position, quat=body_T_palm.quaternion)
    width = settings.opening + 2 * (_FINGER_THICKNESS + _PAD_THICKNESS)
    shape = box(_PALM_WIDTH, width, PALM_DEPTH, at(z=PALM_DEPTH / 2), colours.STEEL_DARK, 1.0)
    _add(palm, shape, contacts, _PALM_MASS)
    grasp = palm_T_grasp(settings)
    palm.add_site(name=names.grasp, pos=grasp.position)
    for side in range(2):
        _add_finger(spec, palm, settings, names, contacts, side)
    coupling = spec.add_equality(
        name=names.coupling, type=mujoco.mjtEq.mjEQ_JOINT, name1=names.joints[0], name2=names.joints[1]
    )
    # the first finger's position as a polynomial of the second one's: equal
    coupling.data = (0.0, 1.0) + (0.0,) * 10
    coupling.solref = (_STIFF_TIME, 1.0)
    return palm


def _add_finger(
    spec: Any, palm: Any, settings: ParallelGripperSettings, names: GripperNames, contacts: Contacts, side: int
) -> None:
    """Add a finger with its pad, its joint and its servo."""
    outward = (1.0, -1.0)[side]
    across, along = settings.pad.size
    length = FINGER_GAP + along
    finger = palm.add_body(name=names.fingers[side], pos=(0.0, 0.0, PALM_DEPTH))
    middle = outward * (_PAD_THICKNESS + _FINGER_THICKNESS / 2)
    bar = box(across, _FINGER_THICKNESS, length, at(y=middle, z=length / 2), colours.STEEL, 1.0)
    _add(finger, bar, contacts, _FINGER_MASS)
    place = at(y=outward * _PAD_THICKNESS / 2, z=FINGER_GAP + along / 2)
    pad = _add(finger, box(across, _PAD_THICKNESS, along, place, colours.RUBBER), contacts, 0.0)
    pad.name = names.pads[side]
    # the options of the same effect, `impratio` and `noslip_iterations`, are the whole model's
    pad.solimp = PAD_SOLIMP
    pad.priority = 1
    pad.friction[0] = settings.pad.friction
    joint = finger.add_joint(
        name=names.joints[side],
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=(0.0, outward, 0.0),
        range=(0.0, settings.opening / 2),
    )
    joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE
    # the engine's default lets the pads go past each other by millimetres
    joint.solref_limit = (_STIFF_TIME, 1.0)
    add_drive(spec, joint, Drive(p=STIFFNESS, effort=settings.force / 2))


def _add(body: Any, shape: Shape, contacts: Contacts, mass: float) -> Any:
    """Add a shape that touches, and is drawn, to a body without weight; return its geom."""
    geom = add_shape(body, shape, Role.BOTH, mass=mass)
    geom.contype, geom.conaffinity = contacts.bits
    geom.solref = (contacts.time, 1.0)
    body.gravcomp = 1.0
    return geom
