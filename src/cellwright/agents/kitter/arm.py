"""The arm as the agent moves it: tool poses with the cup facing down, and the servos' softness made up for.

The servos hold the arm 1 to 3 mm low and leave the rail up to 4 cm short of where it is sent. Joint states tell both:
the rail is overdriven on its way and then taken as it stands, and what the other joints are off is added to their
next command.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from typing import Any

from cellwright.client import Client
from cellwright.description.layout import ARM_JOINTS
from cellwright.errors import UnreachableError
from cellwright.motion import Joints, forward, inverse, solve
from cellwright.pose import Pose

log = logging.getLogger(__name__)

RAIL, PAN = 0, 1
RAIL_END = 2.1
FACE = 0.005
"""The cup's face is this far [m] below the gripper link."""

SHOULDER_OFFSET = 0.163941
"""How far [m] the arm's plane is beside its base (d4)."""

SPEEDS = (1.3, 1.6, 1.3, 2.0, 2.5, 2.5, 2.5)
"""Largest joint speeds [m/s; rad/s] on free ways."""
ACCELERATIONS = (2.5, 3.0, 2.5, 4.0, 6.0, 6.0, 8.0)
"""Largest joint accelerations [m/s^2; rad/s^2] on free ways."""

RAIL_SHORTFALL = 0.04
"""How far [m] the rail stops short: its friction over its stiffness, less what momentum gives."""

FOLDED = 0.38
"""How far [m] the tool is in front of the base on the way from one station to another."""

FOLDED_HEIGHT = 1.12
"""Height [m] of the gripper link then: what it holds clears the beam of the rail."""

OTHER_STATION = 0.8
"""A pan [rad] that differs by more belongs to another station."""

SETTLING = 0.7
"""About how long [s] it takes to come to stand exactly."""

SAFE = 0.95
"""Height [m] of the gripper link on ways between stations."""


class Arm:
    """The arm.

    Args:
        client: whose arm.
    """

    def __init__(self, client: Client) -> None:
        self._client = client
        self._measured: list[float] = []
        self._measured_at = 0.0
        client.subscribe("/ariac/joint_states", self._take)
        client.wait_until(lambda: bool(self._measured), 1.0)
        self._commanded = list(self._measured)

    def _take(self, message: Any) -> None:
        positions = dict(zip(message.name, message.position.tolist(), strict=True))
        self._measured = [positions[name] for name in ARM_JOINTS]
        self._measured_at = self._client.time

    # ---------------------------------------------------------------- where it is

    @property
    def tool(self) -> Pose:
        """world_T_gripper, by the last joint states."""
        return forward(Joints(*self._measured))

    @property
    def tool_time(self) -> float:
        """When that was [s]."""
        return self._measured_at

    @property
    def rail(self) -> float:
        """Where the rail stands [m]."""
        return self._measured[RAIL]

    # ---------------------------------------------------------------- moving

    def reach(self, rail: float, goal: Pose, near: Sequence[float] | None = None) -> list[float] | None:
        """Joints for a tool pose with the rail where it is; None if it is out of reach.

        Of the postures the one is taken that is nearest to `near`; without it, the one with the elbow up and the hand
        reaching outwards, which all stations are worked in.
        """
        rail = max(-RAIL_END, min(RAIL_END, rail))
        try:
            if near is not None:
                return list(closest(inverse(goal, rail, near=Joints(*near)), near))
            pan = station_pan(goal.position[0], goal.position[1], rail)
            favoured = Joints(*self._commanded)._replace(shoulder_pan=pan)
            return list(solve(goal, favoured, rail=rail, accept=partial(faces, pan=pan)))
        except UnreachableError:
            return None

    def move(self, joints: Sequence[float], pace: float = 1.0) -> None:
        """Go to joint positions on the straight way in joint space, and wait until there."""
        duration = travel_time(self._commanded, joints) / pace
        self._send([joints], [duration], [[0.0] * 7])
        self._client.sleep(duration)

    def stop_rail(self) -> None:
        """Take the rail as it stands, so that nothing pulls at it."""
        self._client.sleep(0.06)
        self._commanded[RAIL] = self._measured[RAIL]

    def travel(self, goal: Pose, rail: float) -> bool:
        """Go to a tool pose above a station, with the rail at (about) `rail` [m]; False if it is out of reach.

        The rail ends within millimetres of the place, and the tool where it was sent whatever the rail did.
        """
        way = self._way(goal, rail)
        if way is None:
            return False
        if self.tool.position[2] < SAFE - 0.05:
            self.rise(SAFE)
        for joints in way:
            self.move(joints)
        self.stop_rail()
        return self.settle(goal)

    def travel_time(self, goal: Pose, rail: float) -> float:
        """How long `travel` takes [s], about; infinite if the pose is out of reach."""
        way = self._way(goal, rail)
        if way is None:
            return math.inf
        places = [self._commanded, *way]
        rising = max(0.0, SAFE - 0.05 - self.tool.position[2]) / 0.5
        return rising + SETTLING + sum(travel_time(a, b) for a, b in pairwise(places))

    def _way(self, goal: Pose, rail: float) -> list[list[float]] | None:
        """Joint positions to go through to a tool pose; None if it is out of reach."""
        rail = max(-RAIL_END, min(RAIL_END, rail))
        joints = self.reach(rail, goal)
        if joints is None:
            return None
        way = rail - self._measured[RAIL]
        joints[RAIL] = rail + math.copysign(RAIL_SHORTFALL, way) if abs(way) > 0.01 else self._commanded[RAIL]
        if abs(joints[PAN] - self._commanded[PAN]) < OTHER_STATION:
            return [joints]
        # folded, so as to pass between the posts of the frame over the bins
        return [self._folded(self._commanded), self._folded(joints), joints]

    def settle(self, goal: Pose) -> bool:
        """Correct the arm until the tool stands within a millimetre of a pose, or three times."""
        for _ in range(3):
            joints = self.reach(self._measured[RAIL], goal, near=self._commanded)
            if joints is None:
                return False
            off = [want - have for want, have in zip(joints, self._measured, strict=True)]
            if math.dist(self.tool.position, goal.position) < 0.001 and max(map(abs, off[1:])) < 0.005:
                return True
            bias = [sent - have for sent, have in zip(self._commanded, self._measured, strict=True)]
            # what the last command was off by, at most a little: it is sag and friction
            sent = [want + max(-0.03, min(0.03, each)) for want, each in zip(joints, bias, strict=True)]
            sent[RAIL] = self._measured[RAIL]
            self.move(sent)
            self._client.sleep(0.1)
        return True

    def rise(self, height: float) -> None:
        """Straight up until the gripper link is at a height [m]."""
        tool = self.tool
        if tool.position[2] < height:
            self.line([Pose((tool.position[0], tool.position[1], height), upright(tool))], [0.5])

    def line(self, goals: Sequence[Pose], speeds: Sequence[float], *, wait: bool = True) -> float:
        """Go straight through tool poses, each leg with its own speed [m/s]; the time [s] it takes.

        The rail stands still. What the joints are off now is taken to be what they will be off on the way.
        """
        start = self.tool
        bias = [sent - have for sent, have in zip(self._commanded, self._measured, strict=True)]
        points, times = [], []
        clock, near, here = 0.0, list(self._measured), start
        for goal, speed in zip(goals, speeds, strict=True):
            length = math.dist(here.position, goal.position)
            steps = max(2, math.ceil(length / 0.01))
            duration = max(length / speed, 0.05) + 0.15
            for step in range(1, steps + 1):
                share = step / steps
                pose = between(here, goal, share)
                joints = self.reach(self._measured[RAIL], pose, near=near)
                if joints is None:
                    log.info("%.1f s: %s is out of reach", self._client.time, pose.position)
                    break
                near = joints
                points.append([want + each for want, each in zip(joints, bias, strict=True)])
                times.append(clock + duration * eased(share))
            clock += duration
            here = goal
        if not points:
            return 0.0
        self._send(points, times, velocities_along(self._commanded, points, times))
        if wait:
            self._client.sleep(times[-1])
        return times[-1]

    follow_lead = 0.2
    """How long before the part is under the tool `follow` has to begin [s]: it takes 0.4 s to come up to speed."""
    follow_time = 1.9
    """How long it follows [s]."""

    def follow(self, start: Pose, near: float, press: float, speed: float) -> None:
        """Go along with something that moves along -y, and come down on it: first to a height, then slowly to another.

        Args:
            start: the tool pose that it passes under, `follow_lead` from now.
            near: height [m] to come down to as fast as it goes.
            press: height [m] to come down to slowly after that.
            speed: of what is followed [m/s].
        """
        bias = [sent - have for sent, have in zip(self._commanded, self._measured, strict=True)]
        x, y, z = start.position
        run_up, down, slow = 2 * self.follow_lead, 0.55, 0.5
        near_joints: list[float] = list(self._measured)
        points, times = [], []
        steps = round(self.follow_time / 0.05)
        for step in range(1, steps + 1):
            time = 0.05 * step
            way = speed * time**2 / (2 * run_up) if time < run_up else speed * (time - run_up / 2)
            share = min(1.0, time / down)
            height = z + (near - z) * share**2 * (3 - 2 * share)
            height += (press - near) * max(0.0, min(1.0, (time - down) / slow))
            joints = self.reach(self._measured[RAIL], Pose((x, y - way, height), start.quaternion), near=near_joints)
            if joints is None:
                break
            near_joints = joints
            points.append([want + each for want, each in zip(joints, bias, strict=True)])
            times.append(time)
        if points:
            self._send(points, times, velocities_along(self._commanded, points, times))

    def _send(
        self, points: Sequence[Sequence[float]], times: Sequence[float], velocities: Sequence[Sequence[float]]
    ) -> None:
        self._client.send_arm(points, times, velocities=velocities, joints=ARM_JOINTS)
        self._commanded = list(points[-1])

    def halt(self) -> None:
        """Stay where the arm is now."""
        self._send([list(self._measured)], [0.1], [[0.0] * 7])

    def _folded(self, joints: Sequence[float]) -> list[float]:
        """The arm drawn in, with rail, pan and wrist 3 as they are."""
        rail, pan = max(-RAIL_END, min(RAIL_END, joints[RAIL])), joints[PAN]
        cos, sin = math.cos(pan), math.sin(pan)
        x = 0.3 + FOLDED * cos - SHOULDER_OFFSET * sin
        y = rail + FOLDED * sin + SHOULDER_OFFSET * cos
        folded = self.reach(rail, Pose.from_rpy((x, y, FOLDED_HEIGHT), (0.0, 0.0, pan)))
        if folded is None:
            return list(joints)
        return [joints[RAIL], pan, *folded[2:6], joints[6]]


def faces(joints: Joints, pan: float) -> bool:
    """Whether the arm works a station the usual way: its plane turned to it by `pan` [rad], the hand reaching out."""
    return abs(joints.shoulder_pan - pan) < 0.3 and math.sin(joints.wrist_2) < 0.0


def closest(postures: Sequence[Joints], near: Sequence[float]) -> Joints:
    """The posture that differs least from joint positions; wrist 3 and the rail are left out."""
    return min(postures, key=lambda each: math.dist(each[1:6], near[1:6]))


def station_pan(x: float, y: float, rail: float) -> float:
    """The pan [rad] that turns the arm's plane to a point of the world, from -pi/4 to 7 pi/4."""
    dx, dy = x - 0.3, y - rail
    distance = max(math.hypot(dx, dy), SHOULDER_OFFSET + 0.01)
    pan = math.atan2(dy, dx) - math.asin(SHOULDER_OFFSET / distance)
    return pan + 2 * math.pi if pan < -math.pi / 4 else pan


def travel_time(start: Sequence[float], goal: Sequence[float]) -> float:
    """How long [s] a cubic from rest to rest takes without exceeding speeds and accelerations."""
    ways = [abs(b - a) for a, b in zip(start, goal, strict=True)]
    by_speed = (1.5 * way / speed for way, speed in zip(ways, SPEEDS, strict=True))
    by_acceleration = (math.sqrt(6 * way / limit) for way, limit in zip(ways, ACCELERATIONS, strict=True))
    return max(0.1, *by_speed, *by_acceleration)


def eased(share: float) -> float:
    """When a share of a way is done that begins and ends gently: time as a share of the whole."""
    return 0.5 - math.sin(math.asin(1 - 2 * share) / 3)


def velocities_along(
    start: Sequence[float], points: Sequence[Sequence[float]], times: Sequence[float]
) -> list[list[float]]:
    """Velocities at points of a way: the slope between the neighbours, rest at the end."""
    places = [list(start), *map(list, points)]
    moments = [0.0, *times]
    slopes = [
        [(after - before) / (moments[index + 1] - moments[index - 1]) for before, after in zip(a, b, strict=True)]
        for index, (a, b) in enumerate(zip(places, places[2:], strict=False), start=1)
    ]
    return [*slopes, [0.0] * len(start)]


def between(start: Pose, goal: Pose, share: float) -> Pose:
    """A tool pose on the straight way from one to another; the cup faces down, the yaw turns the short way."""
    position = [a + (b - a) * share for a, b in zip(start.position, goal.position, strict=True)]
    turn = math.remainder(goal.yaw - start.yaw, 2 * math.pi)
    return Pose.from_rpy((position[0], position[1], position[2]), (0.0, 0.0, start.yaw + turn * share))


def upright(pose: Pose) -> tuple[float, float, float, float]:
    """The quaternion of a tool pose with the cup facing straight down."""
    return Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, pose.yaw)).quaternion
