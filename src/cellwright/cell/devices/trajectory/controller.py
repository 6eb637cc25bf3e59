"""The joint trajectory controller: what the joints of an arm are to do, by topic commands and action goals.

It holds the semantics of the original controller (ros_controllers, ROS Kinetic), and no servo: a device samples it
and drives the joints. Limits of position and velocity are not enforced here, as they were not there.

It is sampled with `positions(time)` and `velocities(time)`, lists in the order of the joints, about 1 us each for
seven joints; once `settled_at(time)` is true they stay as they are until the next command.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from cellwright.cell.devices.trajectory.command import RejectedTrajectoryError, check_names, check_trajectory, splice
from cellwright.cell.devices.trajectory.goal import GoalRequest, GoalResult, TrajectoryGoal
from cellwright.cell.devices.trajectory.tolerance import Tolerance, Tolerances, default_tolerances
from cellwright.cell.devices.trajectory.trajectory import JointsState, JointTrajectory, Trajectory, rest, stop
from cellwright.config.trial.trial import ArmSettings, JointTolerance
from cellwright.engine.clock import nanoseconds, seconds
from cellwright.util.errors import UsageError


class Following(NamedTuple):
    """How the joints follow: the state topic's and the action feedback's content. `error` is desired minus actual."""

    desired: JointsState
    actual_positions: list[float]
    actual_velocities: list[float]
    error_positions: list[float]
    error_velocities: list[float]


class JointTrajectoryController:
    """Follows joint trajectories.

    Args:
        joint_names: its joints, in its order.
        settings: tolerances, stop duration and whether a command may leave joints out.
    """

    def __init__(self, joint_names: Sequence[str], settings: ArmSettings | None = None) -> None:
        settings = settings or ArmSettings()
        own = [settings.tolerances.get(name, JointTolerance()) for name in joint_names]
        self.joint_names = tuple(joint_names)
        self.tolerances = default_tolerances(
            [tolerance.trajectory for tolerance in own],
            [tolerance.goal for tolerance in own],
            settings.stopped_velocity_tolerance,
            settings.goal_time,
        )
        self.allow_partial = settings.allow_partial_joints_goal
        self.stop_duration = nanoseconds(settings.stop_trajectory_duration)
        self.goal: TrajectoryGoal | None = None
        """The last goal that was taken; it may have ended."""
        self.start([0.0] * len(self.joint_names), 0)

    # ---------------------------------------------------------------- commands

    def start(self, positions: Sequence[float], now: int) -> None:
        """Begin at `now` [ns], with every joint to stay at its position [rad or m]."""
        self._follow(Trajectory([rest(now, float(position))] for position in positions))
        self.goal = None

    def command(self, trajectory: JointTrajectory, now: int) -> None:
        """Follow a trajectory that came on the topic; one without points brings the joints to rest.

        It ends the goal that is active. No tolerances are checked.

        Raises:
            RejectedTrajectoryError: it cannot be followed; everything goes on as before.
        """
        if trajectory.points:
            checked = check_trajectory(trajectory, self.joint_names, now, allow_partial=self.allow_partial)
            self._follow(splice(self._trajectory, checked, now))
        else:
            self._stop(now)
        self._preempt("a command on the topic took its place")

    def accept(self, request: GoalRequest, now: int) -> TrajectoryGoal:
        """Follow the trajectory of a goal; one without points brings the joints to rest.

        It ends the goal that is active. Call `update` in every step while the goal is active.

        Raises:
            RejectedTrajectoryError: it cannot be followed; everything goes on as before.
        """
        names = self.joint_names
        joints = check_names(request.trajectory.joint_names, names, allow_partial=self.allow_partial)
        if not request.is_finite():
            raise RejectedTrajectoryError(GoalResult.INVALID_GOAL, "a tolerance is not a finite number")
        if request.trajectory.points:
            checked = check_trajectory(request.trajectory, names, now, allow_partial=self.allow_partial)
            self._follow(splice(self._trajectory, checked, now))
            tolerances = self.tolerances.overridden(
                names, request.path_tolerances, request.goal_tolerances, request.goal_time_tolerance_ns
            )
            goal = TrajectoryGoal(request.goal_id, names, joints, checked.start, checked.end, tolerances)
        else:
            self._stop(now)
            unchecked = (Tolerance(),) * len(names)
            goal = TrajectoryGoal(request.goal_id, names, joints, now, self.end, Tolerances(unchecked, unchecked))
        self._preempt("another goal took its place")
        self.goal = goal
        return goal

    def cancel(self, now: int) -> bool:
        """End the active goal and bring the joints to rest; whether there was an active goal."""
        if self.goal is None or not self.goal.active:
            return False
        self._stop(now)
        self._preempt("cancelled")
        return True

    def update(self, now: int, positions: Sequence[float], velocities: Sequence[float]) -> None:
        """Judge the active goal, if there is one, by where the joints are at `now` [ns].

        Args:
            now: the time [ns].
            positions: actual position of each joint [rad or m].
            velocities: actual velocity of each joint [rad/s or m/s].
        """
        goal = self.goal
        if goal is not None and goal.active:
            position_errors = [d - a for d, a in zip(self.positions(now), positions, strict=True)]
            velocity_errors = [d - a for d, a in zip(self.velocities(now), velocities, strict=True)]
            goal.update(now, position_errors, velocity_errors)

    # ---------------------------------------------------------------- what is to be done

    @property
    def end(self) -> int:
        """From this time [ns] on the joints are to rest, unless another command comes."""
        return self._trajectory.end

    def settled_at(self, time: int) -> bool:
        """Whether what is to be done stays the same from `time` [ns] on, unless another command comes."""
        return time >= self._trajectory.end

    def state(self, time: int) -> JointsState:
        """Desired positions, velocities and accelerations at `time` [ns]."""
        return self._trajectory.state(time)

    def query_state(self, time: int) -> JointsState:
        """Answer somebody's question for the desired state at `time` [ns], which may lie ahead.

        Raises:
            UsageError: the time lies before what the controller remembers.
        """
        start = self._trajectory.start
        if time < start:
            raise UsageError(f"{seconds(time):.3f} s lies before what is remembered, from {seconds(start):.3f} s on")
        return self._trajectory.state(time)

    def following(self, now: int, positions: Sequence[float], velocities: Sequence[float]) -> Following:
        """How the joints follow at `now` [ns], given their actual positions and velocities."""
        desired = self.state(now)
        return Following(
            desired,
            list(positions),
            list(velocities),
            [d - a for d, a in zip(desired.positions, positions, strict=True)],
            [d - a for d, a in zip(desired.velocities, velocities, strict=True)],
        )

    # ---------------------------------------------------------------- state

    def get_state(self) -> dict[str, Any]:
        """The trajectory and the last goal, as JSON values."""
        goal = None if self.goal is None else self.goal.get_state()
        return {"trajectory": self._trajectory.get_state(), "goal": goal}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Take over what `get_state` returned."""
        self._follow(Trajectory.from_state(state["trajectory"]))
        goal = state["goal"]
        self.goal = None if goal is None else TrajectoryGoal.from_state(goal, self.joint_names)

    def _follow(self, trajectory: Trajectory) -> None:
        self._trajectory = trajectory
        # Bound here once, because they are called in every step.
        self.positions = trajectory.positions
        self.velocities = trajectory.velocities

    def _stop(self, now: int) -> None:
        positions, velocities, _ = self.state(now)
        joints = zip(positions, velocities, strict=True)
        self._follow(Trajectory([stop(now, p, v, self.stop_duration)] for p, v in joints))

    def _preempt(self, reason: str) -> None:
        if self.goal is not None and self.goal.active:
            self.goal.preempt(reason)
