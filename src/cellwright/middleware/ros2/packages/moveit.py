"""MoveIt configuration of an arm, as a package of ROS 2: what MoveIt reads beside the robot's description.

The files in `data/cellwright_moveit_config` are the same for all arms. Those made here come from the arm's URDF.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any
from xml.etree.ElementTree import Element, SubElement, fromstring, indent, tostring

import yaml

from cellwright.engine.link_collisions import unchecked_pairs
from cellwright.middleware.ros2.packages.contents import MOVEIT, package_files

ARM, ARM_ON_RAIL, TOOL = "arm", "arm_on_rail", "tool"
"""Groups of joints: without the rail, with it, and what the arm holds its tool with."""

HOME = "home"
"""Named state in which a run begins."""

_SOLVER = {
    "kinematics_solver": "kdl_kinematics_plugin/KDLKinematicsPlugin",
    "kinematics_solver_search_resolution": 0.005,
    "kinematics_solver_timeout": 0.05,
}
_SETUP_ASSISTANT = {
    "moveit_setup_assistant_config": {
        "urdf": {"package": MOVEIT, "relative_path": "config/cellwright.urdf"},
        "srdf": {"relative_path": "config/cellwright.srdf"},
    }
}


@dataclass(frozen=True)
class PlannedArm:
    """Arm that MoveIt plans for.

    Example:
        >>> from cellwright.cell.planning import planned_arm
        >>> {group: len(joints) for group, joints in planned_arm().groups.items()}
        {'arm_on_rail': 7, 'arm': 6}

    Attributes:
        urdf: its description, as the cell publishes it.
        joints: joints of the controller, in its order, which is that of the chain.
        flange: link whose pose is planned.
        tool: link of the tool, which the arm's last link carries.
        home: position of each joint when a run begins [rad; m].
        max_velocity: maximum velocity of each joint [rad/s; m/s].
        max_acceleration: maximum acceleration of each joint [rad/s^2; m/s^2].
        action: name of the action that follows trajectories: `/CONTROLLER/NAME`.
    """

    urdf: str
    joints: tuple[str, ...]
    flange: str
    tool: str
    home: Mapping[str, float]
    max_velocity: Mapping[str, float]
    max_acceleration: Mapping[str, float]
    action: str

    @cached_property
    def groups(self) -> dict[str, tuple[str, ...]]:
        """Joints of each group of the arm. The rail are the prismatic joints that the chain begins with."""
        kinds = [self._joints[name].get("type") for name in self.joints]
        first = next(number for number, kind in enumerate(kinds) if kind != "prismatic")
        return ({ARM_ON_RAIL: self.joints} if first else {}) | {ARM: self.joints[first:]}

    def parent_of(self, joint: str) -> str:
        """Return the link in front of a joint."""
        return _link(self._joints[joint], "parent")

    @cached_property
    def tool_joint(self) -> str:
        """The joint between the arm's last link and the tool."""
        return next(name for name, each in self._joints.items() if _link(each, "child") == self.tool)

    @property
    def passive_joints(self) -> list[str]:
        """Joints that move in the description, but that the controller does not move."""
        return [name for name, each in self._joints.items() if each.get("type") != "fixed" and name not in self.joints]

    @cached_property
    def root(self) -> str:
        """The link that no joint moves: MoveIt plans in its frame."""
        children = {_link(joint, "child") for joint in self._joints.values()}
        return next(each.attrib["name"] for each in self._description.iter("link") if each.get("name") not in children)

    @cached_property
    def name(self) -> str:
        """Name of the robot in its description."""
        return self._description.attrib["name"]

    @cached_property
    def _description(self) -> Element:
        return fromstring(self.urdf)  # noqa: S314  # our own text

    @cached_property
    def _joints(self) -> dict[str, Element]:
        return {joint.attrib["name"]: joint for joint in self._description.findall("joint")}


def moveit_files(arm: PlannedArm) -> dict[str, bytes]:
    """Return every file of the package by its path in it."""
    texts = {
        ".setup_assistant": _yaml(_SETUP_ASSISTANT),
        "config/cellwright.urdf": arm.urdf,
        "config/cellwright.srdf": srdf(arm),
        "config/joint_limits.yaml": _yaml(joint_limits(arm)),
        "config/kinematics.yaml": _yaml({group: dict(_SOLVER) for group in arm.groups}),
        "config/moveit_controllers.yaml": _yaml(controllers(arm)),
    }
    return package_files(MOVEIT) | {path: text.encode() for path, text in texts.items()}


def srdf(arm: PlannedArm) -> str:
    """Return the semantic description: groups, end effector, named states, and pairs of links that need no check."""
    robot = Element("robot", name=arm.name)
    SubElement(robot, "virtual_joint", name="cell", type="fixed", parent_frame=arm.root, child_link=arm.root)
    for group, joints in arm.groups.items():
        chain = {"base_link": arm.parent_of(joints[0]), "tip_link": arm.flange}
        SubElement(SubElement(robot, "group", name=group), "chain", chain)
    tool = SubElement(robot, "group", name=TOOL)
    SubElement(tool, "link", name=arm.tool)
    for group, joints in arm.groups.items():
        state = SubElement(robot, "group_state", name=HOME, group=group)
        for joint in joints:
            SubElement(state, "joint", name=joint, value=repr(float(arm.home[joint])))
    carrier = arm.parent_of(arm.tool_joint)
    parent_group = next(iter(arm.groups))
    SubElement(robot, "end_effector", name=TOOL, parent_link=carrier, group=TOOL, parent_group=parent_group)
    for joint in arm.passive_joints:
        SubElement(robot, "passive_joint", name=joint)
    for (one, other), reason in unchecked_pairs(arm.urdf).items():
        SubElement(robot, "disable_collisions", link1=one, link2=other, reason=reason)
    indent(robot)
    return '<?xml version="1.0"?>\n' + tostring(robot, encoding="unicode") + "\n"


def joint_limits(arm: PlannedArm) -> dict[str, Any]:
    """Return limits of velocity and acceleration; those of position are in the URDF."""
    limits = {
        joint: {
            "has_velocity_limits": True,
            "max_velocity": float(arm.max_velocity[joint]),
            "has_acceleration_limits": True,
            "max_acceleration": float(arm.max_acceleration[joint]),
        }
        for joint in arm.joints
    }
    return {"default_velocity_scaling_factor": 1.0, "default_acceleration_scaling_factor": 1.0, "joint_limits": limits}


def controllers(arm: PlannedArm) -> dict[str, Any]:
    """Return the controllers that MoveIt executes with: those that the controller manager lists.

    The entry of the simple manager is for programs that use it instead, and for MoveIt's launch files.
    """
    controller, _, action = arm.action.strip("/").partition("/")
    described = {"type": "FollowJointTrajectory", "action_ns": action, "default": True, "joints": list(arm.joints)}
    return {
        "moveit_controller_manager": "moveit_ros_control_interface/Ros2ControlManager",
        "moveit_simple_controller_manager": {"controller_names": [controller], controller: described},
    }


def _link(joint: Element, end: str) -> str:
    found = joint.find(end)
    assert found is not None
    return found.attrib["link"]


def _yaml(values: Mapping[str, Any]) -> str:
    return yaml.safe_dump(dict(values), sort_keys=False, default_flow_style=None, width=120)
