"""Joint trajectory controller: checks and splices trajectories, follows goals, samples the desired state.

The rules are those of the joint trajectory controller of ros_controllers (ROS Kinetic), plus checks for what it left
undefined: names that come twice, too few positions, numbers that are none. Limits of position and velocity are not
enforced here, as they were not there. A device samples the controller and drives the joints.

It is sampled with `positions(time)` and `velocities(time)`, lists in the order of the joints, about 1 us each for
seven joints; from `end` on they stay as they are until the next command.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite
from typing import Any, NamedTuple

from cellwright.cell.devices.joint_trajectory import (
    JointsState,
    JointTrajectory,
    Knot,
    Trajectory,
    TrajectoryPoint,
    join_segment,
    rest_segment,
    stop_segment,
)
from cellwright.cell.devices.trajectory_goal import GoalRequest, GoalResult, Tolerance, Tolerances, TrajectoryGoal
from cellwright.config.trial.trial import ArmSettings, JointTolerance
from cellwright.engine.clock import nanoseconds, seconds
from cellwright.util.errors import RejectedCommandError, UsageError, did_you_mean

MOST_POINTS = 10_000
"""Longer trajectories are refused: physics stands still while one is worked out."""

MOST_KEPT = 12_000
"""So much of what a joint is to do until a new trajectory starts is kept: commands for later could pile up for ever."""


class RejectedTrajectoryError(RejectedCommandError):
    """A trajectory that is not followed; `result` says which kind of fault it has, the text which fault."""

    def __init__(self, result: GoalResult, reason: str) -> None:
        super().__init__(reason)
        self.result = result


@dataclass(frozen=True, slots=True)
class CheckedTrajectory:
    """What is left to do of a trajectory that was found good: the points that lie after now, from its start [ns] on.

    `joints` are the controller's indices of its joints, in the order of the trajectory.
    """

    start: int
    joints: tuple[int, ...]
    points: tuple[TrajectoryPoint, ...]

    @property
    def end(self) -> int:
        """Time of the last point [ns]."""
        return self.start + self.points[-1].time_from_start_ns


def check_count(points: Sequence[object]) -> None:
    """Refuse more points than are taken, with a RejectedTrajectoryError."""
    if len(points) > MOST_POINTS:
        raise _invalid_goal(f"{len(points)} points are too many: {MOST_POINTS} are the most")


def check_names(names: Sequence[str], joint_names: Sequence[str], *, allow_partial: bool) -> tuple[int, ...]:
    """For each name its index among the controller's joints.

    Raises:
        RejectedTrajectoryError: a name that the controller does not have, one that comes twice, or joints left out
            where `allow_partial` does not allow it.
    """
    seen = set()
    for name in names:
        if name not in joint_names:
            close = did_you_mean(name, joint_names)
            raise _invalid_joints(f"unknown joint {name!r}{close} (known: {', '.join(joint_names)})")
        if name in seen:
            raise _invalid_joints(f"joint {name!r} is named more than once")
        seen.add(name)
    missing = [name for name in joint_names if name not in names]
    if missing and not (allow_partial and names):
        raise _invalid_joints(f"joints are missing: {', '.join(missing)}")
    return tuple(joint_names.index(name) for name in names)


def check_trajectory(
    trajectory: JointTrajectory, joint_names: Sequence[str], now: int, *, allow_partial: bool = False
) -> CheckedTrajectory:
    """Check a trajectory that has points, and drop the points that are not after `now` [ns].

    More positions than names are accepted and the last ones ignored, as the original did.

    Raises:
        RejectedTrajectoryError: the trajectory cannot be followed.
    """
    joints = check_names(trajectory.joint_names, joint_names, allow_partial=allow_partial)
    points = trajectory.points
    check_count(points)
    for index, point in enumerate(points):
        _check_point(index, point, trajectory.joint_names)
    for index, (a, b) in enumerate(pairwise(points)):
        if b.time_from_start_ns <= a.time_from_start_ns:
            raise _invalid_goal(
                f"times must increase strictly: point {index + 1} is at {seconds(b.time_from_start_ns):g} s, "
                f"point {index} before it at {seconds(a.time_from_start_ns):g} s"
            )
    start = now if trajectory.start_ns is None else trajectory.start_ns
    left = tuple(point for point in points if start + point.time_from_start_ns > now)
    if not left:
        late = seconds(now - start - points[-1].time_from_start_ns)
        raise RejectedTrajectoryError(
            GoalResult.OLD_HEADER_TIMESTAMP,
            f"all {len(points)} points lie in the past: the last one was due {late:g} s ago"
            if late > 0
            else f"all {len(points)} points lie in the past: the last one is due now, with no time to get there",
        )
    return CheckedTrajectory(start, joints, left)


def splice(current: Trajectory, checked: CheckedTrajectory, now: int) -> Trajectory:
    """The trajectory that follows `current` until the new one starts, and then the new one.

    Each of the new one's joints is led over from what it is to do at the start of the new one (now, if that is past)
    to the first point left. Joints that are not in the new one go on with what they are doing.

    Raises:
        RejectedTrajectoryError: the numbers are too large to compute with, or too much is to be done until it starts.
    """
    splice_at = max(now, checked.start)
    state = current.state(splice_at)
    joints = [
        current.between(joint, now, splice_at if joint in checked.joints else current.end)
        for joint in range(len(current.joints))
    ]
    if max(map(len, joints)) > MOST_KEPT:
        raise _invalid_goal(f"the joints have more than {MOST_KEPT} other segments to follow before it starts")
    times = [checked.start + point.time_from_start_ns for point in checked.points]
    for column, joint in enumerate(checked.joints):
        knots = [_knot(point, column) for point in checked.points]
        first = Knot(state.positions[joint], state.velocities[joint], state.accelerations[joint])
        added = [join_segment(splice_at, first, times[0], knots[0])]
        added += [join_segment(s, a, e, b) for (s, e), (a, b) in zip(pairwise(times), pairwise(knots), strict=True)]
        if not all(isfinite(value) for segment in added for value in segment.coefficients):
            raise _invalid_goal("positions, velocities or times are too far apart to compute with")
        joints[joint] = (*joints[joint], *added)
    return Trajectory(joints)


def _check_point(index: int, point: TrajectoryPoint, names: Sequence[str]) -> None:
    """Refuse a point whose numbers are too few, too many or none."""
    count = len(point.positions)
    if count < len(names):
        raise _invalid_goal(f"point {index} has {count} positions for {len(names)} joints")
    for what, values in (("velocities", point.velocities), ("accelerations", point.accelerations)):
        if len(values) not in (0, count):
            raise _invalid_goal(f"point {index} has {len(values)} {what} for {count} positions")
    for what, values in (
        ("position", point.positions),
        ("velocity", point.velocities),
        ("acceleration", point.accelerations),
    ):
        for name, value in zip(names, values, strict=False):
            if not isfinite(value):
                raise _invalid_goal(f"point {index} has {value} as {what} of {name}")


def _knot(point: TrajectoryPoint, column: int) -> Knot:
    velocity = float(point.velocities[column]) if len(point.velocities) else None
    acceleration = float(point.accelerations[column]) if len(point.accelerations) else None
    return Knot(float(point.positions[column]), velocity, acceleration)


def _invalid_goal(reason: str) -> RejectedTrajectoryError:
    return RejectedTrajectoryError(GoalResult.INVALID_GOAL, reason)


def _invalid_joints(reason: str) -> RejectedTrajectoryError:
    return RejectedTrajectoryError(GoalResult.INVALID_JOINTS, reason)


class Following(NamedTuple):
    """How the joints follow: what they are to do, their positions and velocities, and desired minus actual."""

    desired: JointsState
    actual: tuple[list[float], list[float]]
    error: tuple[list[float], list[float]]


class JointTrajectoryController:
    """Follows joint trajectories.

    The settings say the tolerances, how long it takes to stop, and whether a command may leave joints out.
    """

    def __init__(self, joint_names: Sequence[str], settings: ArmSettings | None = None) -> None:
        settings = settings or ArmSettings()
        own = [settings.tolerances.get(name, JointTolerance()) for name in joint_names]
        self.joint_names = tuple(joint_names)
        self.tolerances = Tolerances(
            tuple(Tolerance(each.trajectory) for each in own),
            tuple(Tolerance(each.goal, settings.stopped_velocity_tolerance) for each in own),
            nanoseconds(settings.goal_time),
        )
        self.allow_partial = settings.allow_partial_joints_goal
        self.stop_duration = nanoseconds(settings.stop_trajectory_duration)
        self.goal: TrajectoryGoal | None = None
        """The last goal that was taken; it may have ended."""
        self.start([0.0] * len(self.joint_names), 0)

    def start(self, positions: Sequence[float], now: int) -> None:
        """Begin at `now` [ns], with every joint to stay at its position [rad or m]."""
        self._follow(Trajectory([rest_segment(now, float(position))] for position in positions))
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
        asked = (*request.path_tolerances, *request.goal_tolerances)
        if not all(isfinite(each.position) and isfinite(each.velocity) for each in asked):
            raise _invalid_goal("a tolerance is not a finite number")
        if request.trajectory.points:
            checked = check_trajectory(request.trajectory, names, now, allow_partial=self.allow_partial)
            self._follow(splice(self._trajectory, checked, now))
            tolerances = self.tolerances.overridden(names, request)
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
        """Judge the active goal, if there is one, by actual positions and velocities of the joints at `now` [ns]."""
        goal = self.goal
        if goal is not None and goal.active:
            position_errors = [d - a for d, a in zip(self.positions(now), positions, strict=True)]
            velocity_errors = [d - a for d, a in zip(self.velocities(now), velocities, strict=True)]
            goal.update(now, position_errors, velocity_errors)

    @property
    def end(self) -> int:
        """From this time [ns] on the joints are to rest, unless another command comes."""
        return self._trajectory.end

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
        off = [d - a for d, a in zip(desired.positions, positions, strict=True)]
        slip = [d - a for d, a in zip(desired.velocities, velocities, strict=True)]
        return Following(desired, (list(positions), list(velocities)), (off, slip))

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
        self._follow(Trajectory([stop_segment(now, p, v, self.stop_duration)] for p, v in joints))

    def _preempt(self, reason: str) -> None:
        if self.goal is not None and self.goal.active:
            self.goal.preempt(reason)
