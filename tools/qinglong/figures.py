"""Kinematics, limits and masses of the QingLong, as figures."""

from __future__ import annotations

import json
from functools import cache
from importlib import resources

from cellwright.config.robot.model import Inertial, Joint, JointType, Limits, Link, RobotModel
from cellwright.util.pose import Pose

NAME = "QingLong"


@cache
def figures() -> RobotModel:
    """The robot without shapes, its joints in the order of their indices."""
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
