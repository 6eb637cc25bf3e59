"""Interface of the robot's node: the table of io_teleop topics and services, and its ROS parameters.

Names, types and rates are those of the io_teleop stack, from its public ROS 1 workspace and its clients. Additions are
marked as Cellwright's own: the targets that were really applied, enabling, emergency stop. Handlers are methods of the
objects that `RobotNode` hands to `bind`. Target topics subscribe with best effort: in ROS 2 a reliable subscription
receives nothing from best-effort publishers, which some adopters use. They keep many messages, since each may name
other joints.
"""

import re
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, NamedTuple

from cellwright.config.robot.config import RobotConfig
from cellwright.middleware.bus import BEST_EFFORT_COMMANDS, Direction
from cellwright.middleware.interface.table import ALWAYS, Endpoint, EndpointKind, Timing, Where, accepts, publishes
from cellwright.middleware.ros1.identity import Identity, node_name

NAMESPACE = "io_teleop"
"""Namespace of the topics, and begin of the services beside it."""
NODE = "/sim_robot_controller_node"
"""Default name of the node in ROS: that of the vendor's general node."""

TOPIC, SERVICE = EndpointKind.TOPIC, EndpointKind.SERVICE
ARMS = Where.when("with arms in the robot configuration", lambda robot: robot.config.arms)
GRIPPERS = Where.when("with grippers in the robot configuration", lambda robot: robot.config.grippers)
FREE_BASE = Where.when("without a fixed link", lambda robot: robot.is_alone and robot.config.fixed_link is None)
ALONE = Where.when("at a node of its own", lambda robot: robot.is_alone)
SIMULATED_TIME = Where.when("with simulated time", lambda robot: robot.sim_time)
EACH_CAMERA = Where("for each camera of the robot configuration", lambda robot: robot.cameras)
JOINTS, POSES = "sensor_msgs/JointState", "geometry_msgs/PoseArray"
TARGET_EE_POSES = "/io_teleop/target_ee_poses"

NODE_OF_TIME = "the node of the io_teleop workspace"
CONTROLLER = "the universal controller's side"
ADOPTERS = "nodes of adopters"
OWN = "Cellwright"

# fmt: off
IO_TELEOP = (
    publishes("/clock", "rosgraph_msgs/Clock", Timing.EACH_STEP, SIMULATED_TIME,
         "Simulation time.", handler="clock", source=OWN),
    publishes("/io_teleop/joint_states", JOINTS, 100, ALWAYS,
         "State of all joints that are not fixed, by URDF name, in the order of their indices.",
         handler="joint_states", source=NODE_OF_TIME),
    publishes("/io_teleop/applied_joint_cmd", JOINTS, 100, ALWAYS,
         "Targets that the joints follow, after limits and safety.", handler="applied_targets", source=OWN),
    publishes("/io_teleop/gripper_states", JOINTS, 100, GRIPPERS,
         "Status of each gripper, 0 (open) to 1 (closed): right, left.", handler="gripper_states", source=ADOPTERS),
    publishes("/io_teleop/state_ee_poses", POSES, 100, ARMS,
         "Poses of the arm tips: right, left; in the frame of `controller_indices.base`.",
         handler="ee_poses", source=CONTROLLER),
    publishes("/io_teleop/camera_{sensor}/color", "sensor_msgs/Image", 30, EACH_CAMERA,
         "Colour image of a configured camera, `rgb8`.", handler="colour_picture", source=OWN),
    publishes("/io_teleop/camera_{sensor}/depth", "sensor_msgs/Image", 30, EACH_CAMERA,
         "Its depth image, along the line of sight in m, `32FC1`.", handler="depth_picture", source=OWN),
    publishes("/io_teleop/camera_{sensor}/camera_info", "sensor_msgs/CameraInfo", 30, EACH_CAMERA,
         "Camera matrix of these images.", handler="camera_info", source=OWN),
    publishes("/io_teleop/status", "cellwright_msgs/TeleopStatus", Timing.ON_EVENT, ALWAYS,
         "Whether commands are taken, from which nodes, and refused ones.", latch=True, handler="status", source=OWN),
    accepts(TOPIC, "/io_teleop/joint_cmd", JOINTS, ALWAYS,
          "Target positions of any joints, by name.",
          handler="target_joints", qos=BEST_EFFORT_COMMANDS, source=NODE_OF_TIME),
    accepts(TOPIC, "/io_teleop/target_joint_from_vr", JOINTS, ALWAYS,
          "Target positions from the VR headset, by name, such as those of the head.",
          handler="target_joints", qos=BEST_EFFORT_COMMANDS, source=NODE_OF_TIME),
    accepts(TOPIC, "/io_teleop/target_gripper_status", JOINTS, GRIPPERS,
          "Target status of each gripper, 0 (open) to 1 (closed), in the order right, left; names are ignored.",
          handler="target_grippers", qos=BEST_EFFORT_COMMANDS, source=NODE_OF_TIME),
    accepts(TOPIC, "/io_teleop/target_finger_joints", JOINTS, ALWAYS,
          "Target positions of finger joints, by name.",
          handler="target_joints", qos=BEST_EFFORT_COMMANDS, source=NODE_OF_TIME),
    accepts(TOPIC, "/io_teleop/joint_cmd_finger_left", JOINTS, ALWAYS,
          "Target positions of finger joints of the left hand, by name.",
          handler="target_left_hand", qos=BEST_EFFORT_COMMANDS, source=ADOPTERS),
    accepts(TOPIC, "/io_teleop/joint_cmd_finger_right", JOINTS, ALWAYS,
          "Target positions of finger joints of the right hand, by name.",
          handler="target_right_hand", qos=BEST_EFFORT_COMMANDS, source=ADOPTERS),
    accepts(TOPIC, TARGET_EE_POSES, POSES, ARMS,
          "Target poses of the arm tips: right, left; in the frame of `controller_indices.base`.",
          handler="target_ee_poses", qos=BEST_EFFORT_COMMANDS, source=NODE_OF_TIME),
    accepts(TOPIC, "/io_teleop/target_base_move", "std_msgs/Float64MultiArray", FREE_BASE,
          "Turn of the base [rad], and motion along its own y axis [m]; with three numbers along its x and y axes.",
          handler="move_base", qos=BEST_EFFORT_COMMANDS, source=NODE_OF_TIME),
    accepts(TOPIC, "/io_teleop/emergency_stop", "std_msgs/Bool", ALWAYS,
          "True: hold at once, and ignore commands until the stop is cleared.", handler="stop", source=OWN),
    accepts(SERVICE, "/io_teleop_reset_robot", "std_srvs/Trigger", ALWAYS,
          "Moves the robot home; responds when it is there.", handler="go_home", source=NODE_OF_TIME),
    accepts(SERVICE, "/io_teleop/set_enabled", "std_srvs/SetBool", ALWAYS,
          "Enables or disables commands.", handler="set_enabled", source=OWN),
    accepts(SERVICE, "/io_teleop/clear_emergency_stop", "std_srvs/Trigger", ALWAYS,
          "Clears an emergency stop; the robot holds until the next command.",
          handler="clear_stop", source=OWN),
    accepts(TOPIC, "/cellwright/policy", "std_msgs/String", ALONE,
          "Each request to a policy with its answer, as a JSON object, for recordings; without effect on the robot.",
          handler="note_policy", source=OWN),
)
# fmt: on

CONTROLLER_NAMES = {"/io_teleop/joint_states": "/joint_states"}
"""Names in ROS 2 for programs of ros2_control, by the name of io_teleop."""

JOINT_SOURCES = tuple(row.name for row in IO_TELEOP if row.direction is Direction.IN and row.type in (JOINTS, POSES))
"""Topics whose messages are joint targets. Their indices in this order are part of the saved state."""

COMMAND_TOPICS = (*JOINT_SOURCES, "/io_teleop/target_base_move")
"""Topics that move the robot."""

DESCRIPTION = "robot_description"
"""Standard ROS parameter for a robot's URDF."""
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML forbids. Old URDFs contain them, and a ROS master rejects them."""


def robot_identity(node: str, *, sim_time: bool = False) -> Identity:
    """Return the identity of a robot's controller node in ROS 1, by its name with or without the slash in front.

    Raises:
        UsageError: ROS does not accept the name.
    """
    return Identity(
        node_name(node), "robot", tells_time=sim_time, shared=(DESCRIPTION,), exclusive_topic="/io_teleop/joint_states"
    )


class _Node(NamedTuple):
    """Description of a node, on which its rows depend."""

    config: RobotConfig
    cameras: tuple[str, ...]
    sim_time: bool
    is_alone: bool


def in_namespace(text: str, namespace: str) -> str:
    """Return a name of the table, or a text with such names, in another namespace.

    Example:
        >>> in_namespace("/io_teleop/joint_cmd", "left"), in_namespace("/io_teleop_reset_robot", "left")
        ('/left/joint_cmd', '/left_reset_robot')
    """
    return text.replace(NAMESPACE, namespace)


def rows(
    config: RobotConfig, *, cameras: Iterable[str] = (), node: str = NODE, sim_time: bool = False
) -> tuple[Endpoint, ...]:
    """Return the rows of a robot's node, with its working cameras, and /clock if it publishes its own time."""
    return _rows(_Node(config, tuple(cameras), sim_time, is_alone=True), node)


def rows_in_cell(
    config: RobotConfig, *, cameras: Iterable[str] = (), node: str = NODE, namespace: str = NAMESPACE
) -> tuple[Endpoint, ...]:
    """Return the rows of a robot that stands at its place in a cell, which has the clock, in a namespace."""
    found = _rows(_Node(config, tuple(cameras), sim_time=False, is_alone=False), node)
    return tuple(replace(row, name=in_namespace(row.name, namespace)) for row in found)


def _rows(robot: _Node, node: str) -> tuple[Endpoint, ...]:
    found = [row for row in IO_TELEOP if row.where is not EACH_CAMERA and row.where.subjects(robot)]
    found += [row.of(name) for name in robot.cameras for row in IO_TELEOP if row.where is EACH_CAMERA]
    return tuple(replace(row, node=node) for row in found)


def ros_parameters(urdf: str, *, node: str, sim_time: bool) -> dict[str, Any]:
    """Return the parameters of a node, in nested dictionaries by their names; an empty URDF is left out."""
    found: dict[str, Any] = {"use_sim_time": True} if sim_time else {}
    if urdf:
        found[node.strip("/")] = {DESCRIPTION: _NOT_XML.sub("", urdf)}
    return found
