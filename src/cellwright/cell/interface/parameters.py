"""ROS parameters of the kit-building cell, with its robot description in URDF.

`robot_state_publisher` makes /tf and /tf_static from it, and kinematics libraries read the chain from it. The figures
are those of the simulated arm. The description is always valid for an XML reader. A frame has one parent, and of two
frames with one name the later one counts, as in the frame tree itself.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import TypeAlias, Union
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from cellwright.cell.devices.logical_camera import TfFrame
from cellwright.cell.interface.frames import link_frames, static_frames
from cellwright.cell.interface.rows import GEAR
from cellwright.cell.model.arm import gains_of
from cellwright.cell.model.arm_looks import BEAM, CUP, SEEN
from cellwright.cell.model.arm_solids import SOLID
from cellwright.config.arm import JointTolerance
from cellwright.config.layout.arm_models import arm_model, chain_in_engine, joints_of
from cellwright.config.layout.arms import Arm
from cellwright.config.layout.robots import CellRobot
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.description import in_first_version
from cellwright.config.robot.model import Inertial, JointType, Limits
from cellwright.config.robot.urdf_writer import add_robot, rpy_of
from cellwright.config.trial.trial import Trial
from cellwright.config.ur10 import FIGURES, GRIPPER, GRIPPER_JOINT, RAIL, UR10, WRIST_3_T_GRIPPER
from cellwright.engine.shapes import Shape
from cellwright.util.pose import Pose, Vector3

_INERTIA = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
_TINY_LIMIT = 1e-6  # [rad]; URDF readers take equal limits for none, or refuse them
Parameter: TypeAlias = Union[bool, int, float, str, "list[Parameter]", "dict[str, Parameter]"]


def add_link(
    parent: Element,
    name: str,
    *,
    solid: Sequence[Shape] = (),
    seen: Sequence[Shape] = (),
    inertial: Inertial | None = None,
) -> Element:
    """Add a link with collision and visual shapes, and with mass and inertia.

    Args:
        parent: element to add the link to.
        name: name of the link.
        solid: shapes for collision, which are drawn too.
        seen: shapes that are only drawn.
        inertial: mass and inertia along the link's axes; None for a link without mass.

    Returns:
        The element of the link.
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
            add_form(visual, kind, sizes, pose)
            material = SubElement(visual, "material", name="rgb_" + "_".join(f"{each:.3g}" for each in shape.colour))
            SubElement(material, "color", rgba=_number_text(shape.colour))
    for shape in solid:
        for kind, sizes, pose in _urdf_forms(shape):
            add_form(SubElement(element, "collision"), kind, sizes, pose)
    return element


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


def add_form(element: Element, kind: str, sizes: dict[str, str], pose: Pose) -> None:
    """Add place and form to a visual or a collision shape: a kind of geometry in URDF, with its attributes."""
    _add_origin(element, pose)
    SubElement(SubElement(element, "geometry"), kind, sizes)


def _add_origin(element: Element, pose: Pose) -> None:
    SubElement(element, "origin", xyz=_number_text(pose.position), rpy=_number_text(rpy_of(pose)))


def _number_text(values: Sequence[float]) -> str:
    """Format numbers in a row, without the rounding noise of their last digit and without a minus before 0."""
    return " ".join(repr(round(float(value), 15) + 0.0) for value in values)


def robot_description(trial: Trial, only: Arm | None = None) -> str:
    """Return a cell's parameter `robot_description`: XML text in the URDF format.

    Args:
        trial: the trial.
        only: the arm whose description it is, with the names that its joints have in messages; without the world, if
            another arm carries it. By default that of all arms, whose joints have the prefix of their frames.
    """
    robot = Element("robot", name="ariac")
    arms = trial.arms if only is None else (only,)
    is_carried = only is not None and only.mount.on is not None
    known = set() if is_carried else {"world"}
    known |= {each.frame_of(name) for each in arms for name in chain_in_engine(each, trial.arm_models).links}
    if not is_carried:
        add_link(robot, "world")
    fixed = {frame.child: frame for frame in static_frames(trial)}
    for frame in fixed.values():
        # cameras may be on another arm
        if frame.parent in known:
            known.add(frame.child)
            _add_frame(robot, frame)
    for arm in arms:
        prefix = arm.frame_prefix if only is None else arm.joint_prefix
        if arm.is_original:
            _add_arm(robot, arm, prefix)
        else:
            chain = arm_model(arm, trial.arm_models[arm.name], arm.frame_prefix)
            names = (prefix + each.name.removeprefix(arm.frame_prefix) for each in chain.joints)
            joints = tuple(replace(each, name=name) for each, name in zip(chain.joints, names, strict=True))
            add_robot(robot, replace(chain, joints=joints))
            if not is_carried:
                _add_base(robot, chain.root, arm, trial)
    return _text(robot)


def own_description(robot: CellRobot, config: RobotConfig) -> str:
    """Return the parameter `robot_description` of a robot of a cell: XML text in the URDF format.

    Its joints have the names of its file, as in its topics, and its links those of its frames. It begins with the frame
    `world`, unless a link other than the root is fixed there. Joints without a drive are fixed ones, as in the cell.
    """
    prefix, described = robot.frame_prefix, config.robot
    joints = (replace(joint, parent=prefix + joint.parent, child=prefix + joint.child) for joint in described.joints)
    chain = replace(
        described.prefixed(prefix),
        joints=tuple(each if each.is_driven else replace(each, type=JointType.FIXED) for each in joints),
        written=described.written,
    )
    element = Element("robot", name=robot.name)
    if config.fixed_link is None:
        add_link(element, "world")
        add_joint(element, "fixed", f"{chain.root}_base_joint", "world", chain.root, robot.pose)
    add_robot(element, chain)
    return _text(element)


def _text(robot: Element) -> str:
    """Return the text of a description that every reader knows."""
    in_first_version(robot)
    indent(robot)
    return '<?xml version="1.0"?>\n' + tostring(robot, encoding="unicode") + "\n"


def _add_base(robot: Element, root: str, arm: Arm, trial: Trial) -> None:
    """Add the joint between the root of an arm and what carries it: the world, or a link of another arm."""
    on = arm.mount.on
    below, pose = "world", arm.pose
    if on is not None and on.arm:
        carrier = next(each for each in trial.arms if each.name == on.arm)
        below, pose = carrier.frame_of(on.body), on.pose
    # a robot is in no description of the arms; where it has its arm, /tf says
    kind = "floating" if on is not None and on.robot else "fixed"
    add_joint(robot, kind, f"{root}_base_joint", below, root, pose)


def _add_frame(robot: Element, frame: TfFrame) -> None:
    add_link(robot, frame.child)
    add_joint(robot, "fixed", f"{frame.child}_joint", frame.parent, frame.child, frame.pose)


def _add_arm(robot: Element, arm: Arm, joint_prefix: str) -> None:
    prefix = arm.frame_prefix
    add_link(robot, prefix + RAIL, solid=[BEAM])
    add_joint(robot, "fixed", f"{prefix}{RAIL}_base_joint", "world", prefix + RAIL, arm.pose)
    for joint in UR10.driven:
        name, figures = joint.child, FIGURES[joint.name]
        solid = [each if isinstance(each, Shape) else each.plain for each in SOLID[name]]
        add_link(robot, prefix + name, solid=solid, seen=SEEN[name], inertial=UR10.links[name].inertial)
        element = add_joint(
            robot, joint.type, joint_prefix + joint.name, prefix + joint.parent, prefix + name, joint.origin
        )
        _add_axis(element, joint.axis, joint.limits, figures.damping, figures.friction)
    # The cup is on a joint that does not turn: the joint states include it, and robot_state_publisher warns about names
    # of no joint or of a fixed one.
    add_link(robot, prefix + GRIPPER, solid=[CUP], inertial=UR10.links[GRIPPER].inertial)
    wrist, cup = prefix + "wrist_3_link", prefix + GRIPPER
    element = add_joint(robot, "revolute", joint_prefix + GRIPPER_JOINT, wrist, cup, WRIST_3_T_GRIPPER)
    _add_axis(element, (0.0, 0.0, 1.0), Limits(-_TINY_LIMIT, _TINY_LIMIT, 0.0, 0.0))
    for frame in link_frames(arm):
        _add_frame(robot, frame)


def parameters(trial: Trial, *, competition: bool) -> dict[str, Parameter]:
    """Return the parameters of a cell, from the root on: nested dictionaries, as on a parameter server.

    In competition mode they state that the simulator's own services are off the network.
    """
    description = robot_description(trial)
    cell: dict[str, Parameter] = {"robot_description": description}
    rates = {row.name: float(row.rate) for row in GEAR if isinstance(row.rate, Fraction)}
    for arm in trial.arms:
        extra: dict[str, Parameter] = {"name": GRIPPER_JOINT, "position": 0.0, "velocity": 0.0, "effort": 0.0}
        own: dict[str, Parameter] = {
            "arm": _arm_parameters(arm, trial, rates),
            "joint_state_controller": {
                "type": "joint_state_controller/JointStateController",
                "publish_rate": rates["/ariac/joint_states"],
                "extra_joints": [extra] if arm.tool.kind == "vacuum" else [],
            },
        }
        if arm.namespace:
            cell[arm.namespace] = {"robot_description": robot_description(trial, arm), **own}
        else:
            cell.update(own)
    robots = {each.namespace: own_description(each, trial.robot_models[each.name]) for each in trial.layout.robots}
    return {
        "use_sim_time": True,
        "robot_description": description,
        "ariac": cell,
        **{namespace: {"robot_description": text} for namespace, text in robots.items()},
        "gazebo": {"enable_ros_network": not competition},
    }


def _arm_parameters(arm: Arm, trial: Trial, rates: Mapping[str, float]) -> dict[str, Parameter]:
    """Return the parameters of an arm's controller, in the structure of the original's file."""
    settings = trial.settings.arm
    constraints: dict[str, Parameter] = {
        "goal_time": settings.goal_time,
        "stopped_velocity_tolerance": settings.stopped_velocity_tolerance,
    }
    names = {arm.joint_prefix + name: name for name in joints_of(arm, trial.arm_models)}
    for name, plain in names.items():
        tolerance = settings.tolerances.get(plain, JointTolerance())
        constraints[name] = {"trajectory": tolerance.trajectory, "goal": tolerance.goal}
    gains: dict[str, Parameter] = {
        arm.joint_prefix + name: {key: float(getattr(each, key)) for key in ("p", "d", "i", "i_clamp")}
        for name, each in (gains_of(settings) if arm.is_original else {}).items()
    }
    return {
        "type": "effort_controllers/JointTrajectoryController",
        "joints": [*names],
        "constraints": constraints,
        "gains": gains,
        "stop_trajectory_duration": settings.stop_trajectory_duration,
        "allow_partial_joints_goal": settings.allow_partial_joints_goal,
        "state_publish_rate": rates["/ariac/arm/state"],
        "action_monitor_rate": rates["/ariac/arm/follow_joint_trajectory/feedback"],
    }
