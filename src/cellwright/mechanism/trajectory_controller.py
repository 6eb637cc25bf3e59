"""Joint trajectory controller: checks and splices trajectories, follows goals, samples the desired state.

The rules are those of the joint trajectory controller of ros_controllers (ROS Kinetic). It also checks what that left
undefined: duplicate names, too few positions, numbers that are not finite. As there, limits of position and velocity
are not enforced. A device samples the controller and drives the joints.

It is sampled with `positions(time)` and `velocities(time)`, lists in the order of the joints, about 1 us each for seven
joints. From `end` on they stay constant until the next command.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, repeat
from math import isfinite
from typing import Any, NamedTuple

from cellwright.config.arm import ArmSettings, JointTolerance
from cellwright.engine.clock import nanoseconds, seconds
from cellwright.mechanism.joint_trajectory import (
    JointsState,
    JointTrajectory,
    KnotValues,
    Trajectory,
    TrajectoryPoint,
    join_segment,
    rest_segment,
    stop_segment,
)
from cellwright.mechanism.trajectory_goal import GoalRequest, GoalResult, Tolerance, Tolerances, TrajectoryGoal
from cellwright.util.errors import RejectedCommandError, UsageError, did_you_mean

MAX_POINTS = 10_000
"""Maximum number of points of a trajectory: physics stands still while one is processed."""

MAX_KEPT_SEGMENTS = 12_000
"""Maximum number of segments that a joint keeps until a new trajectory starts; delayed commands could pile up."""


class RejectedTrajectoryError(RejectedCommandError):
    """Trajectory that is not followed; `result` is the kind of fault, the text describes it."""

    def __init__(self, result: GoalResult, reason: str) -> None:
        super().__init__(reason)
        self.result = result


@dataclass(frozen=True, slots=True)
class CheckedTrajectory:
    """Remainder of a valid trajectory: the points that lie after now, from its start [ns] on.

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
    """Refuse more than `MAX_POINTS` points.

    Raises:
        RejectedTrajectoryError: there are too many.
    """
    if len(points) > MAX_POINTS:
        raise _invalid_goal(f"a trajectory may have at most {MAX_POINTS} points (got {len(points)})")


def check_names(names: Sequence[str], joint_names: Sequence[str], *, allow_partial: bool) -> tuple[int, ...]:
    """Return the index among the controller's joints for each name.

    Raises:
        RejectedTrajectoryError: a name that the controller does not have, a duplicate, or joints left out where
            `allow_partial` does not allow it.
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

    More positions than names are accepted and the last ones ignored, as in the original.

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
                f"times must increase strictly (got {seconds(a.time_from_start_ns):g} s for point {index} "
                f"and {seconds(b.time_from_start_ns):g} s for point {index + 1})"
            )
    start = now if trajectory.start_ns is None else trajectory.start_ns
    left = tuple(point for point in points if start + point.time_from_start_ns > now)
    if not left:
        late = seconds(now - start - points[-1].time_from_start_ns)
        raise RejectedTrajectoryError(
            GoalResult.OLD_HEADER_TIMESTAMP,
            f"all {len(points)} points lie in the past: the last one was due {late:g} s ago"
            if late > 0
            else f"all {len(points)} points lie in the past: the last one is due now",
        )
    return CheckedTrajectory(start, joints, left)


def splice(current: Trajectory, checked: CheckedTrajectory, now: int) -> Trajectory:
    """Return the trajectory that follows `current` until the new one starts, and then the new one.

    Each joint of the new one moves from its desired state at the new start (now, if that is past) to the first
    remaining point. Joints that are not in the new one continue their motion.

    Raises:
        RejectedTrajectoryError: the numbers are too large to compute with, or too much is left to do before it starts.
    """
    splice_at = max(now, checked.start)
    state: list[KnotValues] = [*zip(*current.state(splice_at), strict=True)]
    joints = [
        current.between(joint, now, splice_at if joint in checked.joints else current.end)
        for joint in range(len(current.joints))
    ]
    if max(map(len, joints)) > MAX_KEPT_SEGMENTS:
        raise _invalid_goal(
            f"more than {MAX_KEPT_SEGMENTS} segments are queued before the trajectory starts; start it earlier"
        )
    times = [checked.start + point.time_from_start_ns for point in checked.points]
    for joint, *knots in zip(checked.joints, *map(_knots, checked.points), strict=False):
        segments, start, knot = [*joints[joint]], splice_at, state[joint]
        for end, following in zip(times, knots, strict=True):
            segment = join_segment(start, knot, end, following)
            if not isfinite(sum(segment.coefficients)) and not all(map(isfinite, segment.coefficients)):
                raise _invalid_goal("positions, velocities or times are too large or too close to interpolate")
            segments.append(segment)
            start, knot = end, following
        joints[joint] = tuple(segments)
    return Trajectory(joints)


def _check_point(index: int, point: TrajectoryPoint, names: Sequence[str]) -> None:
    """Refuse a point with too few, too many or non-finite numbers."""
    count = len(point.positions)
    if count < len(names):
        raise _invalid_goal(f"point {index} has {count} positions for {len(names)} joints")
    for kind, values in (("velocities", point.velocities), ("accelerations", point.accelerations)):
        if len(values) not in (0, count):
            raise _invalid_goal(f"point {index} has {len(values)} {kind} for {count} positions")
    for kind, values in (
        ("position", point.positions),
        ("velocity", point.velocities),
        ("acceleration", point.accelerations),
    ):
        if isfinite(sum(values)):
            continue  # a sum is finite only if all are, and mostly if they are
        for name, value in zip(names, values, strict=False):
            if not isfinite(value):
                raise _invalid_goal(f"point {index}: {kind} of {name} must be finite (got {value})")


def _knots(point: TrajectoryPoint) -> Iterable[KnotValues]:
    """Return the knots of the joints at a point."""
    kinds = (point.positions, point.velocities, point.accelerations)
    return zip(*(map(float, values) if len(values) else repeat(None) for values in kinds), strict=False)


def _invalid_goal(reason: str) -> RejectedTrajectoryError:
    return RejectedTrajectoryError(GoalResult.INVALID_GOAL, reason)


def _invalid_joints(reason: str) -> RejectedTrajectoryError:
    return RejectedTrajectoryError(GoalResult.INVALID_JOINTS, reason)


class Following(NamedTuple):
    """Tracking state: desired state, actual positions and velocities, and desired minus actual."""

    desired: JointsState
    actual: tuple[list[float], list[float]]
    error: tuple[list[float], list[float]]


class JointTrajectoryController:
    """Controller that follows joint trajectories.

    The settings define the tolerances, the stop duration, and whether a command may leave joints out.
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
        """Last accepted goal; it may have ended."""
        self.start([0.0] * len(self.joint_names), 0)

    def start(self, positions: Sequence[float], now: int) -> None:
        """Begin at `now` [ns], with every joint at rest at its position [rad or m]."""
        self._follow(Trajectory([rest_segment(now, float(position))] for position in positions))
        self.goal = None

    def command(self, trajectory: JointTrajectory, now: int) -> None:
        """Follow a trajectory from the topic; one without points brings the joints to rest.

        It ends the active goal. Tolerances are not checked.

        Raises:
            RejectedTrajectoryError: it cannot be followed; the present motion continues.
        """
        if trajectory.points:
            checked = check_trajectory(trajectory, self.joint_names, now, allow_partial=self.allow_partial)
            self._follow(splice(self.trajectory, checked, now))
        else:
            self._stop(now)
        self._preempt("a command on the topic took its place")

    def steer(self, positions: Sequence[float], duration: int, now: int) -> None:
        """Move all joints along straight lines to `positions` [rad or m], from now [ns] on, in `duration` [ns].

        It is the motion of a `command` with this point alone, bit for bit, in half the time: nothing is checked.
        Positions are finite, one for each joint, and the duration is above 0.
        """
        current, end = self.trajectory, now + duration
        places = zip(current.positions(now), positions, strict=True)
        added = [join_segment(now, (start, None, None), end, (place, None, None)) for start, place in places]
        self._follow(Trajectory((*current.between(joint, now, now), line) for joint, line in enumerate(added)))
        self._preempt("a command took its place")

    def accept(self, request: GoalRequest, now: int) -> TrajectoryGoal:
        """Follow the trajectory of a goal; one without points brings the joints to rest.

        It ends the active goal. Call `update` in every step while the new goal is active.

        Raises:
            RejectedTrajectoryError: it cannot be followed; the present motion continues.
        """
        names = self.joint_names
        joints = check_names(request.trajectory.joint_names, names, allow_partial=self.allow_partial)
        requested = (*request.path_tolerances, *request.goal_tolerances)
        if not all(isfinite(each.position) and isfinite(each.velocity) for each in requested):
            raise _invalid_goal("tolerances must be finite")
        if request.trajectory.points:
            checked = check_trajectory(request.trajectory, names, now, allow_partial=self.allow_partial)
            self._follow(splice(self.trajectory, checked, now))
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
        """End the active goal and bring the joints to rest; return whether there was an active goal."""
        if self.goal is None or not self.goal.active:
            return False
        self.halt(now, "cancelled")
        return True

    def halt(self, now: int, reason: str) -> None:
        """Bring the joints to rest, whatever they do; an active goal ends for this reason."""
        self._stop(now)
        self._preempt(reason)

    def update(self, now: int, positions: Sequence[float], velocities: Sequence[float]) -> None:
        """Check the active goal, if any, against actual positions and velocities of the joints at `now` [ns]."""
        goal = self.goal
        if goal is not None and goal.active:
            position_errors = [d - a for d, a in zip(self.positions(now), positions, strict=True)]
            velocity_errors = [d - a for d, a in zip(self.velocities(now), velocities, strict=True)]
            goal.update(now, position_errors, velocity_errors)

    @property
    def end(self) -> int:
        """Time [ns] from which on the joints rest, unless another command comes."""
        return self.trajectory.end

    def state(self, time: int) -> JointsState:
        """Return desired positions, velocities and accelerations at `time` [ns]."""
        return self.trajectory.state(time)

    def query_state(self, time: int) -> JointsState:
        """Return the desired state at `time` [ns], which may lie ahead, for an external query.

        Raises:
            UsageError: the time lies before the stored motion.
        """
        start = self.trajectory.start
        if time < start:
            raise UsageError(
                f"time must not be before the stored motion (got {seconds(start - time):.3f} s before it); "
                "ask for a later time"
            )
        return self.trajectory.state(time)

    def following(self, now: int, positions: Sequence[float], velocities: Sequence[float]) -> Following:
        """Return the tracking state at `now` [ns], given actual positions and velocities of the joints."""
        desired = self.state(now)
        off = [d - a for d, a in zip(desired.positions, positions, strict=True)]
        slip = [d - a for d, a in zip(desired.velocities, velocities, strict=True)]
        return Following(desired, (list(positions), list(velocities)), (off, slip))

    def get_state(self) -> dict[str, Any]:
        """Return the trajectory and the last goal as JSON values."""
        goal = None if self.goal is None else self.goal.get_state()
        return {"trajectory": self.trajectory.get_state(), "goal": goal}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Restore what `get_state` returned."""
        self._follow(Trajectory.from_state(state["trajectory"]))
        goal = state["goal"]
        self.goal = None if goal is None else TrajectoryGoal.from_state(goal, self.joint_names)

    def _follow(self, trajectory: Trajectory) -> None:
        self.trajectory = trajectory
        """Desired motion; a command replaces it by another one."""
        # Bound here once, because a goal that is checked calls them in every step.
        self.positions = trajectory.positions
        self.velocities = trajectory.velocities

    def _stop(self, now: int) -> None:
        positions, velocities, _ = self.state(now)
        joints = zip(positions, velocities, strict=True)
        self._follow(Trajectory([stop_segment(now, p, v, self.stop_duration)] for p, v in joints))

    def _preempt(self, reason: str) -> None:
        if self.goal is not None and self.goal.active:
            self.goal.preempt(reason)
