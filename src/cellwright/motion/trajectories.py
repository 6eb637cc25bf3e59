"""Time-optimal, jerk-limited motions: from state to state, through waypoints, along a path, and at given times.

The profiles are Ruckig's (Berscheid and Kroeger 2021). Ruckig is deterministic: the same request gives the same bits.
"""

import math
from collections.abc import Sequence
from itertools import pairwise

from ruckig import InputParameter, Result, Ruckig, RuckigError, Synchronization, Trajectory

from cellwright.motion.joint_motion import JointMotion, knot_velocities
from cellwright.motion.joints import DEFAULT_LIMITS, LIMITS, STILL, Joints, JointsLike, MotionLimits
from cellwright.util.errors import UnreachableError, UsageError

_FIDELITY = 2e-4
"""Maximum deviation [rad; m] of the cubics between the knots from the profile."""

_MAX_STEP = 0.04
"""Maximum time between knots [s]."""

_SPEEDS_AT_VIA = tuple(step / 8 for step in range(9))
"""Shares of the smooth velocity through a waypoint that are tried there."""

_SAME = 1e-9
_SLACK = 1e-6


def move(
    start: JointsLike,
    goal: JointsLike,
    limits: MotionLimits = DEFAULT_LIMITS,
    *,
    start_velocity: Joints = STILL,
    goal_velocity: Joints = STILL,
    min_duration: float = 0.0,
) -> JointMotion:
    """Return the shortest motion from one state to another.

    All joints arrive together. From rest to rest no joint turns back; the path is straight in the joints if the same
    joint is the slowest throughout.

    Args:
        start: joints at the start.
        goal: joints at the end.
        limits: limits of the motion.
        start_velocity: velocity at the start [m/s; rad/s].
        goal_velocity: velocity at the end [m/s; rad/s].
        min_duration: minimum duration [s].

    Raises:
        UnreachableError: a joint would leave its range, or leave it further than at the start.
        UsageError: a velocity is above the limits, or a number is not finite.
    """
    begin, end = Joints.of(start), Joints.of(goal)
    profile = _profile(begin, end, start_velocity, goal_velocity, limits, min_duration)
    for index, bound in enumerate(profile.position_extrema):
        reach = max(abs(bound.min), abs(bound.max))
        if reach > max(LIMITS[index], abs(begin[index])) + _SLACK or abs(end[index]) > LIMITS[index] + _SLACK:
            raise UnreachableError(
                f"{Joints._fields[index]} would go to {reach:.4f}, beyond its limit of {LIMITS[index]:.4f}"
            )
    duration = profile.duration
    if duration <= _SAME:
        return JointMotion.hold(begin, 0.0)
    count = max(2, math.ceil(duration / _step(limits)))
    times = tuple(duration * index / count for index in range(count + 1))
    samples = [profile.at_time(time) for time in times[1:-1]]
    return JointMotion(
        times,
        (begin, *(Joints(*positions) for positions, _, _ in samples), end),
        (start_velocity, *(Joints(*velocities) for _, velocities, _ in samples), goal_velocity),
    )


def through(waypoints: Sequence[JointsLike], limits: MotionLimits = DEFAULT_LIMITS) -> JointMotion:
    """Return a motion from rest at the first waypoint to rest at the last, through the others without a stop.

    No joint leaves the range between two waypoints on its path between them. A joint that turns back at a waypoint is
    at rest there; the others pass at the speed that shortens the whole. It is not the shortest motion possible, but
    never longer than with a stop at each waypoint.

    Raises:
        UnreachableError: a waypoint is outside a joint's range.
        UsageError: no waypoint, or a number is not finite.
    """
    stops: list[Joints] = []
    for waypoint in map(Joints.of, waypoints):
        if not stops or max(abs(a - b) for a, b in zip(waypoint, stops[-1], strict=True)) > _SAME:
            stops.append(waypoint)
    if not stops:
        raise UsageError("waypoints must not be empty")
    if len(stops) == 1:
        return move(stops[0], stops[0], limits)
    pieces = [move(a, b, limits) for a, b in pairwise(stops)]
    smooth = _smooth_velocities(stops, [piece.duration for piece in pieces], limits)
    speeds = [0.0] * len(stops)
    # Each waypoint in turn gets the speed that makes the motions on both its sides the shortest.
    for index in range(1, len(stops) - 1):
        best = (pieces[index - 1].duration + pieces[index].duration, speeds[index], pieces[index - 1], pieces[index])
        before = Joints(*(speeds[index - 1] * v for v in smooth[index - 1]))
        for speed in _SPEEDS_AT_VIA[1:]:
            passing = Joints(*(speed * v for v in smooth[index]))
            into = _between(stops[index - 1], stops[index], before, passing, limits)
            onward = _between(stops[index], stops[index + 1], passing, STILL, limits)
            if into is not None and onward is not None and into.duration + onward.duration < best[0] - _SAME:
                best = (into.duration + onward.duration, speed, into, onward)
        _, speeds[index], pieces[index - 1], pieces[index] = best
    whole = pieces[0]
    for piece in pieces[1:]:
        whole = whole.then(piece)
    return whole


def along(path: Sequence[JointsLike], limits: MotionLimits = DEFAULT_LIMITS) -> JointMotion:
    """Return a motion from rest to rest along a path of many joint positions, such as `straight` returns.

    The path is the cubic spline through the positions, followed by a jerk-limited profile, as fast as the joint nearest
    to its limits allows. Split a path with a corner there: a spline swings about a corner.

    Raises:
        UsageError: no position, or a number is not finite.
    """
    knots: list[Joints] = []
    marks: list[float] = []
    for joints in map(Joints.of, path):
        length = 0.0
        if knots:
            length = max(abs(a - b) / v for a, b, v in zip(joints, knots[-1], limits.velocity, strict=True))
            if length <= _SAME:
                continue
        marks.append(marks[-1] + length if marks else 0.0)
        knots.append(joints)
    if not knots:
        raise UsageError("path must not be empty")
    if len(knots) == 1:
        return JointMotion.hold(knots[0], 0.0)
    # A mark is the time [s] to a position if the slowest joint always ran at its limit. So a profile of the mark with
    # velocity 1 and with the limits below keeps the limits where the path is straight in the joints.
    curve = JointMotion(tuple(marks), tuple(knots), knot_velocities(marks, knots))
    request = InputParameter(1)
    request.target_position, request.max_velocity = [marks[-1]], [1.0]
    request.max_acceleration = [min(a / v for a, v in zip(limits.acceleration, limits.velocity, strict=True))]
    request.max_jerk = [min(j / v for j, v in zip(limits.jerk, limits.velocity, strict=True))]
    profile = _calculate(request)
    # Where the path bends, joints accelerate at a steady mark too. One factor on all times puts that right, and is
    # found on a coarser motion than the one returned.
    stretch = _needed_stretch(_timed_by_profile(curve, profile, _MAX_STEP / 8), limits)
    return _stretched(_timed_by_profile(curve, profile, min(_MAX_STEP, _step(limits)) / stretch), stretch)


def timed(times: Sequence[float], positions: Sequence[JointsLike]) -> JointMotion:
    """Return the smooth motion through given positions at given times [s], from rest to rest.

    Raises:
        UsageError: times that do not rise from 0, another number of positions, or a number that is not finite.
    """
    if len(times) != len(positions) or len(times) < 2:
        raise UsageError(
            f"times and positions must have the same length, at least 2 (got {len(times)} and {len(positions)})"
        )
    if any(not a < b for a, b in pairwise(times)):
        raise UsageError("times must rise from 0")
    knots = tuple(map(Joints.of, positions))
    return JointMotion(tuple(times), knots, knot_velocities(times, knots, STILL, STILL))


def _step(limits: MotionLimits) -> float:
    """Return the time between knots [s] for which cubics follow profiles within `_FIDELITY`.

    Where the jerk jumps by 2 j inside of a step h, the cubic through both ends is off by up to 2 j h^3 / 192.
    """
    return min(_MAX_STEP, math.cbrt(96.0 * _FIDELITY / max(limits.jerk)))


def _profile(
    start: Joints,
    goal: Joints,
    start_velocity: Joints,
    goal_velocity: Joints,
    limits: MotionLimits,
    min_duration: float,
) -> Trajectory:
    for velocity, limit in zip((*start_velocity, *goal_velocity), limits.velocity * 2, strict=True):
        if not abs(velocity) <= limit + _SLACK:
            raise UsageError(f"start and goal velocities must be within the limit of {limit} (got {velocity})")
    request = InputParameter(7)
    request.current_position, request.target_position = start, goal
    request.current_velocity, request.target_velocity = start_velocity, goal_velocity
    request.max_velocity, request.max_acceleration, request.max_jerk = limits.velocity, limits.acceleration, limits.jerk
    return _calculate(request, min_duration)


def _calculate(request: InputParameter, min_duration: float = 0.0) -> Trajectory:
    request.synchronization = Synchronization.Phase
    if min_duration > 0.0:
        request.minimum_duration = min_duration
    trajectory = Trajectory(request.degrees_of_freedom)
    try:
        result = Ruckig(request.degrees_of_freedom).calculate(request, trajectory)
    except RuckigError as error:
        raise UsageError(f"no motion keeps these limits: {error}") from error
    if result not in (Result.Working, Result.Finished):
        raise UsageError(f"no motion keeps these limits: {result.name}")
    return trajectory


def _smooth_velocities(stops: Sequence[Joints], durations: Sequence[float], limits: MotionLimits) -> list[Joints]:
    """Return velocities at the waypoints that overshoot none: the harmonic mean of those before and after, or zero."""
    velocities = [STILL]
    for index in range(1, len(stops) - 1):
        row = []
        for joint in range(7):
            before = (stops[index][joint] - stops[index - 1][joint]) / durations[index - 1]
            after = (stops[index + 1][joint] - stops[index][joint]) / durations[index]
            # A joint that turns back at the waypoint is at rest there: any velocity would carry it beyond.
            mean = 2.0 * before * after / (before + after) if before * after > 0.0 else 0.0
            # rest-to-rest durations include slow parts: passing at up to twice the mean speed is worth trying
            row.append(max(-limits.velocity[joint], min(limits.velocity[joint], 2.0 * mean)))
        velocities.append(Joints(*row))
    return [*velocities, STILL]


def _between(a: Joints, b: Joints, leaving: Joints, arriving: Joints, limits: MotionLimits) -> JointMotion | None:
    """Return the motion from a to b, or None if a joint leaves the range between the two."""
    profile = _profile(a, b, leaving, arriving, limits, 0.0)
    for joint, bound in enumerate(profile.position_extrema):
        low, high = sorted((a[joint], b[joint]))
        if bound.min < low - _SLACK or bound.max > high + _SLACK:
            return None
    return move(a, b, limits, start_velocity=leaving, goal_velocity=arriving)


def _timed_by_profile(curve: JointMotion, profile: Trajectory, step: float) -> JointMotion:
    """Return the curve with its parameter driven by a profile of one joint, with knots every `step` [s] at most."""
    count = max(8, math.ceil(profile.duration / step))
    times = tuple(profile.duration * index / count for index in range(count + 1))
    positions, velocities = [curve.start], [STILL]
    for time in times[1:-1]:
        (mark,), (speed,), _ = profile.at_time(time)
        point = curve.at(mark)
        positions.append(point.positions)
        velocities.append(Joints(*(v * speed for v in point.velocities)))
    return JointMotion(times, (*positions, curve.end), (*velocities, STILL))


def _needed_stretch(motion: JointMotion, limits: MotionLimits) -> float:
    """Return the factor by which the motion must be longer to keep the limits; below 1 if it may be shorter."""
    velocity = max(abs(v) / limit for row in motion.velocities for v, limit in zip(row, limits.velocity, strict=True))
    acceleration = jerk = 0.0
    previous = STILL
    for index, step in enumerate(b - a for a, b in pairwise(motion.times)):
        rows = zip(motion.velocities[index], motion.velocities[index + 1], strict=True)
        mean = Joints(*((after - before) / step for before, after in rows))
        acceleration = max(acceleration, *(abs(a) / m for a, m in zip(mean, limits.acceleration, strict=True)))
        changes = zip(previous, mean, limits.jerk, strict=True)
        jerk = max(jerk, *(abs(after - before) / step / limit for before, after, limit in changes))
        previous = mean
    # A motion that takes f times as long has 1/f of the velocities, 1/f^2 of the accelerations, 1/f^3 of the jerks.
    return max(velocity, math.sqrt(acceleration), math.cbrt(jerk))


def _stretched(motion: JointMotion, factor: float) -> JointMotion:
    return JointMotion(
        tuple(time * factor for time in motion.times),
        motion.positions,
        tuple(Joints(*(v / factor for v in row)) for row in motion.velocities),
    )
