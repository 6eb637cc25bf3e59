"""Text of a URDF for a robot that was read from another format, or made in memory."""

import math
from collections.abc import Iterable
from xml.etree.ElementTree import Element, SubElement, tostring

from cellwright.config.models.model import ModelShape
from cellwright.config.robot.model import Joint, JointType, Link, RobotModel
from cellwright.util.pose import Pose, Vector3

_NO_LIMIT = 1e9  # [N m; N; rad/s; m/s]; readers take it for none
_INERTIA = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
_GIMBAL_LOCK = 1e-7  # a frame nearer to pitch +-pi/2 than this [rad] counts as being at it
_LIMITED = (JointType.REVOLUTE, JointType.PRISMATIC)


def write_urdf(robot: RobotModel) -> str:
    """Return a robot as the text of a URDF 1.2, whose quaternions keep every digit; meshes have absolute paths.

    A shape that is seen and touched becomes a visual and a collision shape.

    Example:
        >>> print(write_urdf(RobotModel("post", "base", {"base": Link("base")}, ())))
        <robot name="post" version="1.2"><link name="base" /></robot>
    """
    root = Element("robot", name=robot.name, version="1.2")
    add_robot(root, robot)
    return tostring(root, encoding="unicode")


def add_robot(root: Element, robot: RobotModel) -> None:
    """Add the links and joints of a robot to the root element of a URDF."""
    for link in robot.links.values():
        _add_link(root, link)
    joints = {joint.name: joint for joint in robot.joints}
    for name in robot.written or joints:
        _add_joint(root, joints[name])


def rpy_of(pose: Pose) -> Vector3:
    """Return roll, pitch, yaw [rad] from which a URDF reader reconstructs the rotation of `pose`.

    Where the pitch is +-pi/2, a rotation determines only the sum or the difference of roll and yaw: roll is 0 there.
    """
    forward, left = pose.rotate((1.0, 0.0, 0.0)), pose.rotate((0.0, 1.0, 0.0))
    level = math.hypot(forward[0], forward[1])
    pitch = math.atan2(-forward[2], level)
    if level < _GIMBAL_LOCK:
        return (0.0, pitch, math.atan2(-left[0], left[1]))
    roll = math.atan2(left[2], pose.rotate((0.0, 0.0, 1.0))[2])
    return (roll, pitch, math.atan2(forward[1], forward[0]))


def _add_link(root: Element, link: Link) -> None:
    element = SubElement(root, "link", name=link.name)
    if link.inertial is not None:
        inertial = SubElement(element, "inertial")
        _add_origin(inertial, link.inertial.pose)
        SubElement(inertial, "mass", value=repr(link.inertial.mass))
        moments = zip(_INERTIA, map(repr, link.inertial.inertia), strict=True)
        SubElement(inertial, "inertia", dict(moments))
    for shape in link.shapes:
        for tag, is_used in (("visual", shape.is_seen), ("collision", shape.is_touched)):
            if is_used:
                _add_shape(element, tag, shape)


def _add_shape(link: Element, tag: str, shape: ModelShape) -> None:
    element = SubElement(link, tag)
    _add_origin(element, shape.pose)
    first, second, _ = map(repr, shape.size)
    attributes = {"radius": first, "length": second}
    if shape.mesh is not None:
        attributes = {"filename": shape.mesh.resolve().as_uri(), "scale": _text(shape.size)}
    elif shape.kind == "box":
        attributes = {"size": _text(shape.size)}
    elif shape.kind == "sphere":
        attributes = {"radius": first}
    SubElement(SubElement(element, "geometry"), shape.kind, attributes)
    if tag == "visual" and shape.colour is not None:
        rgba = _text(shape.colour)
        SubElement(SubElement(element, "material", name=f"rgba {rgba}"), "color", rgba=rgba)


def _add_joint(root: Element, joint: Joint) -> None:
    element = SubElement(root, "joint", name=joint.name, type=joint.type.value)
    _add_origin(element, joint.origin)
    SubElement(element, "parent", link=joint.parent)
    SubElement(element, "child", link=joint.child)
    if joint.is_driven or joint.type is JointType.PLANAR:
        SubElement(element, "axis", xyz=_text(joint.axis))
    if joint.is_driven:
        limits = joint.limits
        forces = {"effort": limits.effort, "velocity": limits.velocity}
        written = {name: repr(min(value, _NO_LIMIT)) for name, value in forces.items()}
        if joint.type in _LIMITED:
            ends = {"lower": limits.lower, "upper": limits.upper}
            written |= {name: repr(math.copysign(min(abs(end), _NO_LIMIT), end)) for name, end in ends.items()}
        SubElement(element, "limit", written)
    if (mimic := joint.mimic) is not None:
        SubElement(element, "mimic", joint=mimic.joint, multiplier=repr(mimic.multiplier), offset=repr(mimic.offset))


def _add_origin(owner: Element, pose: Pose) -> None:
    w, x, y, z = pose.quaternion
    SubElement(owner, "origin", xyz=_text(pose.position), quat_xyzw=_text((x, y, z, w)))


def _text(numbers: Iterable[float]) -> str:
    return " ".join(map(repr, numbers))
