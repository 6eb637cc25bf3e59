"""Arm control of the kitter: tool poses with the cup facing down, corrected for the sag of the servos.

The servos hold the arm 1 to 3 mm low. The joints' errors in the joint states are added to the next command. The rail
has no such error.
"""

import logging
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

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
    following_path,
    straight_path,
    velocities_along,
)
from cellwright.clients.agents.kitter.part_figures import PartFigures
from cellwright.clients.agents.kitter.postures import Heights, Knots, Postures
from cellwright.clients.client import Client
from cellwright.clients.client.arm import ClientArm
from cellwright.config.layout.layout import Belt
from cellwright.middleware.messages.conversions import NANOSECONDS, nanoseconds
from cellwright.motion.solver import Vector
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose

JOINT_STATES_TIMEOUT = 1.0  # [s]

log = logging.getLogger(__name__)

SETTLING = 0.7
"""Approximate time [s] to come to an exact stop."""

SAFE_DISTANCE = 0.19
"""Least distance [m] of the tool between stations from the highest surface of bins and trays."""

MAX_HEIGHT_2017 = 0.0724
"""Distance [m] that the tallest part of 2017 hangs below the cup; a taller one raises the arm by the difference."""

SAME_POSTURE = 1e-6
"""Distance [rad; m] up to which two postures are the same."""

RISING = 0.5
"""Rising speed of the tool [m/s]."""

MAX_SAG = 0.03
"""Largest error of a joint [rad] from sag alone."""


class Errand(NamedTuple):
    """Work of the tool at the end of a way, before it goes on: other arms keep away from there until then.

    Attributes:
        poses: poses of the tool.
        load: the load that it takes there.
        until: time [s] up to which it waits for other arms to leave the way.
    """

    poses: tuple[Pose, ...] = ()
    load: PartFigures | None = None
    until: float = math.inf


NONE = Errand()
"""Nothing but to arrive."""


class KitterArm:
    """An arm of a cell, whose bins and trays have surfaces up to the height `highest` [m].

    Args:
        client: the client.
        device: the arm's topics and services.
        postures: its postures.
        clearance: its distances to what it must not hit.
        highest: height of the highest surface [m].

    Raises:
        UsageError: no joint states arrive within a second.
    """

    is_alone = True
    """False for one of several arms."""

    def __init__(
        self,
        client: Client,
        device: ClientArm,
        postures: Postures,
        clearance: Clearance | None = None,
        highest: float = 0.0,
    ) -> None:
        self._client = client
        self._device = device
        self.postures = postures
        self._figures = postures.figures
        self._higher = max(0.0, highest + SAFE_DISTANCE - self.heights.travel)
        self._clearance = clearance
        self._states = device.joint_states
        if self._states.wait_for_next(JOINT_STATES_TIMEOUT) is None:
            raise UsageError("no joint positions: nothing is published on /ariac/joint_states; give the cell an arm")
        self._commanded = self.joints
        self._clear: dict[tuple[Pose, Pose, float, Load | None], Vector | None] = {}
        """Postures that were found clear since the last command: a place is asked for when it is chosen and used."""
        self.load: Load | None = None
        """The part on the cup."""

    @property
    def joints(self) -> Vector:
        """Positions from the last joint states [m for a rail; rad]."""
        positions = self._device.joint_positions
        return tuple(positions[name] for name in self._figures.joints)

    @property
    def heights(self) -> Heights:
        """Heights of the tool."""
        return self._figures.heights

    @property
    def tool(self) -> Pose:
        """world_T_gripper from the last joint states."""
        return self.postures.tool(self.joints)

    @property
    def tool_time(self) -> float:
        """Time of the last joint states [s]."""
        return nanoseconds(self._states.message.header.stamp) / NANOSECONDS

    @property
    def name(self) -> str:
        """Name of the link of its cup."""
        return self._figures.gripper

    def make_way(self) -> None:
        """Leave where it is if another arm waits for that; alone it stays."""

    def can_set_out(self, time: float, is_in_vain: Callable[[], bool]) -> bool:  # noqa: ARG002 - of several
        """Return whether going somewhere is not in vain; one of several arms waits with it until a time [s]."""
        return True

    def wait_until(self, condition: Callable[[], bool], timeout: float | None = None) -> bool:
        """Wait as `Client.wait_until`, and make way for other arms meanwhile."""
        return self._client.wait_until(condition, timeout)

    @property
    def is_holding(self) -> bool:
        """True if something was on the cup in the newest message."""
        return self._device.gripper_attached

    def grip(self, enable: bool) -> None:  # noqa: FBT001
        """Switch the vacuum on or off."""
        self._device.control_gripper(enable)

    @property
    def safe(self) -> float:
        """Height [m] of the gripper link between stations with the present load."""
        return self.heights.travel + self._extra

    @property
    def _extra(self) -> float:
        """Extra height [m] for high bins and trays, and for a tall part on the cup."""
        return self._higher + (0.0 if self.load is None else max(0.0, self.load.kind.height - MAX_HEIGHT_2017))

    def clear_posture(self, above: Pose, goal: Pose, rail: float) -> Vector | None:
        """Return a posture, with the rail near `rail` [m], from which the tool can go down from a pose to another.

        None if one of them is out of reach, or something is in the way. The arm is in a usual posture.
        """
        asked = above, goal, rail, self.load
        if asked not in self._clear:
            self._clear[asked] = self._find_clear(above, goal, rail)
        return self._clear[asked]

    def _find_clear(self, above: Pose, goal: Pose, rail: float) -> Vector | None:
        for place in self.postures.rails(goal, rail):
            for start in self.postures.usual(above, place, self._commanded):
                path = [start, *self._joints_along((pose for _, pose in straight_path(above, goal, 1.0)), start)]
                if self.postures.tool(path[-1]).position[2] < goal.position[2] + 0.001:
                    obstacle = self._obstacle(path, touches=True, least=PLANNED_CLEARANCE)
                    if obstacle is None:
                        return start
                    log.debug("%.1f s: with the rail at %.2f, %s", self._client.time, place, obstacle)
        return None

    def travel(self, goal: Pose, rail: float, start: Vector | None = None, errand: Errand = NONE) -> bool:
        """Move to a tool pose above a station, with the rail at `rail` [m]; False if it is out of reach.

        With `start` the arm takes that posture there. It waits while other arms are in the way, also in that of the
        errand.
        """

        def ways() -> Iterator[Sequence[Vector]]:
            if self.tool.position[2] < self.safe - 0.05:
                self._rise_first(self.safe)
            for each in self._usual(goal, rail) if start is None else self._as_chosen(goal, start, errand):
                yield from self.postures.ways(self._commanded, each, self._extra)

        return self._go(ways, errand) and self.settle(goal)

    def _usual(self, goal: Pose, rail: float) -> Iterator[Vector]:
        return self.postures.usual(goal, rail, self._commanded)

    def _as_chosen(self, goal: Pose, start: Vector, errand: Errand) -> Iterator[Vector]:
        """Yield the posture that was chosen for a pose, then others there that are as clear: they may have a way."""
        chosen = self.postures.again(goal, start, self._commanded)
        if chosen is None:
            return
        yield chosen
        for each in self._usual(goal, start[0]):
            if math.dist(each, chosen) > SAME_POSTURE:
                path = [each, *self._joints_along(errand.poses, each)]
                if len(path) > len(errand.poses) and not self._obstacle(path, touches=True, least=PLANNED_CLEARANCE):
                    yield each

    def travel_time(self, goal: Pose, rail: float) -> float:
        """Return the approximate duration [s] of `travel`; infinite if the pose is out of reach."""
        start = self._commanded
        posture = next(self.postures.usual(goal, rail, start), None)
        stops = None if posture is None else next(self.postures.ways(start, posture, self._extra), None)
        if stops is None:
            return math.inf
        rising = max(0.0, self.safe - 0.05 - self.tool.position[2]) / RISING
        return rising + SETTLING + sum(self.postures.motion(a, [b]).times[-1] for a, b in pairwise([start, *stops]))

    def reaches_sideways(self, goals: Iterable[Pose], rail: float) -> bool:
        """Return whether tool poses with the cup facing sideways are in reach, with the rail at `rail` [m].

        Nothing may be in the way there; the cup is empty.
        """
        found = [self.postures.sideways(goal, rail, self._commanded) for goal in goals]
        postures = [joints for joints in found if joints is not None]
        if len(postures) < len(found):
            return False
        return self._clearance is None or not self._clearance.obstacle(postures, touches=True, least=PLANNED_CLEARANCE)

    def can_roll(self, goal: Pose, load: Load, rail: float) -> bool:
        """Return whether the tool can roll half a turn with a load at a pose with the cup facing sideways.

        What it holds by the side may swing against the forearm.
        """
        joints = self.postures.sideways(goal, rail, self._commanded)
        if joints is None or self._clearance is None:
            return joints is not None
        path = places_along([joints, self.postures.rolled(joints, math.pi)], self._figures.steps)
        return not self._clearance.obstacle(path, load)

    def turn_sideways(self, goal: Pose, rail: float, errand: Errand = NONE) -> bool:
        """Move to a tool pose with the cup facing sideways, in one sweep; False if it is out of reach.

        It waits as for `travel`.
        """

        def ways() -> Iterator[Sequence[Vector]]:
            joints = self.postures.sideways(goal, rail, self._commanded)
            if joints is not None:
                yield [joints]

        return self._go(ways, errand) and self.settle(goal)

    def roll(self, angle: float) -> bool:
        """Turn the tool about the cup's axis by an angle [rad], or by its opposite within the range of the wrist.

        False if something is in the way.
        """
        return self._move(self.postures.rolled(self._commanded, angle))

    def settle(self, goal: Pose) -> bool:
        """Correct the arm, at most three times, to within a millimetre of a pose; False if it is out of reach."""
        for _ in range(3):
            joints = self.postures.step(goal, self._commanded)
            if joints is None:
                return False
            off = self._soft(want - have for want, have in zip(joints, self.joints, strict=True))
            if math.dist(self.tool.position, goal.position) < 0.001 and max(map(abs, off)) < 0.005:
                return True
            sags = (max(-MAX_SAG, min(MAX_SAG, each)) for each in self._sags())
            self._move([want + sag for want, sag in zip(joints, sags, strict=True)], touches=True)
            self._client.sleep(0.1)
        return True

    def rise(self, height: float) -> None:
        """Rise straight up until the gripper link is at a height [m]."""
        if self.tool.position[2] < height:
            self.line(facing_down(at_height(self.tool, height)), RISING)

    def _rise_first(self, height: float) -> None:
        """Rise at the beginning of a way."""
        self.rise(height)

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
        sags = self._sags()
        near = tuple(
            have if soft else sent
            for have, sent, soft in zip(self.joints, self._commanded, self._figures.is_soft, strict=True)
        )
        timed = list(path)
        way = self._joints_along((pose for _, pose in timed), near)
        points = [[want + sag for want, sag in zip(joints, sags, strict=True)] for joints in way]
        times = [time for time, _ in timed[: len(points)]]
        goes_down = timed[-1][1].position[2] < self.tool.position[2]
        if not points or (is_checked and goes_down and self._is_blocked([near, *way], touches=True)):
            return 0.0
        self._send(Knots(times, points, velocities_along(self._commanded, points, times)))
        return times[-1]

    def _joints_along(self, poses: Iterable[Pose], near: Vector) -> list[Vector]:
        """Return joints along tool poses with the rail at rest, from those near to others on, as far as in reach."""
        found: list[Vector] = []
        for pose in poses:
            joints = self.postures.step(pose, near)
            if joints is None:
                log.info("%.1f s: %s is out of reach", self._client.time, pose.position)
                break
            found.append(near := joints)
        return found

    def _soft(self, values: Iterable[float]) -> list[float]:
        """Return the values of the joints whose servos give way to weight, and 0 for the others."""
        return [value if soft else 0.0 for value, soft in zip(values, self._figures.is_soft, strict=True)]

    def _sags(self) -> list[float]:
        """Return the distance of each joint from its command [m; rad]; 0 for a rail."""
        return self._soft(sent - have for sent, have in zip(self._commanded, self.joints, strict=True))

    def _obstacle(
        self, path: Sequence[Sequence[float]], *, touches: bool = False, least: float = CLEARANCE
    ) -> Obstacle | None:
        if self._clearance is None:
            return None
        places = places_along(path, self._figures.steps)
        return self._clearance.obstacle(places, self.load, touches=touches, least=least)

    def _go(self, ways: Callable[[], Iterable[Sequence[Vector]]], errand: Errand) -> bool:  # noqa: ARG002 - of several
        """Move along the first of some ways from where the arm is that has nothing in it; False if none is."""
        return any(self._move(*stops) for stops in ways())

    def _move(self, *stops: Sequence[float], touches: bool = False) -> bool:
        """Move to joint positions, with a rest at each, and wait until there; False if something is in the way."""
        motion = self.postures.motion(self._commanded, stops)
        if self._is_blocked(motion.positions, touches=touches):
            return False
        # the controller begins at its own target for the time of the first knot
        kept = slice(min(1, len(motion.times) - 1), None)
        self._send(Knots(motion.times[kept], motion.positions[kept], motion.velocities[kept]))
        self._client.idle(motion.times[-1])
        return True

    def _is_blocked(self, path: Sequence[Sequence[float]], *, touches: bool) -> bool:
        obstacle = self._obstacle(path, touches=touches)
        if obstacle is not None:
            log.info("%.1f s: not moved: %s", self._client.time, obstacle)
        return obstacle is not None

    def _send(self, motion: Knots) -> None:
        times, points, velocities = motion
        self._device.send_arm(points, times, velocities=velocities, joints=self._figures.joints)
        self._commanded = tuple(points[-1])
        self._clear.clear()
