"""Links of a parallel gripper: palm and two prismatic fingers, as the engine and robot descriptions have them.

The palm's frame has z along the fingers, out of the flange, and y across them: the fingers close along y.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from cellwright.config.gripper import ParallelGripperSettings
from cellwright.config.models.model import ModelShape
from cellwright.config.robot.model import Inertial, Joint, JointType, Limits, Link
from cellwright.util.pose import Pose, Vector3

SIDES: Final = ("left", "right")
"""The fingers: `left` moves to +y when the gripper opens."""

PALM_DEPTH: Final = 0.06
"""Extent of the palm along z [m]."""
FINGER_GAP: Final = 0.02
"""Distance from the palm to the pads [m]: parts may stand out that far above them."""

PALM_MASS: Final = 0.5
FINGER_MASS: Final = 0.1
"""Mass of a finger [kg], its drive included.

With an inertia of the joint instead, which the arm does not move, fingers follow too slowly: they let go of a disc
when the arm's acceleration along y jumps by 10 m/s^2.
"""

_PALM_WIDTH = 0.06
_FINGER_THICKNESS, _PAD_THICKNESS = 0.012, 0.006
_ROD = 0.02
"""Radius of the rod between a flange and a palm before it [m]."""


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


def palm_T_grasp(settings: ParallelGripperSettings) -> Pose:
    """Return the pose of the middle between the pads in the palm's frame."""
    return Pose((0.0, 0.0, PALM_DEPTH + FINGER_GAP + settings.pad.size[1] / 2))


def gripper_links(
    settings: ParallelGripperSettings, names: GripperNames, carrier: str, distance: float = 0.0
) -> tuple[dict[str, Link], list[Joint]]:
    """Return the links of a gripper by name, and their joints: the palm's, then those of both fingers.

    The last shape of a finger is its pad.

    Args:
        settings: settings of the gripper.
        names: names of its links and joints.
        carrier: link that carries it, along whose z axis it points.
        distance: distance of the palm from the frame of that link [m].
    """
    across, along = settings.pad.size
    wide, long = settings.opening + 2 * (_FINGER_THICKNESS + _PAD_THICKNESS), FINGER_GAP + along
    shapes = [ModelShape("box", (_PALM_WIDTH, wide, PALM_DEPTH), Pose((0.0, 0.0, PALM_DEPTH / 2)))]
    if distance > 0.0:
        shapes.append(ModelShape("cylinder", (_ROD, distance, 0.0), Pose((0.0, 0.0, -distance / 2))))
    links = {names.palm: Link(names.palm, _inertial(PALM_MASS, shapes[0]), tuple(shapes))}
    joints = [Joint(f"{names.palm}_joint", JointType.FIXED, carrier, names.palm, Pose((0.0, 0.0, distance)))]
    limits = Limits(0.0, settings.opening / 2, settings.force / 2, settings.speed / 2)
    for finger, joint, outward in zip(names.fingers, names.joints, (1.0, -1.0), strict=True):
        middle = outward * (_PAD_THICKNESS + _FINGER_THICKNESS / 2)
        bar = ModelShape("box", (across, _FINGER_THICKNESS, long), Pose((0.0, middle, long / 2)))
        place = Pose((0.0, outward * _PAD_THICKNESS / 2, FINGER_GAP + along / 2))
        pad = ModelShape("box", (across, _PAD_THICKNESS, along), place)
        links[finger] = Link(finger, _inertial(FINGER_MASS, bar), (bar, pad))
        axis: Vector3 = (0.0, outward, 0.0)
        origin = Pose((0.0, 0.0, PALM_DEPTH))
        joints.append(Joint(joint, JointType.PRISMATIC, names.palm, finger, origin, axis, limits))
    return links, joints


def _inertial(mass: float, shape: ModelShape) -> Inertial:
    """Return the inertia of a box."""
    x, y, z = (edge**2 * mass / 12 for edge in shape.size)
    return Inertial(mass, shape.pose, (y + z, x + z, x + y, 0.0, 0.0, 0.0))
