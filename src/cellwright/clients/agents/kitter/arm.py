"""Arm control of the kitter: tool poses with the cup facing down, corrected for the sag of the servos.

The servos hold the arm 1 to 3 mm low. The joints' errors in the joint states are added to the next command. The rail
has no such error.
"""

import logging
import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

from cellwright.clients.agents.kitter.motion import (
    TimedPose,
    at_height,
    facing_down,
    folded,
    following_path,
    near_posture,
    station_posture,
    straight_path,
    travel_time,
    velocities_along,
)
from cellwright.clients.client import Client
from cellwright.config.layout import ARM_JOINTS
from cellwright.middleware.messages.conversions import NANOSECONDS, nanoseconds
from cellwright.motion import Joints, forward
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

MAX_HEIGHT_2017 = 0.0724
"""Distance [m] that the tallest part of 2017 hangs below the cup; a taller one raises the arm by the difference."""

RISING = 0.5
"""Rising speed of the tool [m/s]."""

MAX_SAG = 0.03
"""Largest error of a joint [rad] from sag alone."""


class KitterArm:
    """The arm of a cell.

    Raises:
        UsageError: no joint states arrive within a second.
    """

    def __init__(self, client: Client) -> None:
        self._client = client
        self._states = client.joint_states
        if self._states.wait_for_next(JOINT_STATES_TIMEOUT) is None:
            raise UsageError("no joint positions: nothing is published on /ariac/joint_states; give the cell an arm")
        self._commanded = list(self.joints)
        self.load_height = 0.0
        """Distance [m] that the load hangs below the cup."""

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
        """Extra height [m] for a tall part on the cup."""
        return max(0.0, self.load_height - MAX_HEIGHT_2017)

    def reaches(self, goal: Pose, rail: float) -> bool:
        """Return whether a tool pose is in reach in the posture of the stations, with the rail at `rail` [m]."""
        return station_posture(goal, rail, self._commanded) is not None

    def travel(self, goal: Pose, rail: float) -> bool:
        """Move to a tool pose above a station, with the rail at `rail` [m]; False if it is out of reach."""
        stops = self._stops(goal, rail)
        if stops is None:
            return False
        if self.tool.position[2] < self.safe - 0.05:
            self.rise(self.safe)
        for joints in stops:
            self._move(joints)
        return self.settle(goal)

    def travel_time(self, goal: Pose, rail: float) -> float:
        """Return the approximate duration [s] of `travel`; infinite if the pose is out of reach."""
        stops = self._stops(goal, rail)
        if stops is None:
            return math.inf
        rising = max(0.0, self.safe - 0.05 - self.tool.position[2]) / RISING
        return rising + SETTLING + sum(travel_time(a, b) for a, b in pairwise([self._commanded, *stops]))

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
            self._move([want + sag for want, sag in zip(joints, sags, strict=True)])
            self._client.sleep(0.1)
        return True

    def rise(self, height: float) -> None:
        """Rise straight up until the gripper link is at a height [m]."""
        if self.tool.position[2] < height:
            self.line(facing_down(at_height(self.tool, height)), RISING)

    def line(self, goal: Pose, speed: float, *, wait: bool = True) -> None:
        """Move straight to a tool pose at about `speed` [m/s]; return on arrival, or at once without `wait`."""
        duration = self._follow_path(straight_path(self.tool, goal, speed))
        if wait:
            self._client.idle(duration)

    def follow(self, start: Pose, near: float, press: float, speed: float) -> None:
        """Follow something that moves along -y and come down on it, without waiting: see `following_path`."""
        self._follow_path(following_path(start, near, press, speed))

    def _follow_path(self, path: Iterable[TimedPose]) -> float:
        """Follow a tool path with the rail at rest, corrected for the present sag; return its duration [s]."""
        sags, near, rail = self._sags(), self.joints, self._commanded[RAIL]
        points, times = [], []
        for time, pose in path:
            joints = near_posture(pose, rail, near)
            if joints is None:
                log.info("%.1f s: %s is out of reach", self._client.time, pose.position)
                break
            near = joints
            points.append([want + sag for want, sag in zip(joints, sags, strict=True)])
            times.append(time)
        if not points:
            return 0.0
        self._send(points, times, velocities_along(self._commanded, points, times))
        return times[-1]

    def _stops(self, goal: Pose, rail: float) -> list[list[float]] | None:
        """Return joint positions to stop at on the way to a tool pose; None if it is out of reach."""
        posture = station_posture(goal, rail, self._commanded)
        if posture is None:
            return None
        joints = list(posture)
        if abs(joints[PAN] - self._commanded[PAN]) < OTHER_STATION:
            return [joints]
        return [
            folded(self._commanded, self._commanded, self._extra),
            folded(joints, self._commanded, self._extra),
            joints,
        ]

    def _sags(self) -> list[float]:
        """Return the distance of each joint from its command [m; rad]; 0 for the rail."""
        return [0.0, *(sent - have for sent, have in zip(self._commanded[1:], self.joints[1:], strict=True))]

    def _move(self, joints: Sequence[float]) -> None:
        """Move to joint positions, straight in joint space, and wait until there."""
        duration = travel_time(self._commanded, joints)
        self._send([joints], [duration], [[0.0] * 7])
        self._client.idle(duration)

    def _send(
        self, points: Sequence[Sequence[float]], times: Sequence[float], velocities: Sequence[Sequence[float]]
    ) -> None:
        self._client.send_arm(points, times, velocities=velocities, joints=ARM_JOINTS)
        self._commanded = list(points[-1])
