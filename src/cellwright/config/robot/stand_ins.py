"""Simple shapes for links whose meshes are missing, so that a robot can be seen, and touched, as it is built."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from dataclasses import replace
from enum import Enum

from cellwright.config.models.model import ModelShape
from cellwright.config.robot.model import Joint, Link
from cellwright.util.pose import Pose, Quaternion, Vector3, normalized

NEAR = 0.02
"""Joints nearer to the origin of a link than this [m] say nothing of its form."""
THICKNESS = (0.08, 0.3)
"""Least and largest radius of a limb, as a share of its length."""
DENSITY = 1200.0
"""Of a robot's links, roughly [kg/m^3]: it tells the thickness of a limb from the mass of its link."""

_USUAL = 0.16  # radius of a limb of unknown mass, as a share of its length
_LEAST, _MOST = 0.005, 0.12  # radius [m]


class Use(Enum):
    """What a shape is for."""

    SEEN = "seen"
    TOUCHED = "touched"


def with_stand_ins(link: Link, joints: Iterable[Joint], lacking: Collection[Use]) -> Link:
    """A link with all that it needs to be seen and touched.

    What serves the one purpose serves the other where nothing else does; a link without any shape gets limbs: capsules
    from its origin to each joint that it carries, or a ball around its centre of mass when it carries none.

    Args:
        link: as the file has it, less the shapes that could not be read.
        joints: those of the robot.
        lacking: what it lost shapes for.
    """
    seen = any(shape.is_seen for shape in link.shapes)
    touched = any(shape.is_touched for shape in link.shapes)
    is_seen, is_touched = Use.SEEN in lacking and not seen, Use.TOUCHED in lacking and not touched
    if not (is_seen or is_touched):
        return link
    if link.shapes:
        both = tuple(
            replace(shape, is_seen=shape.is_seen or is_seen, is_touched=shape.is_touched or is_touched)
            for shape in link.shapes
        )
        return replace(link, shapes=both)
    limbs = _limbs(link, list(joints))
    return replace(link, shapes=tuple(replace(limb, is_seen=is_seen, is_touched=is_touched) for limb in limbs))


def _limbs(link: Link, joints: list[Joint]) -> list[ModelShape]:
    mass = link.inertial.mass if link.inertial is not None else 0.0
    ends = [joint.origin.position for joint in joints if joint.parent == link.name]
    ends = [end for end in dict.fromkeys(ends) if math.hypot(*end) > NEAR]
    if ends:
        return [_limb(end, mass / len(ends)) for end in ends]
    middle = link.inertial.pose.position if link.inertial is not None else (0.0, 0.0, 0.0)
    if math.hypot(*middle) > NEAR / 2:  # nothing is carried: as far beyond the centre of mass as before it
        x, y, z = middle
        return [_limb((2 * x, 2 * y, 2 * z), mass)]
    above = next((math.hypot(*joint.origin.position) for joint in joints if joint.child == link.name), 0.0)
    radius = (3 * mass / (4 * math.pi * DENSITY)) ** (1 / 3) or _USUAL * above
    return [ModelShape("sphere", (_within(radius, _LEAST, _MOST), 0.0, 0.0), Pose(middle))]


def _limb(end: Vector3, mass: float) -> ModelShape:
    """A capsule from the origin to a point [m], as thick as its mass [kg] asks for."""
    length = math.hypot(*end)
    radius = math.sqrt(mass / (DENSITY * math.pi * length)) or _USUAL * length
    thin, thick = THICKNESS
    radius = _within(_within(radius, thin * length, thick * length), _LEAST, _MOST)
    x, y, z = end
    pose = Pose((x / 2, y / 2, z / 2), _turn_z_to((x / length, y / length, z / length)))
    return ModelShape("capsule", (radius, max(length - radius, length / 2), 0.0), pose)


def _turn_z_to(direction: Vector3) -> Quaternion:
    """The shortest turn that takes the z axis to a unit vector."""
    x, y, z = direction
    return normalized((1 + z, -y, x, 0.0)) if z > -1 + 1e-9 else (0.0, 1.0, 0.0, 0.0)


def _within(value: float, least: float, most: float) -> float:
    return max(least, min(value, most))
