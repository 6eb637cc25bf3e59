"""Interface of the kit-building cell: all topics and services of the 2017 competition ("GEAR"), as a table.

Handlers are methods of `CellCommands`, `CellPublications` and action servers. The names, types, rates and latches are
the original's; "each step" means the simulation's own step. The rows mark two kinds of cheating in the competition:
observing the trays, and controlling belt, parts and scoring.
"""

from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction

from cellwright.cell.interface.occurrence import (
    EACH_AGV,
    EACH_ARM,
    EACH_BELT,
    EACH_BREAK_BEAM,
    EACH_CLOUD_CAMERA,
    EACH_COLOUR_CAMERA,
    EACH_DEPTH_CAMERA,
    EACH_FINGERS,
    EACH_FIXED_TRAY,
    EACH_FLOW,
    EACH_GRIPPER,
    EACH_LASER_PROFILER,
    EACH_LOGICAL_CAMERA,
    EACH_PROXIMITY_SENSOR,
    EACH_QUALITY_SENSOR,
    EACH_TRAY,
    WITH_ARM,
    WITH_ARM_OR_ROBOT,
    WITH_BELT,
    WITH_BELT_PARTS,
    WITH_CAMERAS,
    WITH_NAMESPACES,
    WITH_ROBOTS,
    WITH_TRAYS,
    CompetitionMode,
)
from cellwright.config.sensors import PictureCameraConfig
from cellwright.config.trial.trial import Trial
from cellwright.middleware.interface.table import ALWAYS, Endpoint, EndpointKind, Timing, accepts, publishes
from cellwright.middleware.ros1.identity import Identity
from cellwright.util.errors import UsageError

ARIAC = "/ariac"
FOLLOW = f"{ARIAC}/arm/follow_joint_trajectory"
FOLLOW_OF_ARM = f"{ARIAC}/{{arm}}/arm/follow_joint_trajectory"
GRIP = f"{ARIAC}/gripper/gripper_cmd"
PARALLEL_GRIP = f"{ARIAC}/gripper/parallel_gripper_cmd"
INTENTION = "/cellwright/intention"
POLICY = "/cellwright/policy"
OPERATOR = "/cellwright/operator"

CONTROLLER_NAMES = {
    "/ariac/joint_states": "/joint_states",
    "/ariac/arm/command": "/arm_controller/joint_trajectory",
    "/ariac/arm/state": "/arm_controller/controller_state",
    "/ariac/arm/query_state": "/arm_controller/query_state",
    FOLLOW: "/arm_controller/follow_joint_trajectory",
    "/ariac/{arm}/arm/command": "/{arm}_controller/joint_trajectory",
    "/ariac/{arm}/arm/state": "/{arm}_controller/controller_state",
    "/ariac/{arm}/arm/query_state": "/{arm}_controller/query_state",
    FOLLOW_OF_ARM: "/{arm}_controller/follow_joint_trajectory",
    GRIP: "/gripper_controller/gripper_cmd",
    PARALLEL_GRIP: "/parallel_gripper_controller/gripper_cmd",
    "/ariac/{arm}/gripper/gripper_cmd": "/{arm}_gripper_controller/gripper_cmd",
    "/ariac/{arm}/gripper/parallel_gripper_cmd": "/{arm}_parallel_gripper_controller/gripper_cmd",
}
"""Names in ROS 2 for programs of ros2_control, such as MoveIt, by the name of 2017; `{arm}` is a namespace."""

TOPIC, SERVICE, ACTION = EndpointKind.TOPIC, EndpointKind.SERVICE, EndpointKind.ACTION
EACH_STEP, ON_EVENT = Timing.EACH_STEP, Timing.ON_EVENT
NODE = "/gazebo"
SIMULATOR = Identity(
    NODE,
    "cell",
    frame_source="/ariac/joint_states",
    subscribes=("/ariac/gripper/state", "/ariac/trays"),  # of the original's task manager, a part of its node
    rival="a simulator",
)
"""Node of a cell in ROS 1, as in the original's graph."""

# Plugins and nodes of the original that the rows are taken from.
MANAGER = "ROSAriacTaskManagerPlugin"
KIT_TRAY = "ROSAriacKitTrayPlugin"
AGV = "ROSAGVPlugin"
GRIPPER = "ROSVacuumGripperPlugin"
CONVEYOR = "ROSConveyorBeltPlugin"
POPULATION = "ROSPopulationPlugin"
CAMERA = "ROSLogicalCameraPlugin"
BEAM = "ROSProximityRayPlugin"
CONTROLLER = "joint_trajectory_controller"
CONTROL = "controller_manager"
ACTIONS = "actionlib"
FRAMES = "robot_state_publisher"
FINGERS = "gripper_action_controller"
COMMANDED_FINGERS = "pr2_gripper_controller"
PARALLEL_FINGERS = "parallel_gripper_action_controller"

IN_COMPETITION = {
    "/ariac/submit_tray": CompetitionMode.REFUSES,
    "/ariac/trays": CompetitionMode.SILENCED,
    "/ariac/kit_tray_{n}/clear_tray": CompetitionMode.REFUSES,
    "/ariac/conveyor/control": CompetitionMode.REFUSES,
    "/ariac/conveyor_{belt}/control": CompetitionMode.REFUSES,
    "/ariac/population/control": CompetitionMode.ABSENT,
    "/ariac/population_{belt}/control": CompetitionMode.ABSENT,
}
"""Rows that differ in competition mode, by name: those that would be cheating there."""

# fmt: off
TIME_AND_FRAMES = (
    publishes("/clock", "rosgraph_msgs/Clock", EACH_STEP, ALWAYS,
         "Simulation time.", handler="clock", source="gazebo_ros"),
    publishes("/tf", "tf2_msgs/TFMessage", 50, WITH_ARM,
         "Poses of the arm's links.", node="/robot_state_publisher", handler="arm_frames", source=FRAMES),
    publishes("/tf", "tf2_msgs/TFMessage", 50, WITH_ROBOTS,
         "Poses of the links and cameras of robots, those that do not move too.", handler="robot_frames"),
    publishes("/tf", "tf2_msgs/TFMessage", 10, WITH_CAMERAS,
         "Poses of the logical cameras and of the objects in view.", handler="camera_frames", source=CAMERA),
    publishes("/tf_static", "tf2_msgs/TFMessage", ON_EVENT, ALWAYS,
         "Frames of bins, belt, load points and sensors, and those fixed to links of the arm.",
         latch=True, node="/robot_state_publisher", handler="static_frames", source=FRAMES),
)

TRIAL = (
    publishes("/ariac/competition_state", "std_msgs/String", 10, ALWAYS,
         "`init`, `ready`, `go`, `end_game` or `done`.", handler="competition_state", source=MANAGER),
    publishes("/ariac/current_score", "std_msgs/Float32", 10, ALWAYS,
         "Current score; also when a kit is judged.", handler="current_score", source=MANAGER),
    publishes("/ariac/orders", "osrf_gear/Order", ON_EVENT, ALWAYS,
         "Each order as it is announced; a late subscriber gets only the newest.",
         latch=True, handler="orders", source=MANAGER),
    accepts(SERVICE, "/ariac/start_competition", "std_srvs/Trigger", ALWAYS,
          "Starts the trial; succeeds once.", handler="start_competition", source=MANAGER),
    accepts(SERVICE, "/ariac/end_competition", "std_srvs/Trigger", ALWAYS,
          "Ends the trial, from any state.", handler="end_competition", source=MANAGER),
    accepts(SERVICE, "/ariac/material_locations", "osrf_gear/GetMaterialLocations", ALWAYS,
          "Storage units of a part type or of trays, or the tray of a kit; an empty list for an unknown type.",
          handler="material_locations", source=MANAGER),
    accepts(SERVICE, "/ariac/submit_tray", "osrf_gear/SubmitTray", ALWAYS,
          "Scores a tray where it stands; no response unless the state is `go`.",
          handler="submit_tray", source=MANAGER),
    accepts(TOPIC, INTENTION, "std_msgs/String", ALWAYS,
          "Current intention of the agent in one line, for viewers; without effect on the run.",
          handler="note_intention"),
    accepts(TOPIC, POLICY, "std_msgs/String", ALWAYS,
          "Each request to a policy with its answer, as a JSON object, for recordings; without effect on the run.",
          handler="note_policy"),
    accepts(TOPIC, f"{OPERATOR}/pose", "geometry_msgs/PoseStamped", WITH_ARM_OR_ROBOT,
          "Pose in the world that the tool of the chosen arm is to go to, for the agent `operator`.",
          handler="request_operator"),
    accepts(TOPIC, f"{OPERATOR}/velocity", "geometry_msgs/TwistStamped", WITH_ARM_OR_ROBOT,
          "Velocity of that tool in the frame `world` or `tool`; it holds for 0.25 s.", handler="request_operator"),
    accepts(TOPIC, f"{OPERATOR}/joints", "sensor_msgs/JointState", WITH_ARM_OR_ROBOT,
          "Positions that joints are to go to, or their velocities for 0.25 s.", handler="request_operator"),
    accepts(TOPIC, f"{OPERATOR}/command", "std_msgs/String", WITH_ARM_OR_ROBOT,
          "`start`, `stop`, `clear`, `home`, `hold`, `snap`, `arm NAME`, `upright on` or `belt on`, also `off`.",
          handler="request_operator"),
    accepts(TOPIC, f"{OPERATOR}/report", "std_msgs/String", WITH_ARM_OR_ROBOT,
          "State of the agent `operator`, as a JSON object, for pages and recordings; without effect on the run.",
          handler="note_operator"),
    accepts(SERVICE, "/cellwright/part_types", "std_srvs/Trigger", ALWAYS,
          "Part types that the trial file defines, as a JSON object in `message`: mass, box and flat spots of the top.",
          handler="part_types"),
    accepts(SERVICE, "/cellwright/solids", "std_srvs/Trigger", ALWAYS,
          "Shapes of the arm's links and of what they must not hit, but for parts, as a JSON object in `message`.",
          handler="solids"),
    accepts(SERVICE, "/cellwright/layout", "std_srvs/Trigger", ALWAYS,
          "Places of bins, belts, trays, AGVs and arms, the arms' chains of joints, what can be commanded, and the "
          "task's sentence, as a JSON object in `message`.",
          handler="layout"),
)

ARM = (
    publishes("/ariac/joint_states", "sensor_msgs/JointState", 50, EACH_ARM,
         "The seven joints in alphabetical order, then the gripper's, which is always 0.",
         handler="joint_states", source="joint_state_controller"),
    publishes("/ariac/joint_states", "sensor_msgs/JointState", 50, WITH_NAMESPACES,
         "The joints of all arms, with the arm's name before each, as in the robot description of the cell.",
         handler="all_joint_states", source="joint_state_controller"),
    accepts(TOPIC, "/ariac/arm/command", "trajectory_msgs/JointTrajectory", EACH_ARM,
          "Trajectory to follow; replaces the current one.", handler="command_arm", source=CONTROLLER),
    publishes("/ariac/arm/state", "control_msgs/JointTrajectoryControllerState", 25, EACH_ARM,
         "Desired and actual state of the joints, and the difference.",
         handler="arm_state", source=CONTROLLER),
    accepts(SERVICE, "/ariac/arm/query_state", "control_msgs/QueryTrajectoryState", EACH_ARM,
          "Returns the desired state of the joints at a time.", handler="query_arm_state", source=CONTROLLER),
    accepts(ACTION, FOLLOW, "control_msgs/FollowJointTrajectory", EACH_ARM,
          "Trajectory to follow within tolerances, with a result; in ROS 1 the five topics under this name.",
          source=CONTROLLER),
    accepts(TOPIC, f"{FOLLOW}/goal", "control_msgs/FollowJointTrajectoryActionGoal", EACH_ARM,
          "Trajectory with its tolerances.", handler="take_goal", source=ACTIONS),
    accepts(TOPIC, f"{FOLLOW}/cancel", "actionlib_msgs/GoalID", EACH_ARM,
          "Cancels a goal, also one that has not arrived yet; the arm stops.", handler="take_cancel", source=ACTIONS),
    publishes(f"{FOLLOW}/status", "actionlib_msgs/GoalStatusArray", 5, EACH_ARM,
         "Status of the goals; also published at each change.",
         latch=True, handler="goal_status", source=ACTIONS),
    publishes(f"{FOLLOW}/feedback", "control_msgs/FollowJointTrajectoryActionFeedback", 10, EACH_ARM,
         "Desired and actual state of the joints, while a goal is active.", handler="goal_feedback", source=CONTROLLER),
    publishes(f"{FOLLOW}/result", "control_msgs/FollowJointTrajectoryActionResult", ON_EVENT, EACH_ARM,
         "Result of a goal.", handler="goal_result", source=ACTIONS),
    accepts(SERVICE, "/ariac/controller_manager/list_controllers", "controller_manager_msgs/ListControllers", EACH_ARM,
          "The two controllers, which always run.", handler="list_controllers", source=CONTROL),
    accepts(SERVICE, "/ariac/controller_manager/list_controller_types", "controller_manager_msgs/ListControllerTypes",
          EACH_ARM, "The types of both.", handler="list_controller_types", source=CONTROL),
    accepts(SERVICE, "/ariac/controller_manager/switch_controller", "controller_manager_msgs/SwitchController",
          EACH_ARM, "Succeeds if nothing would change: both always run.", handler="switch_controller", source=CONTROL),
    accepts(SERVICE, "/ariac/controller_manager/load_controller", "controller_manager_msgs/LoadController", EACH_ARM,
          "Never succeeds: both are loaded, and there is no other.", handler="load_controller", source=CONTROL),
    accepts(SERVICE, "/ariac/controller_manager/unload_controller", "controller_manager_msgs/UnloadController",
          EACH_ARM, "Never succeeds: both always run.", handler="unload_controller", source=CONTROL),
    accepts(SERVICE, "/ariac/controller_manager/reload_controller_libraries",
          "controller_manager_msgs/ReloadControllerLibraries", EACH_ARM,
          "Never succeeds: both always run.", handler="reload_controller_libraries", source=CONTROL),
    publishes("/ariac/gripper/state", "osrf_gear/VacuumGripperState", EACH_STEP, EACH_GRIPPER,
         "Whether the suction is on, or fingers are closed, and whether a part is attached.",
         handler="gripper_state", source=GRIPPER),
    accepts(SERVICE, "/ariac/gripper/control", "osrf_gear/VacuumGripperControl", EACH_GRIPPER,
          "Switches the suction on or off, or closes or opens fingers; always succeeds.",
          handler="control_gripper", source=GRIPPER),
    accepts(TOPIC, "/ariac/gripper/command", "control_msgs/GripperCommand", EACH_FINGERS,
          "Distance between the pads to move to, with a largest force; replaces the current one.",
          handler="command_gripper", source=COMMANDED_FINGERS),
    accepts(ACTION, GRIP, "control_msgs/GripperCommand", EACH_FINGERS,
          "The same with a result: whether the pads are there, or a part keeps them from it; in ROS 1 the five topics "
          "under this name.", source=FINGERS),
    accepts(TOPIC, f"{GRIP}/goal", "control_msgs/GripperCommandActionGoal", EACH_FINGERS,
          "Distance and largest force.", handler="take_goal", source=ACTIONS),
    accepts(TOPIC, f"{GRIP}/cancel", "actionlib_msgs/GoalID", EACH_FINGERS,
          "Cancels a goal; the fingers stop, and a part stays held.", handler="take_cancel", source=ACTIONS),
    publishes(f"{GRIP}/status", "actionlib_msgs/GoalStatusArray", 5, EACH_FINGERS,
         "Status of the goals; also published at each change.",
         latch=True, handler="goal_status", source=ACTIONS),
    publishes(f"{GRIP}/feedback", "control_msgs/GripperCommandActionFeedback", 10, EACH_FINGERS,
         "Present distance and force, while a goal is active.", handler="goal_feedback", source=FINGERS),
    publishes(f"{GRIP}/result", "control_msgs/GripperCommandActionResult", ON_EVENT, EACH_FINGERS,
         "Result of a goal.", handler="goal_result", source=ACTIONS),
    accepts(ACTION, PARALLEL_GRIP, "control_msgs/ParallelGripperCommand", EACH_FINGERS,
          "The same by joints of fingers, with a largest speed; not in ROS 1, which lacks the type.",
          source=PARALLEL_FINGERS),
    accepts(TOPIC, f"{PARALLEL_GRIP}/goal", "control_msgs/ParallelGripperCommandActionGoal", EACH_FINGERS,
          "Positions of finger joints, with largest speeds and forces.", handler="take_goal", source=ACTIONS),
    accepts(TOPIC, f"{PARALLEL_GRIP}/cancel", "actionlib_msgs/GoalID", EACH_FINGERS,
          "Cancels a goal; the fingers stop, and a part stays held.", handler="take_cancel", source=ACTIONS),
    publishes(f"{PARALLEL_GRIP}/status", "actionlib_msgs/GoalStatusArray", 5, EACH_FINGERS,
         "Status of the goals; also published at each change.",
         latch=True, handler="goal_status", source=ACTIONS),
    publishes(f"{PARALLEL_GRIP}/feedback", "control_msgs/ParallelGripperCommandActionFeedback", 10, EACH_FINGERS,
         "Present state of the finger joints, while a goal is active.",
         handler="goal_feedback", source=PARALLEL_FINGERS),
    publishes(f"{PARALLEL_GRIP}/result", "control_msgs/ParallelGripperCommandActionResult", ON_EVENT, EACH_FINGERS,
         "Result of a goal.", handler="goal_result", source=ACTIONS),
)

TRAYS = (
    accepts(SERVICE, "/ariac/{agv}", "osrf_gear/AGVControl", EACH_AGV,
          "Sends the AGV off with its tray as a kit; succeeds if the AGV was ready, whatever the kit.",
          handler="send_agv", source=AGV),
    publishes("/ariac/{agv}/state", "std_msgs/String", EACH_STEP, EACH_AGV,
         "`ready_to_deliver`, `preparing_to_deliver`, `delivering`, `delivered` or `returning`.",
         handler="agv_state", source=AGV),
    publishes("/ariac/quality_control_sensor_{n}", "osrf_gear/LogicalCameraImage", 10, EACH_QUALITY_SENSOR,
         "Faulty parts on the tray of the AGV.", latch=True, handler="quality_control_image", source=CAMERA),
    publishes("/ariac/trays", "osrf_gear/TrayContents", 1, WITH_TRAYS,
         "Contents of each tray, one message per tray.",
         handler="tray_contents", source=KIT_TRAY),
    accepts(SERVICE, "/ariac/kit_tray_{n}/clear_tray", "std_srvs/Trigger", EACH_TRAY,
          "Removes everything from the tray.", handler="clear_tray", source=KIT_TRAY),
    accepts(SERVICE, "/ariac/{tray}", "osrf_gear/AGVControl", EACH_FIXED_TRAY,
          "Submits a fixed tray as a kit, which leaves the cell; succeeds if the tray was ready, whatever the kit.",
          handler="send_agv", source=AGV),
    publishes("/ariac/{tray}/state", "std_msgs/String", EACH_STEP, EACH_FIXED_TRAY,
         "`ready_to_deliver`, `preparing_to_deliver` or `delivered`.", handler="agv_state", source=AGV),
)

BELT = (
    accepts(SERVICE, "/ariac/conveyor/control", "osrf_gear/ConveyorBeltControl", WITH_BELT,
          "Sets the power of the belt, 0 to 100; other values change nothing and succeed as well.",
          handler="control_conveyor", source=CONVEYOR),
    publishes("/ariac/population/state", "osrf_gear/PopulationState", EACH_STEP, WITH_BELT_PARTS,
         "Whether parts are being added to the belt.", handler="population_state", source=POPULATION),
    accepts(SERVICE, "/ariac/population/control", "osrf_gear/PopulationControl", WITH_BELT_PARTS,
          "`pause`, `resume` or `restart` the flow of parts; no response to other actions.",
          handler="control_population", source=POPULATION),
    accepts(SERVICE, "/ariac/conveyor_{belt}/control", "osrf_gear/ConveyorBeltControl", EACH_BELT,
          "Sets the power of one of several belts, as of a single one.", handler="control_conveyor", source=CONVEYOR),
    publishes("/ariac/population_{belt}/state", "osrf_gear/PopulationState", EACH_STEP, EACH_FLOW,
         "Whether parts are being added to one of several belts.", handler="population_state", source=POPULATION),
    accepts(SERVICE, "/ariac/population_{belt}/control", "osrf_gear/PopulationControl", EACH_FLOW,
          "Controls the flow of parts onto one of several belts.", handler="control_population", source=POPULATION),
)

SENSORS = (
    publishes("/ariac/{sensor}", "osrf_gear/Proximity", 20, EACH_BREAK_BEAM,
         "Whether an object interrupts the beam.", latch=True, handler="break_beam", source=BEAM),
    publishes("/ariac/{sensor}_change", "osrf_gear/Proximity", ON_EVENT, EACH_BREAK_BEAM,
         "The same, published only at a change.", latch=True, handler="break_beam_change", source=BEAM),
    publishes("/ariac/{sensor}", "sensor_msgs/Range", 20, EACH_PROXIMITY_SENSOR,
         "Distance to the nearest object in the cone; the maximum range if there is none.",
         handler="proximity_sensor", source="gazebo_ros_range"),
    publishes("/ariac/{sensor}", "sensor_msgs/LaserScan", 100, EACH_LASER_PROFILER,
         "Profile of 400 distances.", handler="laser_profiler", source="gazebo_ros_laser"),
    publishes("/ariac/{sensor}", "osrf_gear/LogicalCameraImage", 10, EACH_LOGICAL_CAMERA,
         "Types and poses of all objects in view, occluded or not.",
         latch=True, handler="logical_camera", source=CAMERA),
)

PICTURES = (
    publishes("/ariac/{sensor}/image_raw", "sensor_msgs/Image", 10, EACH_COLOUR_CAMERA,
         "Colour picture, `rgb8`.", handler="colour_picture"),
    publishes("/ariac/{sensor}/camera_info", "sensor_msgs/CameraInfo", 10, EACH_COLOUR_CAMERA,
         "Camera matrix of the colour pictures, without distortion.", handler="camera_info"),
    publishes("/ariac/{sensor}/depth/image_raw", "sensor_msgs/Image", 10, EACH_DEPTH_CAMERA,
         "Depth along the line of sight [m], `32FC1`; NaN where nothing was measured.", handler="depth_picture"),
    publishes("/ariac/{sensor}/depth/camera_info", "sensor_msgs/CameraInfo", 10, EACH_DEPTH_CAMERA,
         "Camera matrix of the depth pictures, the same as that of the colour pictures.", handler="camera_info"),
    publishes("/ariac/{sensor}/depth/points", "sensor_msgs/PointCloud2", 10, EACH_DEPTH_CAMERA,
         "One point per pixel in the optical frame, with its colour if the camera has colour; NaN where nothing was "
         "measured.", handler="depth_points"),
    publishes("/ariac/{sensor}", "sensor_msgs/PointCloud", 10, EACH_CLOUD_CAMERA,
         "Measured points in the camera's frame.", handler="point_cloud"),
)
# fmt: on
"""Camera topics, which did not exist in 2017; the rate is that of the camera."""

GEAR: tuple[Endpoint, ...] = tuple(
    replace(row, node=row.node or NODE) for row in (*TIME_AND_FRAMES, *TRIAL, *ARM, *TRAYS, *BELT, *SENSORS)
)
"""The whole interface, as templates."""


def rows(trial: Trial, *, competition: bool) -> tuple[Endpoint, ...]:
    """Return the interface of one cell, with its templates filled in, in the order of the table.

    Raises:
        UsageError: a sensor's name leads to a topic that is already published with another type.
    """
    handlers = {CompetitionMode.REFUSES: "refuse", CompetitionMode.SILENCED: "silence"}
    endpoints = []
    for row in GEAR:
        mode = IN_COMPETITION.get(row.name) if competition else None
        if mode is not CompetitionMode.ABSENT:
            served = row if mode is None else replace(row, handler=handlers[mode])
            endpoints += [_of(served, subject) for subject in row.where.subjects(trial)]
    for camera in trial.sensors:
        if isinstance(camera, PictureCameraConfig):
            endpoints += camera_rows(trial, camera)
    _refuse_clashes(endpoints)
    return tuple(endpoints)


def camera_rows(trial: Trial, camera: PictureCameraConfig) -> list[Endpoint]:
    """Return the rows of one camera of a trial, at its rate."""
    rate = Fraction(repr(camera.rate))
    found = (row for row in PICTURES if camera.name in row.where.subjects(trial))
    return [replace(row.of(camera.name), rate=rate, node=NODE) for row in found]


def _of(row: Endpoint, subject: str | None) -> Endpoint:
    """Return a row for a subject; a namespace that its name has no place for comes behind `/ariac`."""
    if subject is None or "{" in row.name:
        return row.of(subject)
    return replace(row, name=in_namespace(row.name, subject), subject=subject)


def in_namespace(name: str, namespace: str | None) -> str:
    """Return the name of a row of an arm with its namespace; None for the only arm."""
    return name if namespace is None else name.replace(ARIAC, f"{ARIAC}/{namespace}", 1)


def _refuse_clashes(endpoints: Iterable[Endpoint]) -> None:
    topics: dict[str, Endpoint] = {}
    for row in endpoints:
        if row.kind is not TOPIC:
            continue
        first = topics.setdefault(row.name, row)
        if (first.type, first.direction) != (row.type, row.direction):
            raise UsageError(
                f"sensor {row.subject!r}: topic {row.name} already has type {first.type} (got {row.type}); "
                "rename the sensor"
            )
