"""The pieces of a robot description in URDF: links, joints, shapes and masses as XML elements."""

from __future__ import annotations

import math
from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement

from cellwright.cell.model.arm import Cylinder
from cellwright.engine.geometry.shapes import Shape
from cellwright.util.pose import Pose, Vector3

_UPRIGHT = 1e-7  # a frame nearer to pitch +-pi/2 than this [rad] is taken to stand there


def rpy_of(pose: Pose) -> Vector3:
    """Roll, pitch, yaw [rad] from which a reader of URDF makes the rotation of `pose` again.

    Where the pitch is +-pi/2, only the sum or the difference of roll and yaw is told by a rotation: roll is 0 there.
    """
    forward, left = pose.rotate((1.0, 0.0, 0.0)), pose.rotate((0.0, 1.0, 0.0))
    level = math.hypot(forward[0], forward[1])
    pitch = math.atan2(-forward[2], level)
    if level < _UPRIGHT:
        return (0.0, pitch, math.atan2(-left[0], left[1]))
    roll = math.atan2(left[2], pose.rotate((0.0, 0.0, 1.0))[2])
    return (roll, pitch, math.atan2(forward[1], forward[0]))


def robot(name: str) -> Element:
    """A description without anything in it."""
    return Element("robot", name=name)


def link(
    parent: Element,
    name: str,
    *,
    solid: Sequence[Shape] = (),
    seen: Sequence[Shape] = (),
    form: Cylinder | None = None,
) -> None:
    """Add a link.

    Args:
        parent: the description.
        name: of the link.
        solid: what it touches with; it is seen as well.
        seen: what is only seen of it.
        form: the cylinder that has its mass and its inertia; None for a link that is a mere frame.
    """
    element = SubElement(parent, "link", name=name)
    if form is not None:
        _add_inertia(element, form)
    for shape in (*solid, *seen):
        for kind, sizes, pose in _forms(shape):
            visual = SubElement(element, "visual")
            _add_form(visual, kind, sizes, pose)
            material = SubElement(visual, "material", name="rgb_" + "_".join(f"{each:.3g}" for each in shape.colour))
            SubElement(material, "color", rgba=_text(shape.colour))
    for shape in solid:
        for kind, sizes, pose in _forms(shape):
            _add_form(SubElement(element, "collision"), kind, sizes, pose)


def fixed_joint(parent: Element, name: str, before: str, behind: str, pose: Pose) -> None:
    """Fix the link `behind` to the link `before`, at `pose` in its frame."""
    _add_joint(parent, "fixed", name, before, behind, pose)


def moving_joint(
    parent: Element,
    kind: str,
    name: str,
    links: tuple[str, str],
    pose: Pose,
    axis: Vector3,
    *,
    range_: tuple[float, float],
    effort: float,
    velocity: float,
    damping: float = 0.0,
    friction: float = 0.0,
) -> None:
    """Join two links by a joint that moves.

    Args:
        parent: the description.
        kind: `prismatic` or `revolute`.
        name: of the joint.
        links: the link before the joint and the one behind it.
        pose: of the link behind in the frame of the one before, at joint value 0.
        axis: in the frame of the link behind.
        range_: least and largest value [m] or [rad].
        effort: largest force [N] or torque [N m].
        velocity: largest velocity [m/s] or [rad/s].
        damping: viscous [N s/m] or [N m s/rad].
        friction: dry [N] or [N m].
    """
    joint = _add_joint(parent, kind, name, *links, pose)
    SubElement(joint, "axis", xyz=_text(axis))
    lower, upper = range_
    SubElement(
        joint, "limit", lower=repr(lower), upper=repr(upper), effort=repr(float(effort)), velocity=repr(float(velocity))
    )
    SubElement(joint, "dynamics", damping=repr(float(damping)), friction=repr(float(friction)))


def _add_joint(parent: Element, kind: str, name: str, before: str, behind: str, pose: Pose) -> Element:
    joint = SubElement(parent, "joint", name=name, type=kind)
    SubElement(joint, "parent", link=before)
    SubElement(joint, "child", link=behind)
    _add_origin(joint, pose)
    return joint


def _add_inertia(element: Element, form: Cylinder) -> None:
    inertial = SubElement(element, "inertial")
    _add_origin(inertial, Pose((0.0, 0.0, form.middle)))
    SubElement(inertial, "mass", value=repr(form.mass))
    across, along = repr(form.across), repr(form.along)
    SubElement(inertial, "inertia", ixx=across, iyy=across, izz=along, ixy="0.0", ixz="0.0", iyz="0.0")


def _forms(shape: Shape) -> list[tuple[str, dict[str, str], Pose]]:
    """A shape in the three forms that URDF knows; it has no capsule, so that is a cylinder between two balls."""
    if shape.kind == "box":
        return [("box", {"size": _text([2 * half for half in shape.size])}, shape.pose)]
    radius = {"radius": repr(shape.size[0])}
    if shape.kind == "sphere":
        return [("sphere", radius, shape.pose)]
    half = shape.size[1]
    forms = [("cylinder", {**radius, "length": repr(2 * half)}, shape.pose)]
    if shape.kind == "capsule":
        forms += [("sphere", radius, shape.pose @ Pose((0.0, 0.0, end))) for end in (-half, half)]
    return forms


def _add_form(element: Element, kind: str, sizes: dict[str, str], pose: Pose) -> None:
    _add_origin(element, pose)
    SubElement(SubElement(element, "geometry"), kind, sizes)


def _add_origin(element: Element, pose: Pose) -> None:
    SubElement(element, "origin", xyz=_text(pose.position), rpy=_text(rpy_of(pose)))


def _text(values: Sequence[float]) -> str:
    """Numbers in a row, without the rounding noise of their last digit and without a minus before 0."""
    return " ".join(repr(round(float(value), 15) + 0.0) for value in values)
