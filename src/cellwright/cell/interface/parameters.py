"""ROS parameters of the kit-building cell, with its robot description in URDF.

`robot_state_publisher` makes /tf and /tf_static from it, and kinematics libraries read the chain from it. The figures
are those of the simulated arm. The description is always valid for an XML reader. A frame has one parent, and of two
frames with one name the later one counts, as in the frame tree itself.
"""

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import TypeAlias, Union
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from cellwright.cell.devices.logical_camera import TfFrame
from cellwright.cell.interface.frames import LINK_FRAMES, static_frames
from cellwright.cell.interface.rows import rows
from cellwright.cell.model.arm import gains_of
from cellwright.cell.model.arm_looks import BEAM, CUP, SEEN
from cellwright.cell.model.arm_solids import SOLID
from cellwright.config.arm import JointTolerance
from cellwright.config.layout.arm_models import arm_model
from cellwright.config.robot.model import Inertial, Limits
from cellwright.config.robot.urdf_writer import add_robot
from cellwright.config.trial.trial import Trial
from cellwright.config.ur10 import FIGURES, GRIPPER, GRIPPER_JOINT, RAIL, UR10, WRIST_3_T_GRIPPER
from cellwright.engine.shapes import Shape
from cellwright.util.pose import Pose, Vector3

_GIMBAL_LOCK = 1e-7  # a frame nearer to pitch +-pi/2 than this [rad] counts as being at it
_INERTIA = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
_TINY_LIMIT = 1e-6  # [rad]; URDF readers take equal limits for none, or refuse them
Parameter: TypeAlias = Union[bool, int, float, str, "list[Parameter]", "dict[str, Parameter]"]


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


def add_link(
    parent: Element,
    name: str,
    *,
    solid: Sequence[Shape] = (),
    seen: Sequence[Shape] = (),
    inertial: Inertial | None = None,
) -> None:
    """Add a link with collision and visual shapes, and with mass and inertia.

    Args:
        parent: element to add the link to.
        name: name of the link.
        solid: shapes for collision, which are drawn too.
        seen: shapes that are only drawn.
        inertial: mass and inertia along the link's axes; None for a link without mass.
    """
    element = SubElement(parent, "link", name=name)
    if inertial is not None:
        heavy = SubElement(element, "inertial")
        _add_origin(heavy, inertial.pose)
        SubElement(heavy, "mass", value=repr(inertial.mass))
        SubElement(heavy, "inertia", dict(zip(_INERTIA, map(repr, inertial.inertia), strict=True)))
    for shape in (*solid, *seen):
        for kind, sizes, pose in _urdf_forms(shape):
            visual = SubElement(element, "visual")
            _add_form(visual, kind, sizes, pose)
            material = SubElement(visual, "material", name="rgb_" + "_".join(f"{each:.3g}" for each in shape.colour))
            SubElement(material, "color", rgba=_number_text(shape.colour))
    for shape in solid:
        for kind, sizes, pose in _urdf_forms(shape):
            _add_form(SubElement(element, "collision"), kind, sizes, pose)


def add_joint(parent: Element, kind: str, name: str, before: str, behind: str, pose: Pose) -> Element:
    """Add a joint between two links.

    Args:
        parent: element to add the joint to.
        kind: type of the joint in URDF.
        name: name of the joint.
        before: parent link.
        behind: child link.
        pose: pose of the child link in the frame of the parent link, at joint value 0.

    Returns:
        The element of the joint.
    """
    joint = SubElement(parent, "joint", name=name, type=kind)
    SubElement(joint, "parent", link=before)
    SubElement(joint, "child", link=behind)
    _add_origin(joint, pose)
    return joint


def _add_axis(joint: Element, axis: Vector3, limits: Limits, damping: float = 0.0, friction: float = 0.0) -> None:
    """Add axis, limits and dynamics to a joint."""
    SubElement(joint, "axis", xyz=_number_text(axis))
    names = ("lower", "upper", "effort", "velocity")
    SubElement(joint, "limit", {name: repr(float(getattr(limits, name))) for name in names})
    SubElement(joint, "dynamics", damping=repr(float(damping)), friction=repr(float(friction)))


def _urdf_forms(shape: Shape) -> list[tuple[str, dict[str, str], Pose]]:
    """Return a shape as URDF forms: URDF has no capsule, so that becomes a cylinder between two spheres."""
    if shape.kind == "box":
        return [("box", {"size": _number_text([2 * half for half in shape.size])}, shape.pose)]
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
    SubElement(element, "origin", xyz=_number_text(pose.position), rpy=_number_text(rpy_of(pose)))


def _number_text(values: Sequence[float]) -> str:
    """Format numbers in a row, without the rounding noise of their last digit and without a minus before 0."""
    return " ".join(repr(round(float(value), 15) + 0.0) for value in values)


def robot_description(trial: Trial) -> str:
    """Return a cell's parameter `robot_description`: XML text in the URDF format."""
    robot = Element("robot", name="ariac")
    add_link(robot, "world")
    fixed = {frame.child: frame for frame in static_frames(trial)}
    for frame in fixed.values():
        _add_frame(robot, frame)
    for arm in trial.arms:
        if arm.is_original:
            _add_arm(robot, arm.pose)
        else:
            chain = arm_model(arm, trial.arm_models[arm.name], "")
            add_robot(robot, chain)
            add_joint(robot, "fixed", f"{chain.root}_base_joint", "world", chain.root, arm.pose)
    indent(robot)
    return '<?xml version="1.0"?>\n' + tostring(robot, encoding="unicode") + "\n"


def _add_frame(robot: Element, frame: TfFrame) -> None:
    add_link(robot, frame.child)
    add_joint(robot, "fixed", f"{frame.child}_joint", frame.parent, frame.child, frame.pose)


def _add_arm(robot: Element, rail: Pose) -> None:
    add_link(robot, RAIL, solid=[BEAM])
    add_joint(robot, "fixed", f"{RAIL}_base_joint", "world", RAIL, rail)
    for joint in UR10.driven:
        name, figures = joint.child, FIGURES[joint.name]
        solid = [each if isinstance(each, Shape) else each.plain for each in SOLID[name]]
        add_link(robot, name, solid=solid, seen=SEEN[name], inertial=UR10.links[name].inertial)
        element = add_joint(robot, joint.type, joint.name, joint.parent, name, joint.origin)
        _add_axis(element, joint.axis, joint.limits, figures.damping, figures.friction)
    # The cup is on a joint that does not turn: the joint states include it, and robot_state_publisher warns about names
    # of no joint or of a fixed one.
    add_link(robot, GRIPPER, solid=[CUP], inertial=UR10.links[GRIPPER].inertial)
    element = add_joint(robot, "revolute", GRIPPER_JOINT, "wrist_3_link", GRIPPER, WRIST_3_T_GRIPPER)
    _add_axis(element, (0.0, 0.0, 1.0), Limits(-_TINY_LIMIT, _TINY_LIMIT, 0.0, 0.0))
    for frame in LINK_FRAMES:
        _add_frame(robot, frame)


def parameters(trial: Trial, *, competition: bool) -> dict[str, Parameter]:
    """Return the parameters of a cell, from the root on: nested dictionaries, as on a parameter server.

    In competition mode they state that the simulator's own services are off the network.
    """
    description = robot_description(trial)
    cell: dict[str, Parameter] = {"robot_description": description}
    if trial.has_arm:
        table = rows(trial, competition=competition)
        rates = {row.name: float(row.rate) for row in table if isinstance(row.rate, Fraction)}
        cell["arm"] = _arm_parameters(trial, rates)
        cell["joint_state_controller"] = {
            "type": "joint_state_controller/JointStateController",
            "publish_rate": rates["/ariac/joint_states"],
            "extra_joints": [{"name": GRIPPER_JOINT, "position": 0.0, "velocity": 0.0, "effort": 0.0}],
        }
    return {
        "use_sim_time": True,
        "robot_description": description,
        "ariac": cell,
        "gazebo": {"enable_ros_network": not competition},
    }


def _arm_parameters(trial: Trial, rates: Mapping[str, float]) -> dict[str, Parameter]:
    """Return the parameters of the arm's controller, in the structure of the original's file."""
    settings = trial.settings.arm
    constraints: dict[str, Parameter] = {
        "goal_time": settings.goal_time,
        "stopped_velocity_tolerance": settings.stopped_velocity_tolerance,
    }
    for name in trial.joints:
        tolerance = settings.tolerances.get(name, JointTolerance())
        constraints[name] = {"trajectory": tolerance.trajectory, "goal": tolerance.goal}
    gains: dict[str, Parameter] = {
        name: {"p": float(each.p), "d": float(each.d), "i": float(each.i), "i_clamp": float(each.i_clamp)}
        for name, each in (gains_of(settings) if trial.arms[0].is_original else {}).items()
    }
    return {
        "type": "effort_controllers/JointTrajectoryController",
        "joints": [*trial.joints],
        "constraints": constraints,
        "gains": gains,
        "stop_trajectory_duration": settings.stop_trajectory_duration,
        "allow_partial_joints_goal": settings.allow_partial_joints_goal,
        "state_publish_rate": rates["/ariac/arm/state"],
        "action_monitor_rate": rates["/ariac/arm/follow_joint_trajectory/feedback"],
    }
