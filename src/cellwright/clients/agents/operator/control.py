"""Control of one arm by a person's requests: each control period it takes one guarded step.

Steps go from the last targets, not from the measured posture: soft servos give way to the arm's weight, and a tool that
went on from there would sink. After a rest, an arm that something has moved meanwhile goes on from where it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from enum import StrEnum
from typing import Protocol, TypeAlias

from cellwright.clients.agents.operator.aids import outward_down
from cellwright.clients.agents.operator.pace import (
    JOINT_SPEED,
    SLIDE_SPEED,
    TOOL_SPEED,
    TURN_SPEED,
    Pace,
    joint_step,
    tool_distance,
    tool_step,
)
from cellwright.clients.agents.operator.requests import TOOL, JointVelocity, ToJoints, ToPose, Velocity
from cellwright.clients.agents.operator.tool_arms import OperatedArm
from cellwright.clients.policies.rotations import rotation_of
from cellwright.clients.policies.targets import solve
from cellwright.motion.paths import angle_between, between
from cellwright.util.errors import MessageError
from cellwright.util.pose import Pose, Vector3, normalized, quaternion_product

LIFE = 0.25
"""Time [s] for which a velocity holds after its message: who lets go, or is lost, moves nothing."""
SERIES = 0.5
"""Time [s] after which a pose begins another series of them."""
LEAD = 0.3
"""Largest distance of a joint's target ahead of the joint [rad; m]: something keeps it from going on."""
PATIENCE = 1.0
"""Time [s] without progress after which a pose is out of reach."""
RAIL_SLACK = 0.3
"""Distance along a rail [m] by which the tool may be ahead of the arm's base before the rail follows."""

_SAG = 0.03
"""Distance of a joint from its last target [rad; m] that is the give of its servo."""
_THERE = 1e-3
"""Distance to a goal [s at full speed] that is none."""
_MISS = 0.5
"""Largest share of a step that may be missed."""
_ALL_WAYS = 6
"""Number of joints that move a tool in all directions."""
_SPEED_SHARE = 0.7
_MAX_SHRINKS = 4
_STILL = Velocity((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

Guard: TypeAlias = Callable[[Sequence[float], Sequence[float]], str]
Motion: TypeAlias = ToPose | Velocity | ToJoints | JointVelocity


class Mode(StrEnum):
    """Activity of an arm."""

    IDLE = "idle"
    MOVING = "moving"
    HOME = "going home"
    SNAP = "going to a part"
    BLOCKED = "blocked"


class Aim(Protocol):
    """A goal that moves, such as a part on a belt."""

    def goal(self, commanded: Pose, measured: Pose) -> tuple[Pose, float] | None:
        """Return the pose for the tool now, and the greatest speed as a share; None if it is reached or gone."""
        ...


class ArmControl:
    """Control of one arm.

    Args:
        arm: the arm.
        home: posture in which it began [rad; m].
        guard: returns why a step from one posture to another is not taken; None to take all within limits.
    """

    def __init__(self, arm: OperatedArm, home: Sequence[float], guard: Guard | None = None) -> None:
        self.arm = arm
        self.mode = Mode.IDLE
        """Its activity."""
        self.why = ""
        """Reason why it does not go on; empty if it does, or rests."""
        self.is_upright = arm.can_be_upright and arm.arm is not None and arm.arm.tool.kind == "vacuum"
        """True to keep the tool pointing straight down."""
        self._home, self._guard = tuple(home), guard
        self._limits = arm.limits
        slides = _slides(arm)
        self._speeds = [
            min(_SPEED_SHARE * speed, SLIDE_SPEED if is_slide else JOINT_SPEED)
            for (_, _, speed), is_slide in zip(self._limits, slides, strict=True)
        ]
        self._pace = Pace()
        self._q = list(home)  # last targets
        self._measured = list(home)
        self._motion: Motion | None = None
        self._snap: Aim | None = None
        self._asked = 0.0
        self._slack = RAIL_SLACK
        self._drifted = (0.0, 0.0, 0.0)
        self._nearest, self._gained = math.inf, 0.0

    @property
    def aim(self) -> Pose | None:
        """Pose that the tool goes to, world_T_tool; None without one."""
        return self._motion.world_T_tool if isinstance(self._motion, ToPose) and self._snap is None else None

    @property
    def world_T_tool(self) -> Pose:
        """Commanded pose of the tool."""
        return self.arm.world_T_tool(self._q)

    @property
    def measured(self) -> Sequence[float]:
        """Newest measured positions of its joints [rad; m]."""
        return self._measured

    def take(self, motion: Motion, now: float) -> None:
        """Take a request at `now` [s].

        Raises:
            MessageError: the arm cannot do it; the request before goes on.
        """
        is_world = isinstance(motion, ToPose) or (isinstance(motion, Velocity) and motion.frame != TOOL)
        if is_world and not self.arm.has_place:
            raise MessageError(
                f"{self.arm.name}: it stands on a link that moves, so its place in the world is unknown; "
                "move its tool along the axes of the tool, or its joints"
            )
        if isinstance(motion, ToJoints | JointVelocity):
            self._check_names(motion)
        if not (isinstance(motion, ToPose) and isinstance(self._motion, ToPose) and now - self._asked < SERIES):
            self._drifted = (0.0, 0.0, 0.0)
        self._begin(Mode.MOVING)
        if isinstance(motion, ToJoints) and isinstance(self._motion, ToJoints):
            motion = ToJoints({**self._motion.positions, **motion.positions})
        self._motion, self._snap, self._asked = motion, None, now
        self._nearest, self._gained = math.inf, now

    def go_home(self) -> None:
        """Go to the posture in which it began."""
        self._begin(Mode.HOME)
        self._motion, self._snap = ToJoints(dict(zip(self.arm.joints, self._home, strict=True))), None

    def go_to(self, aim: Aim) -> None:
        """Follow a goal that moves, until it is reached."""
        self._begin(Mode.SNAP)
        self._motion, self._snap = ToPose(self.world_T_tool), aim

    def stop(self) -> None:
        """Stay where the arm is: forget what was asked, and the last targets."""
        self.rest()
        self._q = list(self._measured)

    def rest(self) -> None:
        """Stay: forget what was asked."""
        self._motion = self._snap = None
        self._pace.stop()
        self.mode, self.why = Mode.IDLE, ""

    def see(self, measured: Sequence[float]) -> None:
        """Take the measured positions of its joints [rad; m]."""
        self._measured = list(measured)

    def step(self, now: float, period: float, drift: Vector3 = (0.0, 0.0, 0.0)) -> list[float] | None:
        """Return the targets of its joints at the end of the period that begins now [rad; m]; None if it stays.

        Args:
            now: simulation time [s].
            period: length of the period [s].
            drift: velocity of what the tool is to move with [m/s].
        """
        if self._motion is None and any(drift):
            self.take(_STILL, now)
        if isinstance(self._motion, Velocity | JointVelocity) and now - self._asked >= LIFE and not any(drift):
            self.rest()
        if self._motion is None:
            return None
        if self._is_held_up():
            self._block("something keeps it from going on")
            return None
        found = self._next(self._motion, now, period, drift)
        if found is None:
            self.rest()
            return None
        return self._guarded(found, period)

    def _next(self, motion: Motion, now: float, period: float, drift: Vector3) -> list[float] | None:
        """Return the next targets, before limits and guard; None if the goal is reached."""
        match motion:
            case ToJoints():
                goal = self._clipped({**dict(zip(self.arm.joints, self._q, strict=True)), **motion.positions})
                if max(abs(a - b) for a, b in zip(goal, self._q, strict=True)) <= 1e-6:
                    return None
                return joint_step(self._q, goal, self._speeds, self._pace, period)
            case JointVelocity():
                share = self._pace.way(math.inf, period)
                ways = [motion.velocities.get(name, 0.0) for name in self.arm.joints]
                limited = (max(-top, min(top, way)) for way, top in zip(ways, self._speeds, strict=True))
                return [q + share * way for q, way in zip(self._q, limited, strict=True)]
            case Velocity():
                is_live, present = now - self._asked < LIFE, self.world_T_tool
                moved = _moved(present, motion if is_live else _STILL, self._pace, period, drift)
                return self._solved(self._raised(present, moved, period))
            case ToPose():
                return self._toward(motion.world_T_tool, now, period, drift)

    def _toward(self, goal: Pose, now: float, period: float, drift: Vector3) -> list[float] | None:
        most, present = 1.0, self.world_T_tool
        if self._snap is not None:
            found = self._snap.goal(present, self.arm.world_T_tool(self._measured))
            if found is None:
                return None
            goal, most = found
            self._motion = ToPose(goal)
        elif any(drift):
            x, y, z = (way + speed * period for way, speed in zip(self._drifted, drift, strict=True))
            self._drifted = (x, y, z)
        if any(self._drifted):
            goal = Pose(_sum(goal.position, self._drifted), goal.quaternion)
        goal = self._upright(goal)
        distance = self._distance(present, goal)
        if self._snap is None and not any(drift):
            if distance < _THERE:
                return None
            if distance < self._nearest - _THERE:
                self._nearest, self._gained = distance, now
            elif now - self._gained > PATIENCE:
                return list(self._q)  # as near as it gets
        return self._solved(tool_step(present, goal, self._pace, period, most))

    def _solved(self, world_T_tool: Pose) -> list[float]:
        """Return the positions that bring the tool to a pose close by; the present ones if that is out of reach."""
        q = list(self._q)
        if self.arm.has_rail:
            q[0] = self._rail_for(world_T_tool)
        base_T_tool = self.arm.tool.world_T_base(q).relative(world_T_tool)
        for place, value in zip(self.arm.tool.places, solve(self.arm.tool, base_T_tool, q), strict=True):
            q[place] = value
        # Where a pose is out of reach, the nearest one would be tilted. So the tool stays.
        way = self._distance(self.world_T_tool, world_T_tool)
        missed = self._distance(self.arm.world_T_tool(q), world_T_tool)
        return q if missed <= max(_MISS * way, _THERE) else list(self._q)

    def _distance(self, one: Pose, other: Pose) -> float:
        """Return the distance of two poses [s at full speed]; an arm of less than six joints cannot turn at will."""
        if len(self.arm.chain.joints) < _ALL_WAYS:
            return math.dist(one.position, other.position) / TOOL_SPEED
        return tool_distance(one, other)

    def _rail_for(self, goal: Pose) -> float:
        """Return the place on the rail for a pose of the tool [m]: it follows once the tool is far enough ahead."""
        ahead = self._ahead(goal)
        lower, upper, _ = self._limits[0]
        return min(max(self._q[0] + math.copysign(max(0.0, abs(ahead) - self._slack), ahead), lower), upper)

    def _ahead(self, world_T_tool: Pose) -> float:
        """Return the distance along the rail by which the tool is ahead of the base [m]."""
        mount = self.arm.tool.mount
        assert mount is not None  # it has a rail
        at = self.arm.tool.world_T_begin.inverse().transform(world_T_tool.position)
        return sum(a * b for a, b in zip(at, mount.joints[0].axis, strict=True)) - self._q[0]

    def _upright(self, pose: Pose) -> Pose:
        return outward_down(pose, self.arm.outward) if self.is_upright and self.arm.outward is not None else pose

    def _raised(self, present: Pose, moved: Pose, period: float) -> Pose:
        """Return a pose of the tool turned upright, as far as its speed allows in a period."""
        if not self.is_upright:
            return moved
        upright = self._upright(moved)
        turn = angle_between(present, upright)
        share = min(1.0, TURN_SPEED * period / turn) if turn > 0.0 else 1.0
        return Pose(moved.position, between(present, upright, share).quaternion)

    def _guarded(self, goal: Sequence[float], period: float) -> list[float] | None:
        """Return a step within limits of position and speed that the guard lets pass; None without one."""
        ways = [b - a for a, b in zip(self._q, self._within(goal), strict=True)]
        excess = max(abs(way) / (top * period) for way, top in zip(ways, self._speeds, strict=True))
        ways = [way / max(1.0, excess) for way in ways]
        if max(map(abs, ways)) < 1e-7:
            self._block(self.why or ("" if self._snap is not None else "out of reach"))
            return None
        refusal = ""
        for _ in range(_MAX_SHRINKS):
            after = [q + way for q, way in zip(self._q, ways, strict=True)]
            refusal = "" if self._guard is None else self._guard(self._q, after)
            if not refusal:
                self._q, self.why = after, ""
                self.mode = Mode.MOVING if self.mode is Mode.BLOCKED else self.mode
                return after
            ways = [way / 2 for way in ways]
        self._block(refusal)
        return None

    def _within(self, goal: Sequence[float]) -> list[float]:
        return [min(max(each, lower), upper) for each, (lower, upper, _) in zip(goal, self._limits, strict=True)]

    def _clipped(self, goal: dict[str, float]) -> list[float]:
        return self._within([goal[name] for name in self.arm.joints])

    def _block(self, why: str) -> None:
        self._pace.stop()
        self.why = why
        if why:
            self.mode = Mode.BLOCKED
            if isinstance(self._motion, ToJoints):  # a way home does not go on on its own
                self._motion = None

    def _is_held_up(self) -> bool:
        return any(abs(a - b) > LEAD for a, b in zip(self._q, self._measured, strict=True))

    def _begin(self, mode: Mode) -> None:
        """Begin a motion: from the last targets if the arm is there, else from where it is."""
        if self._motion is None:
            if any(abs(a - b) > _SAG for a, b in zip(self._q, self._measured, strict=True)):
                self._q = list(self._measured)
            if self.arm.has_rail:
                self._slack = max(RAIL_SLACK, abs(self._ahead(self.world_T_tool)))
        self.mode, self.why = mode, ""

    def _check_names(self, motion: ToJoints | JointVelocity) -> None:
        names = motion.positions if isinstance(motion, ToJoints) else motion.velocities
        unknown = [name for name in names if name not in self.arm.joints]
        if unknown:
            raise MessageError(
                f"joints: {self.arm.name} has none of the name {unknown[0]:.40}; give some of "
                f"{', '.join(self.arm.joints)}"
            )


def _moved(present: Pose, velocity: Velocity, pace: Pace, period: float, drift: Vector3) -> Pose:
    """Return the pose of a tool after a period at a velocity, which is limited, with what it moves with."""
    time = pace.way(math.inf, period)
    dx, dy, dz = (time * each for each in _limited(velocity.linear, TOOL_SPEED))
    turn = rotation_of([time * each for each in _limited(velocity.angular, TURN_SPEED)], "axis_angle")
    with_it = (drift[0] * period, drift[1] * period, drift[2] * period)
    if velocity.frame == TOOL:
        moved = present @ Pose((dx, dy, dz), turn)
        return Pose(_sum(moved.position, with_it), normalized(moved.quaternion))
    turned = normalized(quaternion_product(turn, present.quaternion))
    return Pose(_sum(_sum(present.position, (dx, dy, dz)), with_it), turned)


def _limited(vector: Vector3, most: float) -> Vector3:
    """Return a vector that is no longer than `most`."""
    length = math.hypot(*vector)
    share = 1.0 if length <= most else most / length
    return (share * vector[0], share * vector[1], share * vector[2])


def _sum(one: Vector3, other: Vector3) -> Vector3:
    return (one[0] + other[0], one[1] + other[1], one[2] + other[2])


def _slides(arm: OperatedArm) -> list[bool]:
    carriers = () if arm.tool.mount is None else arm.tool.mount.joints
    return [joint.is_prismatic for joint in (*carriers, *arm.chain.joints)]
