"""Chains in the engine: the links of a described robot as bodies on another body, and its joints between them."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import mujoco
import numpy as np

from cellwright.config.robot.model import Inertial, Joint, JointType, Link, RobotModel
from cellwright.mechanism.shapes import pose_arguments
from cellwright.util.pose import IDENTITY_QUATERNION, Pose, Vector3

JOINT_TYPES: Mapping[JointType, Any] = {
    JointType.REVOLUTE: mujoco.mjtJoint.mjJNT_HINGE,
    JointType.CONTINUOUS: mujoco.mjtJoint.mjJNT_HINGE,
    JointType.PRISMATIC: mujoco.mjtJoint.mjJNT_SLIDE,
    JointType.SPHERICAL: mujoco.mjtJoint.mjJNT_BALL,
}
"""Types of joints that move in the engine; links joined by one of another type are one rigid body with it."""

_MIN_RANGE = 1e-6  # [rad; m]

Fill: TypeAlias = Callable[[Any, Link], None]
"""Gives a body of the engine's specification the mass and the shapes of a link."""


def add_chain(
    parent: Any,
    robot: RobotModel,
    fill: Fill,
    *,
    pose: Pose | None = None,
    first: str = "",
    body_of: Callable[[str], str] = str,
) -> dict[str, Any]:
    """Add the links of a robot to a model specification: a body for each link.

    A body is added for a link that is fixed to another one too: it keeps its name, and sensors can be fixed to it.

    Args:
        parent: body of the specification that carries the robot.
        robot: the robot.
        fill: gives each body its mass and shapes, from the first link outward.
        pose: pose of the first link in the frame of its parent; the identity by default.
        first: link that `parent` carries; the root by default. Joints between it and the root are passed backward.
        body_of: name of the body of a link, by the link's name.

    Returns:
        Joints of the specification by name, with axes and limits.
    """
    joints_at: dict[str, list[Joint]] = {name: [] for name in robot.links}
    for joint in robot.joints:
        joints_at[joint.parent].append(joint)
        joints_at[joint.child].append(joint)
    first = first or robot.root
    body = parent.add_body(name=body_of(first), **pose_arguments(pose or Pose()))
    fill(body, robot.links[first])
    ahead: list[tuple[Any, str, Joint | None]] = [(body, first, None)]
    made: dict[str, Any] = {}
    while ahead:
        body, link, arrived_by = ahead.pop()
        for joint in joints_at[link]:
            if joint is arrived_by:
                continue
            is_reversed = joint.child == link
            other = joint.parent if is_reversed else joint.child
            origin = joint.origin.inverse() if is_reversed else joint.origin
            grown = body.add_body(name=body_of(other), **pose_arguments(origin))
            fill(grown, robot.links[other])
            if joint.type in JOINT_TYPES:
                made[joint.name] = _add_joint(grown, joint, is_reversed=is_reversed)
            ahead.append((grown, other, joint))
    return made


def give_mass(body: Any, mass: float, centre: Vector3, inertia: Sequence[float]) -> None:
    """Set mass [kg], centre of mass [m] and inertia [kg m^2] about it of a body, along the axes of the body.

    The inertia is given as in `Inertial`, or as (ixx, iyy, izz) of axes that are principal ones.
    """
    body.explicitinertial = True
    body.mass = mass
    body.ipos = centre
    if len(inertia) == 3:
        body.inertia = inertia
    else:
        body.fullinertia = inertia


def inertia_along_link(inertial: Inertial) -> tuple[float, ...]:
    """Return the inertia [kg m^2] about the centre of mass along the axes of the link, in the order of `Inertial`."""
    xx, yy, zz, xy, xz, yz = inertial.inertia
    if inertial.pose.quaternion == IDENTITY_QUATERNION:
        return inertial.inertia
    # An inertia tensor turns as R I R^T; the engine takes its six numbers along the link's axes.
    rotation = np.array([inertial.pose.rotate(axis) for axis in ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))]).T
    turned = rotation @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ rotation.T
    return tuple(turned[row, column] for row, column in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))


def range_of(joint: Joint) -> tuple[bool, tuple[float, float]]:
    """Return whether a joint has limits on both sides, and these [rad; m]; the engine needs some range between them."""
    lower, upper = joint.limits.lower, joint.limits.upper
    if not (math.isfinite(lower) and math.isfinite(upper)):
        return False, (0.0, 0.0)
    room = max(0.0, _MIN_RANGE - (upper - lower)) / 2
    return True, (lower - room, upper + room)


def _add_joint(body: Any, joint: Joint, *, is_reversed: bool) -> Any:
    """Add a joint; seen from its child, its axis is reversed and passes through the child's frame."""
    axis, at = joint.axis, (0.0, 0.0, 0.0)
    if is_reversed:
        x, y, z = joint.origin.rotate(axis)
        axis, at = (-x, -y, -z), joint.origin.position
    made = body.add_joint(name=joint.name, type=JOINT_TYPES[joint.type], pos=at)
    if joint.is_driven:
        made.axis = axis
        made.limited, made.range = range_of(joint)
    return made
