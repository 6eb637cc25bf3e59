"""URDF of the QingLong: kinematics, limits and masses as figures, and the file made from them and the drawing."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from functools import cache
from importlib import resources
from itertools import chain

from cellwright.config.robot.model import Inertial, Joint, JointType, Limits, Link, RobotModel, link_poses
from cellwright.util.pose import Pose
from tools.qinglong.drawing import (
    COLOURS,
    Drawing,
    Shape,
    hand,
    hand_solids,
    right_arm,
    right_leg,
    right_solids,
    trunk,
    trunk_solids,
)

NAME = "QingLong"
TORSO = "base_link"
FINGERTIP = (1.5e-8, 1.5e-8, 1.5e-8, 0.0, 0.0, 0.0)
"""Inertia [kg m^2] of a fingertip, for which the figures have none: that of a ball of water of its mass, 1 g."""
_HEAD = """\
<?xml version="1.0"?>
<!-- The QingLong humanoid (OpenLoong), as the io_teleop node knows it: 95 joints, both hands. Written by
     `python -m tools.qinglong` from figures; change those, or the drawing, and not this file.
     Joints stand in the order of their indices. Lengths in m, angles in rad, masses in kg, efforts in N m. -->
"""


@cache
def figures() -> RobotModel:
    """Return the robot without shapes, its joints in the order of their indices."""
    read = json.loads(resources.files(__package__).joinpath("figures.json").read_text("utf-8"))
    joints = tuple(
        Joint(
            name=joint["name"],
            type=JointType(joint["type"]),
            parent=joint["parent"],
            child=joint["child"],
            origin=Pose.from_rpy(tuple(joint["xyz"]), tuple(joint["rpy"])),
            axis=tuple(joint.get("axis", (0.0, 0.0, 0.0))),
            limits=Limits(*joint["limit"]) if "limit" in joint else Limits(),
        )
        for joint in read["joints"]
    )
    links = {
        name: Link(name, None if values is None else _inertial(**values)) for name, values in read["links"].items()
    }
    return RobotModel(NAME, read["root"], links, joints)


def _inertial(mass: float, com: list[float], inertia: list[float]) -> Inertial:
    (x, y, z), (xx, yy, zz, xy, xz, yz) = com, inertia
    return Inertial(mass, Pose((x, y, z)), (xx, yy, zz, xy, xz, yz))


def urdf_text() -> str:
    """Return the whole file."""
    robot = figures()
    seen, touched = drawing(robot), solids(robot)
    lines = [f'<robot name="{robot.name}">']
    for name, colour in COLOURS.items():
        lines.append(f'  <material name="{name}"><color rgba="{_numbers(colour)}"/></material>')
    lines.extend(_link(robot, robot.root, seen, touched))
    rpy = _rpy_of_joints()
    for joint in robot.joints:
        lines.append(f'  <joint name="{joint.name}" type="{joint.type}">')
        lines.append(f'    <parent link="{joint.parent}"/><child link="{joint.child}"/>')
        lines.append(f'    <origin xyz="{_numbers(joint.origin.position)}" rpy="{_numbers(rpy[joint.name])}"/>')
        if joint.is_driven:
            limits = joint.limits
            lines.append(f'    <axis xyz="{_numbers(joint.axis)}"/>')
            lines.append(
                f'    <limit lower="{_number(limits.lower)}" upper="{_number(limits.upper)}"'
                f' effort="{_number(limits.effort)}" velocity="{_number(limits.velocity)}"/>'
            )
        lines.append("  </joint>")
        lines.extend(_link(robot, joint.child, seen, touched))
    return _HEAD + "\n".join([*lines, "</robot>"]) + "\n"


def drawing(robot: RobotModel) -> Drawing:
    """Return the visual shapes of the robot, by link, in the frame of the link."""
    body = _on_links(robot, _both_sides(trunk(), right_arm(), right_leg()))
    return body | hand(robot, "rh") | hand(robot, "lh")


def solids(robot: RobotModel) -> Drawing:
    """Return the collision shapes of the robot, by link, in the frame of the link."""
    body = _on_links(robot, _both_sides(trunk_solids(), right_solids()))
    return body | hand_solids(robot, "rh") | hand_solids(robot, "lh")


def _both_sides(*drawings: Drawing) -> Drawing:
    found: dict[str, list[Shape]] = {}
    for name, shapes in chain.from_iterable(drawn.items() for drawn in drawings):
        found[name] = shapes
        if "_r_" in name:
            found[name.replace("_r_", "_l_")] = [shape.mirrored() for shape in shapes]
    return found


def _on_links(robot: RobotModel, drawn: Drawing) -> dict[str, list[Shape]]:
    """Convert from the frame of the torso, with all joints at 0, to the frames of the links."""
    poses = link_poses(robot, {})
    torso = poses[TORSO].inverse()
    return {name: [shape.seen_from(torso @ poses[name]) for shape in shapes] for name, shapes in drawn.items()}


def _link(robot: RobotModel, name: str, seen: Drawing, touched: Drawing) -> Iterator[str]:
    inertial = robot.links[name].inertial
    if inertial is None and name not in seen:
        yield f'  <link name="{name}"/>'
        return
    yield f'  <link name="{name}">'
    if inertial is not None:
        names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        inertia = inertial.inertia if any(inertial.inertia) else FINGERTIP
        values = " ".join(f'{key}="{_number(value)}"' for key, value in zip(names, inertia, strict=True))
        yield (
            f'    <inertial><origin xyz="{_numbers(inertial.pose.position)}"/>'
            f'<mass value="{_number(inertial.mass)}"/><inertia {values}/></inertial>'
        )
    for shape in seen.get(name, ()):
        material = f'<material name="{shape.colour}"/>'
        yield f"    <visual>{_origin(shape)}{_geometry(shape)}{material}</visual>"
    for shape in touched.get(name, ()):
        yield f"    <collision>{_origin(shape)}{_geometry(shape)}</collision>"
    yield "  </link>"


def _origin(shape: Shape) -> str:
    rpy = [round(value, 4) for value in shape.pose.rpy]
    turned = f' rpy="{_numbers(rpy)}"' if any(rpy) else ""
    return f'<origin xyz="{_numbers(round(value, 5) for value in shape.pose.position)}"{turned}/>'


def _geometry(shape: Shape) -> str:
    size = [round(value, 5) for value in shape.size]
    if shape.kind == "box":
        return f'<geometry><box size="{_numbers(size)}"/></geometry>'
    if shape.kind == "sphere":
        return f'<geometry><sphere radius="{_number(size[0])}"/></geometry>'
    return f'<geometry><cylinder radius="{_number(size[0])}" length="{_number(size[1])}"/></geometry>'


def _rpy_of_joints() -> dict[str, list[float]]:
    """Return roll, pitch, yaw as in the figures: a quaternion would not reproduce their last digit."""
    read = json.loads(resources.files(__package__).joinpath("figures.json").read_text("utf-8"))
    return {joint["name"]: joint["rpy"] for joint in read["joints"]}


def _numbers(values: Iterable[float]) -> str:
    return " ".join(_number(value) for value in values)


def _number(value: float) -> str:
    return f"{value + 0.0:.12g}" if value else "0"
