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


@message_class("control_msgs/msg/JointTrajectoryControllerState")
class JointTrajectoryControllerState(MessageClass):
    """State of a joint trajectory controller: desired and actual joint state, and their difference."""

    header: standard.Header = field(default_factory=conversions.header)
    joint_names: list[str] = field(default_factory=list)
    desired: standard.JointTrajectoryPoint = field(default_factory=conversions.trajectory_point)
    actual: standard.JointTrajectoryPoint = field(default_factory=conversions.trajectory_point)
    error: standard.JointTrajectoryPoint = field(default_factory=conversions.trajectory_point)


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
