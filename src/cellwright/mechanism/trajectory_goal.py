"""Trajectory goals: joint tolerances, and a goal that is followed within them and ends with a result.

The numbers of `GoalStatus` and `GoalResult` are those of actionlib_msgs/GoalStatus and of
control_msgs/FollowJointTrajectoryResult.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, NamedTuple, Protocol

from cellwright.engine.clock import seconds
from cellwright.mechanism.joint_trajectory import JointTrajectory


class RequestedTolerance(Protocol):
    """Tolerance requested by a goal: joint, position [rad or m], velocity [rad/s or m/s].

    0 keeps the controller's own tolerance, a negative number removes it.
    """

    name: str
    position: float
    velocity: float


class Tolerance(NamedTuple):
    """Maximum error of one joint in position [rad or m] and velocity [rad/s or m/s]; 0 is not checked."""

    position: float = 0.0
    velocity: float = 0.0

    def fault(self, position_error: float, velocity_error: float) -> str:
        """Return the violation of a joint with these errors [rad; m] and [rad/s; m/s], or an empty string."""
        # in this form, NaN is a violation too
        if self.position > 0.0 and not abs(position_error) <= self.position:
            return f"position is off by {abs(position_error):.4g}, {self.position:.4g} is allowed"
        if self.velocity > 0.0 and not abs(velocity_error) <= self.velocity:
            return f"velocity is off by {abs(velocity_error):.4g}, {self.velocity:.4g} is allowed"
        return ""

    def overridden(self, requested: RequestedTolerance) -> Tolerance:
        """Return this tolerance, overridden by the goal's request."""
        return Tolerance(_override(self.position, requested.position), _override(self.velocity, requested.velocity))


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Tolerances of a goal: one `Tolerance` per joint on the way and at the end, and the extra time after the end.

    `goal_time` [ns] None waits forever.
    """

    path: tuple[Tolerance, ...]
    goal: tuple[Tolerance, ...]
    goal_time: int | None = 0

    def overridden(self, joint_names: Sequence[str], request: GoalRequest) -> Tolerances:
        """Return these tolerances, overridden by the goal's request."""
        goal_time = request.goal_time_tolerance_ns
        return Tolerances(
            _overridden(self.path, request.path_tolerances, joint_names),
            _overridden(self.goal, request.goal_tolerances, joint_names),
            self.goal_time if goal_time == 0 else None if goal_time < 0 else goal_time,
        )


def _override(own: float, requested: float) -> float:
    return own if requested == 0.0 else max(requested, 0.0)


def _overridden(
    own: tuple[Tolerance, ...], requested: Sequence[RequestedTolerance], joint_names: Sequence[str]
) -> tuple[Tolerance, ...]:
    result = list(own)
    for one in requested:
        if one.name in joint_names:
            index = joint_names.index(one.name)
            result[index] = result[index].overridden(one)
    return tuple(result)


class GoalStatus(IntEnum):
    """Status of a goal."""

    ACTIVE = 1
    PREEMPTED = 2
    SUCCEEDED = 3
    ABORTED = 4


class GoalResult(IntEnum):
    """Result of a goal, or the reason for its rejection."""

    SUCCESSFUL = 0
    INVALID_GOAL = -1
    INVALID_JOINTS = -2
    OLD_HEADER_TIMESTAMP = -3
    PATH_TOLERANCE_VIOLATED = -4
    GOAL_TOLERANCE_VIOLATED = -5


@dataclass(frozen=True, slots=True)
class GoalRequest:
    """Goal as received: a trajectory, and tolerances in place of the controller's own.

    `goal_time_tolerance_ns` is the time after the end within which the goal must be reached [ns]: 0 keeps the
    controller's own, a negative number waits forever. Tolerances of joints that the controller does not have are
    ignored.
    """

    goal_id: str
    trajectory: JointTrajectory
    path_tolerances: Sequence[RequestedTolerance] = ()
    goal_tolerances: Sequence[RequestedTolerance] = ()
    goal_time_tolerance_ns: int = 0


class TrajectoryGoal:
    """Accepted goal, from its start to its end [ns], for some of the controller's joints, given by index.

    While the trajectory runs, each joint has to stay within its path tolerance. From the trajectory's end on, a joint
    has arrived as soon as it was within its goal tolerance once. The goal succeeds when all joints have arrived, and is
    aborted if one has not when the goal time is over. An aborted goal leaves the arm on its trajectory.
    """

    def __init__(
        self,
        goal_id: str,
        joint_names: Sequence[str],
        joints: Iterable[int],
        start: int,
        end: int,
        tolerances: Tolerances,
    ) -> None:
        self.goal_id = goal_id
        self.joint_names = tuple(joint_names)
        self.joints = tuple(joints)
        self.start = start
        self.end = end
        self.tolerances = tolerances
        self.status = GoalStatus.ACTIVE
        self.result: GoalResult | None = None
        self.reason = ""
        """Reason for its end, in a sentence; empty while it is active."""
        self._arrived = [False] * len(self.joint_names)
        self._path = tuple(joint for joint in self.joints if any(limit > 0.0 for limit in tolerances.path[joint]))

    @property
    def active(self) -> bool:
        """True while it is being followed."""
        return self.status is GoalStatus.ACTIVE

    def is_checked_at(self, time: int) -> bool:
        """Return whether `update` at `time` [ns] can change anything: some joint has a tolerance then."""
        return time >= self.end or (bool(self._path) and time >= self.start)

    def update(self, time: int, position_errors: Sequence[float], velocity_errors: Sequence[float]) -> GoalStatus:
        """Check the joints at `time` [ns].

        Errors are desired minus actual values, of each joint of the controller.
        """
        if self.status is not GoalStatus.ACTIVE or time < self.start:
            return self.status
        if time < self.end:
            for joint in self._path:
                if fault := self.tolerances.path[joint].fault(position_errors[joint], velocity_errors[joint]):
                    text = f"{self.joint_names[joint]} left its path {seconds(time - self.start):.3f} s after the start"
                    self._finish(GoalStatus.ABORTED, GoalResult.PATH_TOLERANCE_VIOLATED, f"{text}: {fault}")
                    break
            return self.status
        goal_time = self.tolerances.goal_time
        for joint in self.joints:
            if self._arrived[joint]:
                continue
            fault = self.tolerances.goal[joint].fault(position_errors[joint], velocity_errors[joint])
            if not fault:
                self._arrived[joint] = True
            elif goal_time is not None and time >= self.end + goal_time:
                text = f"{self.joint_names[joint]} had not arrived {seconds(time - self.end):.3f} s after the end"
                self._finish(GoalStatus.ABORTED, GoalResult.GOAL_TOLERANCE_VIOLATED, f"{text}: {fault}")
                return self.status
        if all(self._arrived[joint] for joint in self.joints):
            self._finish(GoalStatus.SUCCEEDED, GoalResult.SUCCESSFUL, "arrived")
        return self.status

    def preempt(self, reason: str) -> None:
        """End it in favour of another command."""
        self._finish(GoalStatus.PREEMPTED, None, reason)

    def get_state(self) -> dict[str, Any]:
        """Return the whole state as JSON values."""
        return {
            "goal_id": self.goal_id,
            "joints": list(self.joints),
            "start": self.start,
            "end": self.end,
            "path": [list(tolerance) for tolerance in self.tolerances.path],
            "goal": [list(tolerance) for tolerance in self.tolerances.goal],
            "goal_time": self.tolerances.goal_time,
            "status": int(self.status),
            "result": None if self.result is None else int(self.result),
            "reason": self.reason,
            "arrived": list(self._arrived),
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any], joint_names: Sequence[str]) -> TrajectoryGoal:
        """Restore the goal from what `get_state` returned."""
        tolerances = Tolerances(
            tuple(Tolerance(*pair) for pair in state["path"]),
            tuple(Tolerance(*pair) for pair in state["goal"]),
            state["goal_time"],
        )
        goal = cls(state["goal_id"], joint_names, state["joints"], state["start"], state["end"], tolerances)
        goal.status = GoalStatus(state["status"])
        goal.result = None if state["result"] is None else GoalResult(state["result"])
        goal.reason = state["reason"]
        goal._arrived = list(state["arrived"])
        return goal

    def _finish(self, status: GoalStatus, result: GoalResult | None, reason: str) -> None:
        self.status, self.result, self.reason = status, result, reason
