"""Classes of what a joint trajectory controller says and hears (`definitions/control_msgs`)."""

from dataclasses import dataclass, field
from typing import ClassVar

from cellwright.middleware.messages.conversions import Floats, duration, floats, header, stamp, trajectory_point
from cellwright.middleware.messages.standard import (
    Duration,
    GoalID,
    GoalStatus,
    Header,
    JointTrajectory,
    JointTrajectoryPoint,
    Time,
)


def _no_goal() -> GoalID:
    return GoalID(stamp(0), "")


def _no_status() -> GoalStatus:
    return GoalStatus(_no_goal(), GoalStatus.PENDING, "")


def _no_trajectory() -> JointTrajectory:
    return JointTrajectory(header(), [], [])


@dataclass(slots=True)
class JointTolerance:
    """How far a joint may be off [rad or m, and per s, per s^2]; 0 keeps the controller's own, below 0 lifts it."""

    name: str = ""
    position: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0
    __msgtype__: ClassVar[str] = "control_msgs/msg/JointTolerance"


@dataclass(slots=True)
class JointTrajectoryControllerState:
    """What the controller wants, what the joints do, and the difference."""

    header: Header = field(default_factory=header)
    joint_names: list[str] = field(default_factory=list)
    desired: JointTrajectoryPoint = field(default_factory=trajectory_point)
    actual: JointTrajectoryPoint = field(default_factory=trajectory_point)
    error: JointTrajectoryPoint = field(default_factory=trajectory_point)
    __msgtype__: ClassVar[str] = "control_msgs/msg/JointTrajectoryControllerState"


@dataclass(slots=True)
class FollowJointTrajectoryGoal:
    """A trajectory to follow, and how well."""

    trajectory: JointTrajectory = field(default_factory=_no_trajectory)
    path_tolerance: list[JointTolerance] = field(default_factory=list)
    goal_tolerance: list[JointTolerance] = field(default_factory=list)
    goal_time_tolerance: Duration = field(default_factory=duration)
    __msgtype__: ClassVar[str] = "control_msgs/msg/FollowJointTrajectoryGoal"


@dataclass(slots=True)
class FollowJointTrajectoryResult:
    """How following a trajectory ended: a code, and the reason in words."""

    error_code: int = 0
    error_string: str = ""
    SUCCESSFUL: ClassVar[int] = 0
    INVALID_GOAL: ClassVar[int] = -1
    INVALID_JOINTS: ClassVar[int] = -2
    OLD_HEADER_TIMESTAMP: ClassVar[int] = -3
    PATH_TOLERANCE_VIOLATED: ClassVar[int] = -4
    GOAL_TOLERANCE_VIOLATED: ClassVar[int] = -5
    __msgtype__: ClassVar[str] = "control_msgs/msg/FollowJointTrajectoryResult"


@dataclass(slots=True)
class FollowJointTrajectoryFeedback:
    """How following a trajectory goes."""

    header: Header = field(default_factory=header)
    joint_names: list[str] = field(default_factory=list)
    desired: JointTrajectoryPoint = field(default_factory=trajectory_point)
    actual: JointTrajectoryPoint = field(default_factory=trajectory_point)
    error: JointTrajectoryPoint = field(default_factory=trajectory_point)
    __msgtype__: ClassVar[str] = "control_msgs/msg/FollowJointTrajectoryFeedback"


@dataclass(slots=True)
class FollowJointTrajectoryActionGoal:
    """A goal with its identifier, as it travels to the action server."""

    header: Header = field(default_factory=header)
    goal_id: GoalID = field(default_factory=_no_goal)
    goal: FollowJointTrajectoryGoal = field(default_factory=FollowJointTrajectoryGoal)
    __msgtype__: ClassVar[str] = "control_msgs/msg/FollowJointTrajectoryActionGoal"


@dataclass(slots=True)
class FollowJointTrajectoryActionResult:
    """A result with the goal that it belongs to, as it travels from the action server."""

    header: Header = field(default_factory=header)
    status: GoalStatus = field(default_factory=_no_status)
    result: FollowJointTrajectoryResult = field(default_factory=FollowJointTrajectoryResult)
    __msgtype__: ClassVar[str] = "control_msgs/msg/FollowJointTrajectoryActionResult"


@dataclass(slots=True)
class FollowJointTrajectoryActionFeedback:
    """Feedback with the goal that it belongs to, as it travels from the action server."""

    header: Header = field(default_factory=header)
    status: GoalStatus = field(default_factory=_no_status)
    feedback: FollowJointTrajectoryFeedback = field(default_factory=FollowJointTrajectoryFeedback)
    __msgtype__: ClassVar[str] = "control_msgs/msg/FollowJointTrajectoryActionFeedback"


@dataclass(slots=True)
class FollowJointTrajectoryAction:
    """The three messages of the action in one."""

    action_goal: FollowJointTrajectoryActionGoal = field(default_factory=FollowJointTrajectoryActionGoal)
    action_result: FollowJointTrajectoryActionResult = field(default_factory=FollowJointTrajectoryActionResult)
    action_feedback: FollowJointTrajectoryActionFeedback = field(default_factory=FollowJointTrajectoryActionFeedback)
    __msgtype__: ClassVar[str] = "control_msgs/msg/FollowJointTrajectoryAction"


@dataclass(slots=True)
class QueryTrajectoryStateRequest:
    """Ask where the controller wants its joints to be at `time`."""

    time: Time = field(default_factory=stamp)
    __msgtype__: ClassVar[str] = "control_msgs/srv/QueryTrajectoryState_Request"


@dataclass(slots=True)
class QueryTrajectoryStateResponse:
    """Where they are wanted, by joint [rad or m, and per s, per s^2]."""

    name: list[str] = field(default_factory=list)
    position: Floats = field(default_factory=floats)
    velocity: Floats = field(default_factory=floats)
    acceleration: Floats = field(default_factory=floats)
    __msgtype__: ClassVar[str] = "control_msgs/srv/QueryTrajectoryState_Response"
