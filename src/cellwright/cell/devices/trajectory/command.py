"""A commanded joint trajectory: checked, then spliced into what the joints are doing.

The rules are those of the joint trajectory controller of ros_controllers (ROS Kinetic), plus checks for what it left
undefined: names that come twice, too few positions, numbers that are none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite

from cellwright.cell.devices.trajectory.goal import GoalResult
from cellwright.cell.devices.trajectory.trajectory import JointTrajectory, Knot, Trajectory, TrajectoryPoint, join
from cellwright.engine.clock import seconds
from cellwright.util.errors import RejectedCommandError, did_you_mean

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
    """What is left to do of a trajectory that was found good.

    Attributes:
        start: its start [ns].
        joints: for each of its joints, in its own order, the index of that joint in the controller.
        points: those of its points that lie after now.
    """

    start: int
    joints: tuple[int, ...]
    points: tuple[TrajectoryPoint, ...]

    @property
    def end(self) -> int:
        """Time of the last point [ns]."""
        return self.start + self.points[-1].time_from_start_ns


def check_count(points: Sequence[object]) -> None:
    """Refuse more points than are taken.

    Raises:
        RejectedTrajectoryError: there are more.
    """
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
        added = [join(splice_at, first, times[0], knots[0])]
        added += [join(s, a, e, b) for (s, e), (a, b) in zip(pairwise(times), pairwise(knots), strict=True)]
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
