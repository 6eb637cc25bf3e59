"""Messages and services of control_msgs, made of `definitions/control_msgs`.

Generated: change the definitions, and run `python -m tools.message_classes`.
"""

from dataclasses import field
from typing import ClassVar

from cellwright.middleware.messages import conversions, standard
from cellwright.middleware.messages.message_class import MessageClass, message_class


@message_class("control_msgs/msg/JointTolerance")
class JointTolerance(MessageClass):
    """Tolerance of a joint. 0 keeps the controller's own tolerance, a negative value removes it."""

    name: str = ""
    position: float = 0.0  # [rad] or [m]
    velocity: float = 0.0  # [rad/s] or [m/s]
    acceleration: float = 0.0  # [rad/s^2] or [m/s^2]


@message_class("control_msgs/msg/FollowJointTrajectoryGoal")
class FollowJointTrajectoryGoal(MessageClass):
    """A trajectory to follow, with its tolerances."""

    trajectory: standard.JointTrajectory = field(default_factory=conversions.joint_trajectory)
    path_tolerance: list[JointTolerance] = field(default_factory=list)  # on the way; a breach aborts the goal
    goal_tolerance: list[JointTolerance] = field(default_factory=list)  # at the end
    goal_time_tolerance: standard.Duration = field(default_factory=conversions.duration)  # maximum delay at the end


@message_class("control_msgs/msg/FollowJointTrajectoryActionGoal")
class FollowJointTrajectoryActionGoal(MessageClass):
    """A goal with its identifier, as the action server receives it."""

    header: standard.Header = field(default_factory=conversions.header)
    goal_id: standard.GoalID = field(default_factory=conversions.goal_id)
    goal: FollowJointTrajectoryGoal = field(default_factory=FollowJointTrajectoryGoal)


@message_class("control_msgs/msg/FollowJointTrajectoryResult")
class FollowJointTrajectoryResult(MessageClass):
    """Result of a trajectory execution."""

    error_code: int = 0
    error_string: str = ""  # the reason in words
    SUCCESSFUL: ClassVar[int] = 0
    INVALID_GOAL: ClassVar[int] = -1
    INVALID_JOINTS: ClassVar[int] = -2
    OLD_HEADER_TIMESTAMP: ClassVar[int] = -3
    PATH_TOLERANCE_VIOLATED: ClassVar[int] = -4
    GOAL_TOLERANCE_VIOLATED: ClassVar[int] = -5


@message_class("control_msgs/msg/FollowJointTrajectoryActionResult")
class FollowJointTrajectoryActionResult(MessageClass):
    """A result with the status of its goal, as the action server sends it."""

    header: standard.Header = field(default_factory=conversions.header)
    status: standard.GoalStatus = field(default_factory=conversions.goal_status)
    result: FollowJointTrajectoryResult = field(default_factory=FollowJointTrajectoryResult)


@message_class("control_msgs/msg/FollowJointTrajectoryFeedback")
class FollowJointTrajectoryFeedback(MessageClass):
    """Feedback during the execution of a trajectory."""

    header: standard.Header = field(default_factory=conversions.header)
    joint_names: list[str] = field(default_factory=list)
    desired: standard.JointTrajectoryPoint = field(default_factory=conversions.trajectory_point)
    actual: standard.JointTrajectoryPoint = field(default_factory=conversions.trajectory_point)
    error: standard.JointTrajectoryPoint = field(default_factory=conversions.trajectory_point)


@message_class("control_msgs/msg/FollowJointTrajectoryActionFeedback")
class FollowJointTrajectoryActionFeedback(MessageClass):
    """Feedback with the status of its goal, as the action server sends it."""

    header: standard.Header = field(default_factory=conversions.header)
    status: standard.GoalStatus = field(default_factory=conversions.goal_status)
    feedback: FollowJointTrajectoryFeedback = field(default_factory=FollowJointTrajectoryFeedback)


@message_class("control_msgs/msg/FollowJointTrajectoryAction")
class FollowJointTrajectoryAction(MessageClass):
    """The action: its three messages in one."""

    action_goal: FollowJointTrajectoryActionGoal = field(default_factory=FollowJointTrajectoryActionGoal)
    action_result: FollowJointTrajectoryActionResult = field(default_factory=FollowJointTrajectoryActionResult)
    action_feedback: FollowJointTrajectoryActionFeedback = field(default_factory=FollowJointTrajectoryActionFeedback)


@message_class("control_msgs/msg/GripperCommand")
class GripperCommand(MessageClass):
    """A distance between the fingers of a gripper to move to."""

    position: float = 0.0  # distance between the pads [m]
    max_effort: float = 0.0  # gripping force that is not exceeded [N]; 0 for the gripper's own


@message_class("control_msgs/msg/GripperCommandGoal")
class GripperCommandGoal(MessageClass):
    """A distance to move to."""

    command: GripperCommand = field(default_factory=GripperCommand)


@message_class("control_msgs/msg/GripperCommandActionGoal")
class GripperCommandActionGoal(MessageClass):
    """A goal with its identifier, as the action server receives it."""

    header: standard.Header = field(default_factory=conversions.header)
    goal_id: standard.GoalID = field(default_factory=conversions.goal_id)
    goal: GripperCommandGoal = field(default_factory=GripperCommandGoal)


@message_class("control_msgs/msg/GripperCommandResult")
class GripperCommandResult(MessageClass):
    """The gripper at the end of a goal."""

    position: float = 0.0  # distance between the pads [m]
    effort: float = 0.0  # gripping force [N]
    stalled: bool = False  # whether something keeps the fingers from their goal
    reached_goal: bool = False  # whether they are there


@message_class("control_msgs/msg/GripperCommandActionResult")
class GripperCommandActionResult(MessageClass):
    """A result with the status of its goal, as the action server sends it."""

    header: standard.Header = field(default_factory=conversions.header)
    status: standard.GoalStatus = field(default_factory=conversions.goal_status)
    result: GripperCommandResult = field(default_factory=GripperCommandResult)


@message_class("control_msgs/msg/GripperCommandFeedback")
class GripperCommandFeedback(MessageClass):
    """The gripper on its way to a goal."""

    position: float = 0.0  # distance between the pads [m]
    effort: float = 0.0  # gripping force [N]
    stalled: bool = False  # whether something keeps the fingers from their goal
    reached_goal: bool = False  # whether they are there


@message_class("control_msgs/msg/GripperCommandActionFeedback")
class GripperCommandActionFeedback(MessageClass):
    """Feedback with the status of its goal, as the action server sends it."""

    header: standard.Header = field(default_factory=conversions.header)
    status: standard.GoalStatus = field(default_factory=conversions.goal_status)
    feedback: GripperCommandFeedback = field(default_factory=GripperCommandFeedback)


@message_class("control_msgs/msg/GripperCommandAction")
class GripperCommandAction(MessageClass):
    """The action: its three messages in one."""

    action_goal: GripperCommandActionGoal = field(default_factory=GripperCommandActionGoal)
    action_result: GripperCommandActionResult = field(default_factory=GripperCommandActionResult)
    action_feedback: GripperCommandActionFeedback = field(default_factory=GripperCommandActionFeedback)


@message_class("control_msgs/msg/JointTrajectoryControllerState")
class JointTrajectoryControllerState(MessageClass):
    """State of a joint trajectory controller: desired and actual joint state, and their difference."""

    header: standard.Header = field(default_factory=conversions.header)
    joint_names: list[str] = field(default_factory=list)
    desired: standard.JointTrajectoryPoint = field(default_factory=conversions.trajectory_point)
    actual: standard.JointTrajectoryPoint = field(default_factory=conversions.trajectory_point)
    error: standard.JointTrajectoryPoint = field(default_factory=conversions.trajectory_point)


@message_class("control_msgs/msg/ParallelGripperCommandGoal")
class ParallelGripperCommandGoal(MessageClass):
    """Joints of fingers to move; only ROS 2 has this action."""

    # positions [m], with largest velocities [m/s] and efforts [N] if not empty
    command: standard.JointState = field(default_factory=conversions.joint_state)


@message_class("control_msgs/msg/ParallelGripperCommandActionGoal")
class ParallelGripperCommandActionGoal(MessageClass):
    """A goal with its identifier, as the action server receives it."""

    header: standard.Header = field(default_factory=conversions.header)
    goal_id: standard.GoalID = field(default_factory=conversions.goal_id)
    goal: ParallelGripperCommandGoal = field(default_factory=ParallelGripperCommandGoal)


@message_class("control_msgs/msg/ParallelGripperCommandResult")
class ParallelGripperCommandResult(MessageClass):
    """The gripper at the end of a goal."""

    state: standard.JointState = field(default_factory=conversions.joint_state)  # joints of the fingers
    stalled: bool = False  # whether something keeps the fingers from their goal
    reached_goal: bool = False  # whether they are there


@message_class("control_msgs/msg/ParallelGripperCommandActionResult")
class ParallelGripperCommandActionResult(MessageClass):
    """A result with the status of its goal, as the action server sends it."""

    header: standard.Header = field(default_factory=conversions.header)
    status: standard.GoalStatus = field(default_factory=conversions.goal_status)
    result: ParallelGripperCommandResult = field(default_factory=ParallelGripperCommandResult)


@message_class("control_msgs/msg/ParallelGripperCommandFeedback")
class ParallelGripperCommandFeedback(MessageClass):
    """The gripper on its way to a goal."""

    state: standard.JointState = field(default_factory=conversions.joint_state)  # joints of the fingers


@message_class("control_msgs/msg/ParallelGripperCommandActionFeedback")
class ParallelGripperCommandActionFeedback(MessageClass):
    """Feedback with the status of its goal, as the action server sends it."""

    header: standard.Header = field(default_factory=conversions.header)
    status: standard.GoalStatus = field(default_factory=conversions.goal_status)
    feedback: ParallelGripperCommandFeedback = field(default_factory=ParallelGripperCommandFeedback)


@message_class("control_msgs/msg/ParallelGripperCommandAction")
class ParallelGripperCommandAction(MessageClass):
    """The action: its three messages in one."""

    action_goal: ParallelGripperCommandActionGoal = field(default_factory=ParallelGripperCommandActionGoal)
    action_result: ParallelGripperCommandActionResult = field(default_factory=ParallelGripperCommandActionResult)
    action_feedback: ParallelGripperCommandActionFeedback = field(default_factory=ParallelGripperCommandActionFeedback)


@message_class("control_msgs/srv/QueryTrajectoryState_Request")
class QueryTrajectoryStateRequest(MessageClass):
    """Returns the desired joint state of a controller at a given time."""

    time: standard.Time = field(default_factory=conversions.stamp)


@message_class("control_msgs/srv/QueryTrajectoryState_Response")
class QueryTrajectoryStateResponse(MessageClass):
    """Response of control_msgs/QueryTrajectoryState."""

    name: list[str] = field(default_factory=list)
    position: conversions.Floats = field(default_factory=conversions.floats)  # [rad] or [m]
    velocity: conversions.Floats = field(default_factory=conversions.floats)  # [rad/s] or [m/s]
    acceleration: conversions.Floats = field(default_factory=conversions.floats)  # [rad/s^2] or [m/s^2]
