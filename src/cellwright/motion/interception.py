"""Interception of a part on the belt: place and time, and the motion down to it while following it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from cellwright.motion.joint_motion import JointMotion
from cellwright.motion.joints import DEFAULT_LIMITS, Joints, JointsLike, MotionLimits
from cellwright.motion.kinematics import solve
from cellwright.motion.paths import follow
from cellwright.motion.trajectories import move, timed
from cellwright.util.errors import UnreachableError, UsageError
from cellwright.util.pose import Pose, Vector3

_SAMPLE = 0.04
_OVERSHOOT = 1.1
"""Maximum factor by which cubics between samples exceed limits that the motion itself keeps."""
_APART = 0.1
"""Distance between the places of an interception that are tried [m]."""


@dataclass(frozen=True, slots=True)
class MovingPart:
    """Part seen at a pose [m] and a time [s] that moves on evenly, with `velocity` [m/s] in the world.

    Example:
        >>> MovingPart(Pose((1.21, 2.0, 0.907)), 10.0, velocity=(0.0, -0.2, 0.0)).at(15.0).position
        (1.21, 1.0, 0.907)
    """

    world_T_part: Pose
    time: float
    velocity: Vector3

    def at(self, time: float) -> Pose:
        """Return its pose at a time [s]."""
        since = time - self.time
        x, y, z = (p + v * since for p, v in zip(self.world_T_part.position, self.velocity, strict=True))
        return Pose((x, y, z), self.world_T_part.quaternion)

    def time_at_y(self, y: float) -> float:
        """Return the time at which it passes a place along the belt [s]."""
        return self.time + (y - self.world_T_part.position[1]) / self.velocity[1]


@dataclass(frozen=True, slots=True)
class Rendezvous:
    """Phases of a motion over a moving part, and its limits.

    Attributes:
        hover: height above the grasp at which the arm waits, and to which it rises again [m].
        ramp: gaining and losing the belt's speed [s].
        descent: descending, and rising again [s].
        dwell: staying at the grasp [s].
        lead: minimum time that the arm waits above the place before it follows the part [s].
        limits: limits of the motion.
    """

    hover: float = 0.1
    ramp: float = 0.5
    descent: float = 0.5
    dwell: float = 0.6
    lead: float = 0.3
    limits: MotionLimits = DEFAULT_LIMITS

    def __post_init__(self) -> None:
        if not all(0.0 < each < math.inf for each in (self.ramp, self.descent, self.dwell)) or not self.hover >= 0.0:
            raise UsageError("ramp, descent and dwell must be positive and finite, and hover must not be negative")
        if not math.isfinite(self.lead):
            raise UsageError(f"lead must be finite (got {self.lead})")

    @property
    def before(self) -> float:
        """Time from departure to the grasp [s]."""
        return self.ramp + self.descent

    @property
    def duration(self) -> float:
        """Time from departure to rest [s]."""
        return 2.0 * (self.ramp + self.descent) + self.dwell

    def lead_time(self, since: float) -> float:
        """Return the lead of the gripper over the part, as the time [s] that the part needs to get there.

        It is positive while the gripper gains speed and negative while it loses it. The speed follows 3 u^2 - 2 u^3 of
        the belt's, so that the acceleration has no jumps. `since` is the time after departure [s].
        """
        # At u = t / ramp the gripper still lacks 1 - s(u) of the belt's speed v, where s(u) = 3 u^2 - 2 u^3. Until it
        # has it, the part gains on it by the integral of v (1 - s), that is v ramp I(u) with
        # I(u) = (1 - u) - (1/2 - u^3 + u^4 / 2): the integral of 1 - s from u to 1. The lead as a time leaves out v.
        # Losing speed is the same motion in reverse, behind the part.
        if since < self.ramp:
            return self.ramp * _lead_integral(max(0.0, since) / self.ramp)
        left = self.duration - since
        return -self.ramp * _lead_integral(max(0.0, left) / self.ramp) if left < self.ramp else 0.0

    def height(self, since: float) -> float:
        """Return the height of the gripper above its grasp [m] at a time [s] after departure, a minimum-jerk curve."""
        down = (since - self.ramp) / self.descent
        up = (self.duration - self.ramp - since) / self.descent
        return self.hover * _remaining_share(max(0.0, min(1.0, down, up)))


@dataclass(frozen=True, slots=True)
class Interception:
    """Plan to meet a moving part. Times are on the clock of the part's sighting [s].

    Attributes:
        motion: from the arm's present posture to the place above the grasp, where it waits. Then it descends to the
            part while following it, rises again and comes to rest.
        departs: time at which `motion` must begin.
        arrives: time at which the arm is above the place.
        sets_off: time at which it begins to follow the part.
        touches: time at which it is at the grasp.
        rises: time at which it leaves the grasp.
        world_T_grasp: pose of the gripper at the moment of the touch.
    """

    motion: JointMotion
    departs: float
    arrives: float
    sets_off: float
    touches: float
    rises: float
    world_T_grasp: Pose

    @property
    def ends(self) -> float:
        """Time at which the arm is at rest again [s]."""
        return self.departs + self.motion.duration


def intercept(
    part: MovingPart,
    part_T_gripper: Pose,
    near: JointsLike,
    now: float,
    *,
    window: tuple[float, float],
    rail: float | Sequence[float] | None = None,
    timing: Rendezvous | None = None,
) -> Interception:
    """Plan the earliest interception of a part within a window along the belt.

    The rail stands still while the arm follows the part.

    Args:
        part: the part to meet.
        part_T_gripper: pose of the gripper link at the grasp.
        near: present posture of the arm, at rest.
        now: present time [s], at which the arm departs.
        window: range of the part's y in the world in which the grasp is allowed [m].
        rail: allowed rail positions [m]; any by default.
        timing: phases and limits of the motion; `Rendezvous()` by default.

    Raises:
        UnreachableError: the part cannot be met; the reason is that of the last place tried.
        UsageError: the part does not move along y, or a number is not finite.
    """
    timing = timing or Rendezvous()
    if part.velocity[1] == 0.0:
        raise UsageError(f"part must move along y (got a velocity of {part.velocity} m/s)")
    if not all(map(math.isfinite, (now, part.time, *window, *part.velocity))) or not part.world_T_part.is_finite():
        raise UsageError("part, now and window must be finite")
    start = Joints.of(near)
    low, high = sorted(window)
    # Whether a place can be reached in time has no closed form, as postures change along the belt. So places are tried
    # in the order in which the part passes them; the first one that works is the earliest grasp, to within 0.1 m.
    count = max(1, math.ceil((high - low) / _APART - 1e-9))
    places = [low + (high - low) * index / count for index in range(count + 1)]
    reason = ""
    for y in sorted(places, key=part.time_at_y):
        touches = part.time_at_y(y)
        sets_off = touches - timing.before
        if sets_off - timing.lead < now:
            reason = f"it passes y {y:.2f} m too soon"
            continue
        try:
            above = solve(_gripper_at(part, part_T_gripper, sets_off, 0.0, timing), start, rail=rail)
            approach = move(start, above, timing.limits)
            if now + approach.duration + timing.lead > sets_off:
                reason = f"the arm reaches y {y:.2f} m too late"
                continue
            tracking = track(part, part_T_gripper, above, sets_off, timing)
        except UnreachableError as error:
            reason = str(error)
            continue
        wait = JointMotion.hold(above, sets_off - now - approach.duration)
        return Interception(
            motion=approach.then(wait).then(tracking),
            departs=now,
            arrives=now + approach.duration,
            sets_off=sets_off,
            touches=touches,
            rises=touches + timing.dwell,
            world_T_grasp=part.at(touches) @ part_T_gripper,
        )
    raise UnreachableError(f"the part cannot be intercepted between y {low:.2f} and {high:.2f} m: {reason}")


def track(
    part: MovingPart, part_T_gripper: Pose, start: JointsLike, sets_off: float, timing: Rendezvous | None = None
) -> JointMotion:
    """Plan the motion that descends to a moving part, stays with it, rises and comes to rest; the rail stands still.

    It serves for a part that was seen again after the arm has reached its place.

    Args:
        part: the part to meet.
        part_T_gripper: pose of the gripper link at the grasp.
        start: posture of the arm at `sets_off`, with the gripper within a few centimetres of above the part. The arm
            makes up the difference while it gains speed.
        sets_off: time [s] at which the motion begins.
        timing: phases and limits of the motion; `Rendezvous()` by default.

    Raises:
        UnreachableError: part of the path is out of reach, or the arm is not fast enough for it.
    """
    timing = timing or Rendezvous()
    begin = Joints.of(start)
    count = math.ceil(timing.duration / _SAMPLE)
    since = [timing.duration * index / count for index in range(count + 1)]
    poses = [_gripper_at(part, part_T_gripper, sets_off, each, timing) for each in since]
    reference = follow(begin, poses, begin.rail)[1:]
    # The arm may stand a little beside the first pose, after a new sighting of the part. The difference of the joints
    # fades along the minimum-jerk curve while the gripper gains speed, so that the motion still begins at rest.
    off = Joints(*(a - b for a, b in zip(begin, reference[0], strict=True)))
    knots = []
    for each, joints in zip(since, reference, strict=True):
        share = _remaining_share(min(1.0, each / timing.ramp))
        knots.append(Joints(*(q + share * d for q, d in zip(joints, off, strict=True))))
    motion = timed(since, knots)
    if (strain := motion.strain(timing.limits)) > _OVERSHOOT:
        raise UnreachableError(f"following the part takes {strain:.1f} times the motion limits")
    return motion


def _gripper_at(part: MovingPart, part_T_gripper: Pose, sets_off: float, since: float, timing: Rendezvous) -> Pose:
    """Return the target pose of the gripper a time `since` [s] after departure."""
    ahead = part.at(sets_off + since + timing.lead_time(since)) @ part_T_gripper
    x, y, z = ahead.position
    return Pose((x, y, z + timing.height(since)), ahead.quaternion)


def _remaining_share(u: float) -> float:
    """Return the remaining share of a rest-to-rest distance at a share `u` of its time: the minimum-jerk curve."""
    return 1.0 - u**3 * (10.0 - 15.0 * u + 6.0 * u**2)


def _lead_integral(u: float) -> float:
    """Return the integral of 1 - (3 u^2 - 2 u^3) from u to 1."""
    return (1.0 - u) - (0.5 - u**3 + u**4 / 2.0)
