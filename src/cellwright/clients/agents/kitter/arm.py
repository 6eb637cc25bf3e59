"""Arm control of the kitter: tool poses with the cup facing down, corrected for the sag of the servos.

The servos hold the arm 1 to 3 mm low. The joints' errors in the joint states are added to the next command. The rail
has no such error.
"""

import logging
import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

from cellwright.clients.agents.kitter.clearance import (
    CLEARANCE,
    PLANNED_CLEARANCE,
    Clearance,
    Load,
    Obstacle,
    places_along,
)
from cellwright.clients.agents.kitter.motion import (
    TimedPose,
    at_height,
    facing_down,
    folded,
    following_path,
    near_posture,
    on_rail,
    side_posture,
    station_posture,
    straight_path,
    velocities_along,
)
from cellwright.clients.client import Client
from cellwright.config.arm import ARM_JOINTS
from cellwright.config.layout.layout import Belt
from cellwright.middleware.messages.conversions import NANOSECONDS, nanoseconds
from cellwright.motion import JointMotion, Joints, forward, move
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose

JOINT_STATES_TIMEOUT = 1.0  # [s]

log = logging.getLogger(__name__)

RAIL, PAN = 0, 1

CUP_FACE = 0.005
"""Distance [m] of the cup's face below the gripper link."""

OTHER_STATION = 0.8
"""Difference in pan [rad] from which two poses belong to different stations."""

SETTLING = 0.7
"""Approximate time [s] to come to an exact stop."""

SAFE_HEIGHT = 0.95
"""Height [m] of the gripper link between stations, with one of the parts of 2017 on the cup."""

SAFE_DISTANCE = 0.19
"""Distance [m] of that height from the highest surface of bins and trays, if these are higher than those of 2017."""

MAX_HEIGHT_2017 = 0.0724
"""Distance [m] that the tallest part of 2017 hangs below the cup; a taller one raises the arm by the difference."""

RISING = 0.5
"""Rising speed of the tool [m/s]."""

RAIL_CHOICES = (0.0, 0.1, -0.1, 0.2, -0.2, 0.3, -0.3, 0.4, -0.4)
"""Distances [m] of the rail from the usual place that are tried when something is in the way."""

MAX_SAG = 0.03
"""Largest error of a joint [rad] from sag alone."""


class KitterArm:
    """The arm of a cell, whose bins and trays have surfaces up to the height `highest` [m].

    Raises:
        UsageError: no joint states arrive within a second.
    """

    def __init__(self, client: Client, clearance: Clearance | None = None, highest: float = 0.0) -> None:
        self._client = client
        self._higher = max(0.0, highest + SAFE_DISTANCE - SAFE_HEIGHT)
        self._clearance = clearance
        self._states = client.joint_states
        if self._states.wait_for_next(JOINT_STATES_TIMEOUT) is None:
            raise UsageError("no joint positions: nothing is published on /ariac/joint_states; give the cell an arm")
        self._commanded = list(self.joints)
        self.load: Load | None = None
        """The part on the cup."""

    @property
    def joints(self) -> Joints:
        """Positions from the last joint states [m for the rail; rad]."""
        return Joints.of(self._client.joint_positions)

    @property
    def tool(self) -> Pose:
        """world_T_gripper from the last joint states."""
        return forward(self.joints)

    @property
    def tool_time(self) -> float:
        """Time of the last joint states [s]."""
        return nanoseconds(self._states.message.header.stamp) / NANOSECONDS

    @property
    def safe(self) -> float:
        """Height [m] of the gripper link between stations with the present load."""
        return SAFE_HEIGHT + self._extra

    @property
    def _extra(self) -> float:
        """Extra height [m] for high bins and trays, and for a tall part on the cup."""
        return self._higher + (0.0 if self.load is None else max(0.0, self.load.kind.height - MAX_HEIGHT_2017))

    def clear_rail(self, above: Pose, goal: Pose, rail: float) -> float | None:
        """Return a place of the rail [m], near `rail`, from which the tool can go from one pose down to another.

        None if one of them is out of reach, or something is in the way. The arm is in the posture of the stations.
        """
        for aside in RAIL_CHOICES:
            place = on_rail(rail + aside)
            start = station_posture(above, place, self._commanded)
            path = (
                []
                if start is None
                else [start, *self._joints_along((pose for _, pose in straight_path(above, goal, 1.0)), start)]
            )
            if path and forward(path[-1]).position[2] < goal.position[2] + 0.001:
                obstacle = self._obstacle(path, touches=True, least=PLANNED_CLEARANCE)
                if obstacle is None:
                    return place
                log.debug("%.1f s: with the rail at %.2f, %s", self._client.time, place, obstacle)
        return None

    def travel(self, goal: Pose, rail: float) -> bool:
        """Move to a tool pose above a station, with the rail at `rail` [m]; False if it is out of reach."""
        if self.tool.position[2] < self.safe - 0.05:
            self.rise(self.safe)
        for stops in self._ways(goal, rail):
            if self._move(*stops):
                return self.settle(goal)
        return False

    def travel_time(self, goal: Pose, rail: float) -> float:
        """Return the approximate duration [s] of `travel`; infinite if the pose is out of reach."""
        stops = next(self._ways(goal, rail), None)
        if stops is None:
            return math.inf
        rising = max(0.0, self.safe - 0.05 - self.tool.position[2]) / RISING
        return (
            rising
            + SETTLING
            + sum(move(Joints(*a), Joints(*b)).duration for a, b in pairwise([self._commanded, *stops]))
        )

    def reaches_sideways(self, goals: Iterable[Pose], rail: float) -> bool:
        """Return whether tool poses with the cup facing sideways are in reach, with the rail at `rail` [m].

        Nothing may be in the way there; the cup is empty.
        """
        found = [side_posture(goal, rail, self._commanded) for goal in goals]
        postures = [joints for joints in found if joints is not None]
        if len(postures) < len(found):
            return False
        return self._clearance is None or not self._clearance.obstacle(postures, touches=True, least=PLANNED_CLEARANCE)

    def can_roll(self, goal: Pose, load: Load, rail: float) -> bool:
        """Return whether the tool can roll half a turn with a load at a pose with the cup facing sideways.

        What it holds by the side may swing against the forearm.
        """
        joints = side_posture(goal, rail, self._commanded)
        if joints is None or self._clearance is None:
            return joints is not None
        return not self._clearance.obstacle(places_along([joints, _rolled(joints, math.pi)]), load)

    def turn_sideways(self, goal: Pose, rail: float) -> bool:
        """Move to a tool pose with the cup facing sideways, in one sweep; False if it is out of reach."""
        joints = side_posture(goal, rail, self._commanded)
        if joints is None:
            return False
        return self._move(joints) and self.settle(goal)

    def roll(self, angle: float) -> bool:
        """Turn the tool about the cup's axis by an angle [rad], or by its opposite within the range of the wrist.

        False if something is in the way.
        """
        return self._move(_rolled(Joints(*self._commanded), angle))

    def settle(self, goal: Pose) -> bool:
        """Correct the arm, at most three times, to within a millimetre of a pose; False if it is out of reach."""
        for _ in range(3):
            joints = near_posture(goal, self._commanded[RAIL], self._commanded)
            if joints is None:
                return False
            off = [want - have for want, have in zip(joints, self.joints, strict=True)]
            if math.dist(self.tool.position, goal.position) < 0.001 and max(map(abs, off[1:])) < 0.005:
                return True
            sags = (max(-MAX_SAG, min(MAX_SAG, each)) for each in self._sags())
            self._move([want + sag for want, sag in zip(joints, sags, strict=True)], touches=True)
            self._client.sleep(0.1)
        return True

    def rise(self, height: float) -> None:
        """Rise straight up until the gripper link is at a height [m]."""
        if self.tool.position[2] < height:
            self.line(facing_down(at_height(self.tool, height)), RISING)

    def line(self, goal: Pose, speed: float) -> bool:
        """Move straight to a tool pose at about `speed` [m/s], and wait until there; False if it did not move."""
        duration = self._follow_path(straight_path(self.tool, goal, speed))
        self._client.idle(duration)
        return duration > 0.0

    def press(self, goal: Pose, speed: float) -> None:
        """Move straight towards a tool pose inside a part at about `speed` [m/s], without waiting."""
        self._follow_path(straight_path(self.tool, goal, speed), is_checked=False)

    def follow(self, start: Pose, near: float, press: float, belt: Belt) -> None:
        """Follow something on a belt and come down on it, without waiting: see `following_path`."""
        self._follow_path(following_path(start, near, press, belt.speed, belt.direction))

    def _follow_path(self, path: Iterable[TimedPose], *, is_checked: bool = True) -> float:
        """Follow a tool path with the rail at rest, corrected for the present sag; return its duration [s].

        It is 0 if something is in the way down.
        """
        sags, near, rail = self._sags(), self.joints, self._commanded[RAIL]
        timed = list(path)
        way = self._joints_along((pose for _, pose in timed), near._replace(rail=rail))
        points = [[want + sag for want, sag in zip(joints, sags, strict=True)] for joints in way]
        times = [time for time, _ in timed[: len(points)]]
        goes_down = timed[-1][1].position[2] < self.tool.position[2]
        if not points or (is_checked and goes_down and self._is_blocked([near, *way], touches=True)):
            return 0.0
        self._send(points, times, velocities_along(self._commanded, points, times))
        return times[-1]

    def _joints_along(self, poses: Iterable[Pose], near: Joints) -> list[Joints]:
        """Return joints along tool poses with the rail at rest, from those near to others on, as far as in reach."""
        found: list[Joints] = []
        for pose in poses:
            joints = near_posture(pose, near.rail, near)
            if joints is None:
                log.info("%.1f s: %s is out of reach", self._client.time, pose.position)
                break
            found.append(near := joints)
        return found

    def _ways(self, goal: Pose, rail: float) -> Iterator[list[list[float]]]:
        """Yield joint positions to stop at on the way to a tool pose, the shortest way first; none if out of reach."""
        posture = station_posture(goal, rail, self._commanded)
        if posture is None:
            return
        joints = list(posture)
        if abs(joints[PAN] - self._commanded[PAN]) < OTHER_STATION:
            yield [joints]
        for higher in (0.0, 0.1, 0.2):
            extra = self._extra + higher
            yield [folded(self._commanded, self._commanded, extra), folded(joints, self._commanded, extra), joints]

    def _sags(self) -> list[float]:
        """Return the distance of each joint from its command [m; rad]; 0 for the rail."""
        return [0.0, *(sent - have for sent, have in zip(self._commanded[1:], self.joints[1:], strict=True))]

    def _obstacle(self, path: Sequence[Joints], *, touches: bool = False, least: float = CLEARANCE) -> Obstacle | None:
        if self._clearance is None:
            return None
        return self._clearance.obstacle(places_along(path), self.load, touches=touches, least=least)

    def _motion(self, *stops: Sequence[float]) -> JointMotion:
        """Return the motion to joint positions, with a rest at each."""
        motion = JointMotion.hold(Joints(*self._commanded), 0.0)
        for joints in stops:
            motion = motion.then(move(motion.end, Joints(*joints)))
        return motion

    def _move(self, *stops: Sequence[float], touches: bool = False) -> bool:
        """Move to joint positions, with a rest at each, and wait until there; False if something is in the way."""
        motion = self._motion(*stops)
        if self._is_blocked(motion.positions, touches=touches):
            return False
        self._client.send_arm(**motion.command())
        self._commanded = list(motion.end)
        self._client.idle(motion.duration)
        return True

    def _is_blocked(self, path: Sequence[Joints], *, touches: bool) -> bool:
        obstacle = self._obstacle(path, touches=touches)
        if obstacle is not None:
            log.info("%.1f s: not moved: %s", self._client.time, obstacle)
        return obstacle is not None

    def _send(
        self, points: Sequence[Sequence[float]], times: Sequence[float], velocities: Sequence[Sequence[float]]
    ) -> None:
        self._client.send_arm(points, times, velocities=velocities, joints=ARM_JOINTS)
        self._commanded = list(points[-1])


def _rolled(joints: Joints, angle: float) -> Joints:
    """Return joints with the tool turned by an angle [rad], or by its opposite within the range of the wrist."""
    sign = -1.0 if abs(joints.wrist_3 + angle) > abs(joints.wrist_3 - angle) else 1.0
    return joints._replace(wrist_3=joints.wrist_3 + sign * angle)
