"""MoveIt configuration of a cell, as a package of ROS 2: its description, and what MoveIt reads beside it.

The files in `data/cellwright_moveit_config` are the same for all cells. Those made here come from the cell's URDF.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any
from xml.etree.ElementTree import Element, SubElement, fromstring, indent, tostring

import yaml

from cellwright.middleware.ros2.packages.contents import MOVEIT, package_files

TOOL = "tool"
"""Group of the links with which the only arm of a cell holds parts."""

HOME = "home"
"""Named state in which a run begins."""

OPEN, CLOSED = "open", "closed"
"""Named states of fingers."""

CONTROL_MANAGER = "moveit_ros_control_interface/Ros2ControlManager"
SIMPLE_MANAGER = "moveit_simple_controller_manager/MoveItSimpleControllerManager"

_SOLVER = {
    "kinematics_solver": "kdl_kinematics_plugin/KDLKinematicsPlugin",
    "kinematics_solver_search_resolution": 0.005,
    "kinematics_solver_timeout": 0.05,
}


@dataclass(frozen=True)
class PlannedFingers:
    """Fingers of a tool, which MoveIt opens and closes.

    Attributes:
        joints: joint of each finger; both have the same position, half of the distance between the pads.
        opening: position of each when open [m].
        max_velocity: maximum velocity of each [m/s].
        max_acceleration: maximum acceleration of each [m/s^2].
        action: name of the action `GripperCommand`: `/CONTROLLER/NAME`.
    """

    joints: tuple[str, str]
    opening: float
    max_velocity: float
    max_acceleration: float
    action: str


@dataclass(frozen=True)
class PlannedArm:
    """Arm that MoveIt plans for.

    Attributes:
        name: name of its groups.
        joints: joints of the controller, in its order, which is that of the chain.
        flange: link whose pose is planned.
        tool: links of the tool, of which the arm's last link carries the first; none without a tool.
        home: position of each joint when a run begins [rad; m].
        max_velocity: maximum velocity of each joint [rad/s; m/s].
        max_acceleration: maximum acceleration of each joint [rad/s^2; m/s^2].
        action: name of the action that follows trajectories: `/CONTROLLER/NAME`.
        fingers: fingers of its tool; None for another tool.
    """

    name: str
    joints: tuple[str, ...]
    flange: str
    tool: tuple[str, ...]
    home: Mapping[str, float]
    max_velocity: Mapping[str, float]
    max_acceleration: Mapping[str, float]
    action: str
    fingers: PlannedFingers | None = None


@dataclass(frozen=True)
class PlannedCell:
    """Cell that MoveIt plans in.

    Attributes:
        urdf: description of its arms and of what stands around them.
        arms: the arms.
        unchecked: pairs of links that need no check for collisions, with the reason.
    """

    urdf: str
    arms: tuple[PlannedArm, ...]
    unchecked: Mapping[tuple[str, str], str]

    @cached_property
    def groups(self) -> dict[str, tuple[str, ...]]:
        """Joints of each group that is a chain: an arm with its rail, if it has one, then without it.

        The rail are the prismatic joints that the chain begins with.
        """
        found = {}
        for arm in self.arms:
            kinds = [self._joints[name].get("type") for name in arm.joints]
            first = next(number for number, kind in enumerate(kinds) if kind != "prismatic")
            if first:
                found[self.whole_group(arm)] = arm.joints
            found[arm.name] = arm.joints[first:]
        return found

    def whole_group(self, arm: PlannedArm) -> str:
        """Return the group of all joints of an arm's controller."""
        return f"{arm.name}_on_rail" if self._joints[arm.joints[0]].get("type") == "prismatic" else arm.name

    def tool_group(self, arm: PlannedArm) -> str:
        """Return the group of an arm's tool."""
        return TOOL if len(self.arms) == 1 else f"{arm.name}_{TOOL}"

    @property
    def common_group(self) -> str | None:
        """The group of all arms; None for one arm."""
        if len(self.arms) < 2:
            return None
        name = "both" if len(self.arms) == 2 else "all"
        return f"{name}_arms" if any(arm.name == name for arm in self.arms) else name

    def parent_of(self, joint: str) -> str:
        """Return the link in front of a joint."""
        return _link(self._joints[joint], "parent")

    def carrier_of(self, link: str) -> str:
        """Return the link in front of the joint above a link."""
        return next(_link(each, "parent") for each in self._joints.values() if _link(each, "child") == link)

    @property
    def passive_joints(self) -> list[str]:
        """Joints that move in the description, but that no controller moves."""
        driven = {name for arm in self.arms for name in arm.joints}
        driven |= {name for fingers in self.fingers for name in fingers.joints}
        return [name for name, each in self._joints.items() if each.get("type") != "fixed" and name not in driven]

    @property
    def fingers(self) -> list[PlannedFingers]:
        """The fingers of all arms."""
        return [arm.fingers for arm in self.arms if arm.fingers is not None]

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


def moveit_files(cell: PlannedCell, package: str = MOVEIT) -> dict[str, bytes]:
    """Return every file of the package but for meshes, by its path in it.

    Args:
        cell: the cell.
        package: name of the package.
    """
    texts = {
        ".setup_assistant": _yaml(_setup_assistant(package)),
        "config/cellwright.urdf": cell.urdf,
        "config/cellwright.srdf": srdf(cell),
        "config/joint_limits.yaml": _yaml(joint_limits(cell)),
        "config/kinematics.yaml": _yaml({group: dict(_SOLVER) for group in cell.groups}),
        "config/moveit_controllers.yaml": _yaml(controllers(cell)),
    }
    same = {path: text.replace(MOVEIT.encode(), package.encode()) for path, text in package_files(MOVEIT).items()}
    return same | {path: text.encode() for path, text in texts.items()}


def srdf(cell: PlannedCell) -> str:
    """Return the semantic description: groups, end effectors, named states, and pairs of links that need no check."""
    robot = Element("robot", name=cell.name)
    SubElement(robot, "virtual_joint", name="cell", type="fixed", parent_frame=cell.root, child_link=cell.root)
    for arm in cell.arms:
        _add_arm(robot, cell, arm)
    if common := cell.common_group:
        whole = SubElement(robot, "group", name=common)
        for arm in cell.arms:
            SubElement(whole, "group", name=cell.whole_group(arm))
        _add_state(robot, common, HOME, {name: arm.home[name] for arm in cell.arms for name in arm.joints})
    for joint in cell.passive_joints:
        SubElement(robot, "passive_joint", name=joint)
    for (one, other), reason in cell.unchecked.items():
        SubElement(robot, "disable_collisions", link1=one, link2=other, reason=reason)
    indent(robot)
    return '<?xml version="1.0"?>\n' + tostring(robot, encoding="unicode") + "\n"


def _add_arm(robot: Element, cell: PlannedCell, arm: PlannedArm) -> None:
    """Add groups, states and end effector of an arm."""
    for group in dict.fromkeys((cell.whole_group(arm), arm.name)):
        joints = cell.groups[group]
        chain = {"base_link": cell.parent_of(joints[0]), "tip_link": arm.flange}
        SubElement(SubElement(robot, "group", name=group), "chain", chain)
        _add_state(robot, group, HOME, {joint: arm.home[joint] for joint in joints})
    if arm.tool:
        group = cell.tool_group(arm)
        tool = SubElement(robot, "group", name=group)
        for link in arm.tool:  # with the joint that moves it
            SubElement(tool, "link", name=link)
        if arm.fingers is not None:
            _add_state(robot, group, OPEN, dict.fromkeys(arm.fingers.joints, arm.fingers.opening))
            _add_state(robot, group, CLOSED, dict.fromkeys(arm.fingers.joints, 0.0))
        places = {"parent_link": cell.carrier_of(arm.tool[0]), "parent_group": cell.whole_group(arm)}
        SubElement(robot, "end_effector", {"name": group, "group": group, **places})


def _add_state(robot: Element, group: str, name: str, positions: Mapping[str, float]) -> None:
    state = SubElement(robot, "group_state", name=name, group=group)
    for joint, position in positions.items():
        SubElement(state, "joint", name=joint, value=repr(float(position)))


def joint_limits(cell: PlannedCell) -> dict[str, Any]:
    """Return limits of velocity and acceleration; those of position are in the URDF."""
    limits: dict[str, dict[str, Any]] = {}
    for arm in cell.arms:
        limits |= {name: _limits(arm.max_velocity[name], arm.max_acceleration[name]) for name in arm.joints}
        if (fingers := arm.fingers) is not None:
            limits |= {name: _limits(fingers.max_velocity, fingers.max_acceleration) for name in fingers.joints}
    return {"default_velocity_scaling_factor": 1.0, "default_acceleration_scaling_factor": 1.0, "joint_limits": limits}


def _limits(velocity: float, acceleration: float) -> dict[str, Any]:
    return {
        "has_velocity_limits": True,
        "max_velocity": float(velocity),
        "has_acceleration_limits": True,
        "max_acceleration": float(acceleration),
    }


def controllers(cell: PlannedCell) -> dict[str, Any]:
    """Return the controllers that MoveIt executes with: those that the controller manager lists.

    The entries of the simple manager are for programs that use it instead, and for MoveIt's launch files. For fingers
    it is the only one: the other knows no joints of theirs, and commands the position of one.
    """
    described: dict[str, dict[str, Any]] = {}
    for arm in cell.arms:
        controller, _, action = arm.action.strip("/").partition("/")
        joints = list(arm.joints)
        described[controller] = {
            "type": "FollowJointTrajectory",
            "action_ns": action,
            "default": True,
            "joints": joints,
        }
        if arm.fingers is not None:
            controller, _, action = arm.fingers.action.strip("/").partition("/")
            described[controller] = {
                "type": "GripperCommand",
                "action_ns": action,
                "default": True,
                "parallel": True,  # the distance between the pads is the sum of both
                "joints": list(arm.fingers.joints),
            }
    return {
        "moveit_controller_manager": SIMPLE_MANAGER if cell.fingers else CONTROL_MANAGER,
        "moveit_simple_controller_manager": {"controller_names": [*described], **described},
    }


def _setup_assistant(package: str) -> dict[str, Any]:
    return {
        "moveit_setup_assistant_config": {
            "urdf": {"package": package, "relative_path": "config/cellwright.urdf"},
            "srdf": {"relative_path": "config/cellwright.srdf"},
        }
    }


def _link(joint: Element, end: str) -> str:
    found = joint.find(end)
    assert found is not None
    return found.attrib["link"]


def _yaml(values: Mapping[str, Any]) -> str:
    return yaml.safe_dump(dict(values), sort_keys=False, default_flow_style=None, width=120)
