"""The robot description of the kit-building cell: rail, arm, cup, and every fixed frame of the cell.

`robot_state_publisher` makes /tf and /tf_static of it, and libraries that solve kinematics read the chain from it. The
figures are those of the simulated arm. What an XML reader would refuse cannot come in: a frame has one parent, and of
two with one name the later one holds, as in the tree of frames itself.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, indent, tostring

from cellwright.cell.devices.sensors.logical_camera import Frame
from cellwright.cell.interface import arm_urdf as urdf
from cellwright.cell.interface.frames import LINK_FRAMES, static_frames
from cellwright.cell.interface.publications import GRIPPER_JOINT
from cellwright.cell.model import arm_looks
from cellwright.cell.model.arm import BODIES, GRIPPER, JOINTS, WRIST_3_T_GRIPPER
from cellwright.cell.model.frames import RAIL
from cellwright.config.trial.trial import Trial

ROBOT = "ariac"
"""The name in the description."""

_RAIL_LINK = "linear_arm_actuator"
_UPWARD = (0.0, 0.0, 1.0)
_HARDLY = 1e-6  # [rad]; readers of URDF take equal limits for none, or refuse them


def robot_description(trial: Trial) -> str:
    """The description of one cell, as its parameter `robot_description` has it: XML text in the URDF format."""
    robot = urdf.robot(ROBOT)
    urdf.link(robot, "world")
    fixed = {frame.child: frame for frame in static_frames(trial)}
    for frame in fixed.values():
        _add_frame(robot, frame)
    if trial.has_arm:
        _add_arm(robot)
    indent(robot)
    return '<?xml version="1.0"?>\n' + tostring(robot, encoding="unicode") + "\n"


def _add_frame(robot: Element, frame: Frame) -> None:
    urdf.link(robot, frame.child)
    urdf.fixed_joint(robot, f"{frame.child}_joint", frame.parent, frame.child, frame.pose)


def _add_arm(robot: Element) -> None:
    urdf.link(robot, _RAIL_LINK, solid=[arm_looks.BEAM])
    urdf.fixed_joint(robot, f"{_RAIL_LINK}_base_joint", "world", _RAIL_LINK, RAIL)
    before = _RAIL_LINK
    for joint in JOINTS:
        name = joint.link
        solid = [each.cylinder if isinstance(each, arm_looks.Housing) else each for each in arm_looks.SOLID[name]]
        urdf.link(robot, name, solid=solid, seen=arm_looks.SEEN[name], form=BODIES[name])
        urdf.moving_joint(
            robot,
            "prismatic" if before == _RAIL_LINK else "revolute",
            joint.name,
            (before, name),
            joint.pose,
            joint.axis,
            range_=(-joint.limit, joint.limit),
            effort=joint.effort,
            velocity=joint.velocity,
            damping=joint.damping,
            friction=joint.friction,
        )
        before = name
    _add_cup(robot, before)
    for frame in LINK_FRAMES:
        _add_frame(robot, frame)


def _add_cup(robot: Element, before: str) -> None:
    """The cup, on a joint that does not turn.

    The joint states name it, and robot_state_publisher complains of a name that belongs to no joint or to a fixed one.
    """
    urdf.link(robot, GRIPPER, solid=[arm_looks.CUP], form=BODIES[GRIPPER])
    urdf.moving_joint(
        robot,
        "revolute",
        GRIPPER_JOINT,
        (before, GRIPPER),
        WRIST_3_T_GRIPPER,
        _UPWARD,
        range_=(-_HARDLY, _HARDLY),
        effort=0.0,
        velocity=0.0,
    )
