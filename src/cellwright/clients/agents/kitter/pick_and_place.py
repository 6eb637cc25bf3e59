"""Pick and place: grasping parts in a bin or on the running belt, and putting them down on a tray."""

import logging
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from cellwright.clients.agents.kitter.arm import Errand, KitterArm
from cellwright.clients.agents.kitter.clearance import CUP_FACE, Load
from cellwright.clients.agents.kitter.motion import FOLLOW_LEAD, FOLLOW_TIME, at_height, down_to, poses_at_belt
from cellwright.clients.agents.kitter.part_figures import Catalogue, Disc, PartFigures
from cellwright.clients.agents.kitter.perception import TrackedBeltPart
from cellwright.clients.agents.kitter.workplace import FOLLOWED, BeltPlace, TrayPlace, Workplace
from cellwright.clients.client import Client
from cellwright.motion.solver import Vector
from cellwright.util.pose import Pose

log = logging.getLogger(__name__)

PICK_APPROACH_HEIGHT = 0.010
"""Distance [m] to a part down to which the cup moves at full speed."""
PRESS_DEPTH = 0.006
"""Depth [m] into the part of the cup's slow target; it stops when the part hangs on it."""
PRESS_SPEED = 0.03
"""[m/s]"""
BELT_HOVER = 0.08
"""Height [m] above its grip at which the cup waits for a part on the belt."""
BELT_RISE = 0.12
"""Height [m] above its grip to which a part is lifted off the belt."""
BELT_TIME_MARGIN = 0.5
"""Time [s] by which the arm is there before the part."""
BELT_EARLY = 1.0
"""Time [s] by which one of several arms sets out earlier than that, as others may be in its way."""
WAITING_PLACE = 0.15
"""Distance [m] along the belt, from where parts are first taken, at which the arm waits for it to bring something."""
WAITING_DISTANCE = 0.09
"""Least distance [m] of the gripper from the belt then."""
SUCTION_TIMEOUT = 0.35
"""Longest wait [s] of the cup on the part."""
CUP_SPACE = 0.042
"""Radius [m] around the cup's axis that other parts should leave free: its face, and a little more."""
LEVEL_TILT = 0.03
"""Tilt [rad] up to which a part on the cup counts as level."""
SIDE_HEIGHT = 0.062
"""Height [m] of the cup's axis above the surface at a part's side: the hand clears the surface by 10 mm."""
SIDE_RETREAT = 0.04
"""Distance [m] of the cup to the side of a part before and after it is turned over."""
TURNING_HEIGHT = 0.25
"""Height [m] above the surface at which the hand turns a part over, and itself sideways."""

DROP_HEIGHT = 0.004
"""Height [m] above the plate at which a part is released."""
PLACE_APPROACH_HEIGHT = 0.012
"""Height [m] above that place at which the arm is corrected a last time."""


@dataclass(frozen=True, slots=True)
class Held:
    """A part on the cup: its type, its pose there, and whether its other side is up."""

    type: str
    gripper_T_part: Pose
    is_turned: bool = False


class Manipulator:
    """Picks parts up and puts them down, with an arm and its gripper.

    Args:
        client: the client.
        arm: the arm.
        catalogue: figures of the part types.
        workplace: places of the cell.
    """

    def __init__(self, client: Client, arm: KitterArm, catalogue: Catalogue, workplace: Workplace) -> None:
        self._client = client
        self._arm = arm
        self._catalogue = catalogue
        self._workplace = workplace

    def from_rest(
        self,
        part_type: str,
        world_T_part: Pose,
        rail: float,
        *,
        is_turned: bool = False,
        attempt: int = 0,
        neighbours: Sequence[Disc] = (),
    ) -> Held | None:
        """Take an upright part at rest, and lift it; None if the cup did not hold it.

        The rail goes to `rail` [m] for it. At each `attempt` the cup goes to a slightly different place. It keeps off
        `neighbours`, the discs of other parts in the world, if it can: else it might hold one of them.
        """
        client, arm = self._client, self._arm
        approach = self._approach(part_type, world_T_part, rail, attempt, neighbours)
        if approach is None:
            return None
        hover, z, posture = approach
        kind = self._catalogue.figures(part_type)
        if not arm.travel(hover, rail, posture, Errand(down_to(hover, z - PRESS_DEPTH), kind)):
            return None
        arm.grip(True)
        if not arm.line(at_height(hover, z + PICK_APPROACH_HEIGHT), 0.35):
            return self._kept(None)
        arm.press(at_height(hover, z - PRESS_DEPTH), PRESS_SPEED)
        client.wait_until(
            lambda: arm.is_holding, (PICK_APPROACH_HEIGHT + PRESS_DEPTH) / PRESS_SPEED + 0.15 + SUCTION_TIMEOUT
        )
        held = None
        if arm.is_holding:
            held = self._loaded(Held(part_type, arm.tool.inverse() @ world_T_part, is_turned))
        arm.rise(max(arm.safe, z + 0.15))
        return self._kept(held)

    def given(self, part_type: str) -> Held | None:
        """Return what is on the cup before it has gripped anything, as a part of a type; None if nothing is."""
        if not self._arm.is_holding:
            return None
        kind = replace(self._catalogue.figures(part_type), grip=(0.0, 0.0))  # a task begins in the middle of the top
        return self._loaded(Held(part_type, grip_pose(kind, Pose(), 0, 0.0).inverse()))

    def is_in_reach(self, part_type: str, world_T_part: Pose, rail: float) -> bool:
        """Return whether a part at rest is in reach, and nothing in the way; arguments as for `from_rest`."""
        return self._approach(part_type, world_T_part, rail, 0) is not None

    def can_put_down(self, held: Held, world_T_part: Pose, rail: float) -> bool:
        """Return whether a held part can be put down at a pose; arguments as for `put_down`."""
        goal = self._release(held, world_T_part)
        return self._arm.clear_posture(self._above(goal), goal, rail) is not None

    def _release(self, held: Held, world_T_part: Pose) -> Pose:
        """Return the gripper's pose that brings a held part to a place, higher if the part hangs askew."""
        tilt = math.acos(max(-1.0, min(1.0, held.gripper_T_part.rotate((0.0, 0.0, 1.0))[2])))
        goal = release_pose(held, world_T_part)
        extra = max(0.0, math.sin(tilt) - LEVEL_TILT) * self._catalogue.figures(held.type).extent
        return at_height(goal, goal.position[2] + extra)

    def _above(self, goal: Pose) -> Pose:
        """Return the gripper's pose above one at which it puts a part down."""
        return at_height(goal, max(self._arm.safe, goal.position[2] + 0.05))

    def _approach(
        self, part_type: str, world_T_part: Pose, rail: float, attempt: int, neighbours: Sequence[Disc] = ()
    ) -> tuple[Pose, float, Vector] | None:
        """Return how to come to a part at rest by the first grip for which there is room; None if there is none.

        That is the gripper's pose above it, the gripper's height [m] with the cup's face on the part, and the posture
        above it. Grips at which the cup keeps off `neighbours` come first.
        """
        kind = self._catalogue.figures(part_type)

        def overlap(above: Pose) -> float:
            x, y, _ = above.position
            gaps = [math.hypot(disc.x - x, disc.y - y) - disc.radius for disc in neighbours]
            return max(0.0, CUP_SPACE - min(gaps, default=CUP_SPACE))

        grips = [
            grip_pose(replace(kind, grip=grip), world_T_part, attempt, self._arm.tool.yaw)
            for grip in (kind.grip, *kind.other_grips)
        ]
        for above in sorted(grips, key=overlap):
            z = above.position[2]
            hover = at_height(above, max(z + 0.1, self._arm.heights.hover))
            posture = self._arm.clear_posture(hover, above, rail)
            if posture is not None:
                return hover, z, posture
        return None

    def meeting_place(self, part: TrackedBeltPart) -> float | None:
        """Return a place along the belt [m] where the arm can meet a part on it; None if it comes too late."""
        belt = self._workplace.belt(part.belt.belt.name)
        if belt is None:
            return None
        along = max(belt.first, part.place(self._client.time))
        for _ in range(4):
            arrival = (
                self._client.time
                + self._arm.travel_time(self.belt_hover(part, along), self._workplace.rail_along(belt, along))
                + BELT_TIME_MARGIN
            )
            if not math.isfinite(arrival):
                return None
            along = max(belt.first, part.place(arrival))
            if along > belt.last:
                return None
        return along

    def await_belt(self, belt: BeltPlace) -> None:
        """Go to where the arm waits for a belt to bring something, if it reaches that; one of several does not."""
        own = self._workplace.belt(belt.belt.name)
        if own is None or not self._arm.is_alone:
            return
        belt = own
        x, y = belt.point(min(belt.first + WAITING_PLACE, belt.last))
        dx, dy, _ = belt.belt.direction
        height = max(self._arm.heights.waiting, belt.belt.surface + WAITING_DISTANCE)
        postures = self._arm.postures
        rail = postures.rail_at(x, y) + postures.rail_shift(dx * FOLLOWED, dy * FOLLOWED)
        self._arm.travel(Pose.from_rpy((x, y, height), (0.0, 0.0, 0.0)), rail)

    def belt_hover(self, part: TrackedBeltPart, along: float) -> Pose:
        """Return the gripper's pose from which it waits for a part at a place along the belt [m]."""
        kind = self._catalogue.figures(part.type)
        above = grip_pose(kind, part.pose(part.time_at(along)), 0, self._arm.tool.yaw)
        return at_height(above, above.position[2] + BELT_HOVER)

    def departure(self, part: TrackedBeltPart, along: float) -> float:
        """Return the time [s] at which the arm has to set out for a part at a place along its belt [m]."""
        rail = self._workplace.rail_along(part.belt, along)
        needed = self._arm.travel_time(self.belt_hover(part, along), rail) + BELT_TIME_MARGIN + BELT_EARLY
        return part.time_at(along) - needed

    def from_belt(self, part: TrackedBeltPart, along: float) -> Held | None:
        """Take a part from the running belt about where it passes a place along it [m], and lift it.

        None if that failed.
        """
        client, arm = self._client, self._arm
        hover = self.belt_hover(part, along)
        z = hover.position[2] - BELT_HOVER
        meet = part.time_at(along)
        poses = poses_at_belt(hover, z - PRESS_DEPTH, z + BELT_RISE, part.belt.belt.speed, part.belt.belt.direction)
        errand = Errand(poses, self._catalogue.figures(part.type), meet)
        if not arm.travel(hover, self._workplace.rail_along(part.belt, along), errand=errand):
            return None
        meet = part.time_at(along)
        if client.time > meet - 0.05:
            log.info("%.1f s: too late for it by %.2f s", client.time, client.time - meet)
            return None
        client.idle(max(0.0, meet - FOLLOW_LEAD - client.time))
        arm.grip(True)
        arm.follow(hover, z + PICK_APPROACH_HEIGHT / 2, z - PRESS_DEPTH, part.belt.belt)
        client.wait_until(lambda: arm.is_holding, FOLLOW_TIME)
        held = None
        if arm.is_holding:
            held = self._loaded(Held(part.type, arm.tool.inverse() @ part.pose(arm.tool_time), part.is_turned))
        arm.rise(z + BELT_RISE)
        return self._kept(held)

    def _loaded(self, held: Held) -> Held:
        self._arm.load = Load(self._catalogue.figures(held.type), held.gripper_T_part)
        return held

    def _kept(self, held: Held | None) -> Held | None:
        """Return the held part if the cup still holds it."""
        if held is not None and self._arm.is_holding:
            return held
        self.let_go()
        return None

    def put_down(
        self, held: Held, world_T_part: Pose, rail: float, on_release: Callable[[], None] = lambda: None
    ) -> bool:
        """Put a held part down at a pose, its height included, with the rail at `rail` [m], and draw back.

        `on_release` is called once the part lies there. False if it was lost on the way, or if the place is out of
        reach or something is in the way: then the part is thrown away, rather than dropped on the tray.
        """
        client, arm = self._client, self._arm
        goal = self._release(held, world_T_part)
        z = goal.position[2]
        hover = self._above(goal)
        posture = arm.clear_posture(hover, goal, rail)
        if posture is None or not arm.travel(hover, rail, posture, Errand(down_to(hover, z))):
            log.info("%.1f s: %s is out of reach", client.time, world_T_part.position)
            self.throw_away(held)
            return False
        if not arm.is_holding:
            return False
        if not arm.line(at_height(goal, z + PLACE_APPROACH_HEIGHT), 0.35):
            self.throw_away(held)
            return False
        arm.settle(at_height(goal, z + PLACE_APPROACH_HEIGHT))
        arm.line(goal, 0.1)
        client.sleep(0.1)
        was_held = arm.is_holding
        arm.grip(False)
        client.sleep(0.1)
        on_release()
        arm.rise(arm.safe)
        arm.load = None
        return was_held

    def can_turn_over(self, part_type: str, world_T_part: Pose, direction: float, rail: float) -> bool:
        """Return whether the arm reaches all poses of `turn_over`, for a part at rest at a pose."""
        kind = self._catalogue.figures(part_type)
        at_side = side_grip_pose(kind, world_T_part, direction)
        ready = beside(at_side, SIDE_RETREAT)
        load = Load(kind, at_side.inverse() @ world_T_part)
        is_reached = self._arm.reaches_sideways((raised(ready, TURNING_HEIGHT), ready, at_side), rail)
        return is_reached and self._arm.can_roll(raised(at_side, TURNING_HEIGHT), load, rail)

    def turn_over(
        self,
        part_type: str,
        world_T_part: Pose,
        direction: float,
        rail: float,
        on_release: Callable[[], None] = lambda: None,
    ) -> bool:
        """Turn a part at rest over by its side, where it stands; False if the cup did not hold it.

        The cup points in a horizontal `direction` [rad] of the world. Lifted, the part is rolled half a turn about the
        cup's axis. It is released where the hand just clears the surface, and falls the rest, about 5 cm.
        """
        client, arm = self._client, self._arm
        at_side = side_grip_pose(self._catalogue.figures(part_type), world_T_part, direction)
        ready = beside(at_side, SIDE_RETREAT)
        errand = Errand((ready, at_side, raised(at_side, TURNING_HEIGHT)), self._catalogue.figures(part_type))
        if not arm.turn_sideways(raised(ready, TURNING_HEIGHT), rail, errand) or not arm.line(ready, 0.35):
            return False
        arm.settle(ready)
        arm.grip(True)
        arm.line(beside(at_side, PICK_APPROACH_HEIGHT), 0.2)
        arm.press(beside(at_side, -PRESS_DEPTH), PRESS_SPEED)
        client.wait_until(
            lambda: arm.is_holding, (PICK_APPROACH_HEIGHT + PRESS_DEPTH) / PRESS_SPEED + 0.15 + SUCTION_TIMEOUT
        )
        was_held = arm.is_holding
        if was_held:
            arm.line(raised(at_side, TURNING_HEIGHT), 0.35)
            is_rolled = arm.roll(math.pi)
            rolled = at_side @ Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, math.pi)) if is_rolled else at_side
            arm.settle(raised(rolled, TURNING_HEIGHT))
            was_held = is_rolled and arm.is_holding
            arm.line(rolled, 0.2)
            arm.settle(rolled)
            ready = beside(rolled, SIDE_RETREAT)
        arm.grip(False)
        client.sleep(0.3)
        on_release()
        arm.line(ready, 0.2)
        arm.line(raised(ready, TURNING_HEIGHT), 0.35)
        return was_held

    def throw_away(self, held: Held) -> None:
        """Drop a held part out of the way, on the floor; where it is if no place on the floor is in reach."""
        height = self._arm.heights.waiting
        places = self._workplace.drop_places
        any(self._arm.travel(Pose.from_rpy((x, y, height), (0.0, 0.0, 0.0)), rail) for x, y, rail in places)
        self.let_go()
        self._client.sleep(0.2)
        log.info("%.1f s: dropped the %s on the floor", self._client.time, held.type)

    def let_go(self) -> None:
        """Switch the vacuum off; the cup is empty then."""
        self._arm.grip(False)
        self._arm.load = None


def grip_pose(kind: PartFigures, world_T_part: Pose, attempt: int, yaw: float) -> Pose:
    """Return the gripper's pose with the cup's face on the part, facing down, turned by `yaw` [rad].

    Attempt 0 has the best place; others are a few millimetres beside it.
    """
    aside = ((0.0, 0.0), (0.006, 0.0), (-0.006, 0.0), (0.0, 0.006), (0.0, -0.006))[attempt % 5]
    x, y, _ = world_T_part.transform((kind.grip[0] + aside[0], kind.grip[1] + aside[1], 0.0))
    return Pose.from_rpy((x, y, world_T_part.position[2] + kind.top + CUP_FACE), (0.0, 0.0, yaw))


def side_grip_pose(kind: PartFigures, world_T_part: Pose, direction: float) -> Pose:
    """Return the gripper's pose with the cup on the side of a part, pointing in a horizontal `direction` [rad]."""
    x, y, z = world_T_part.position
    reach = kind.side + CUP_FACE
    height = z - kind.below + SIDE_HEIGHT
    place = Pose.from_rpy((x - reach * math.cos(direction), y - reach * math.sin(direction), height), (0, 0, direction))
    return place @ Pose.from_rpy((0.0, 0.0, 0.0), (0.0, -math.pi / 2, 0.0))


def beside(world_T_gripper: Pose, distance: float) -> Pose:
    """Return a gripper's pose drawn back by a distance [m] along the cup's axis."""
    return world_T_gripper @ Pose((0.0, 0.0, distance))


def raised(pose: Pose, height: float) -> Pose:
    """Return a pose higher by `height` [m]."""
    return at_height(pose, pose.position[2] + height)


def release_pose(held: Held, world_T_part: Pose) -> Pose:
    """Return the gripper's pose, facing straight down, that brings a held part to a place.

    However the part hangs, its origin comes to x, y of the place and its yaw to that of the place. It hangs flat enough
    that its height can be computed as if it hung level.
    """
    flat = Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, world_T_part.yaw - held.gripper_T_part.yaw))
    dx, dy, dz = flat.rotate(held.gripper_T_part.position)
    x, y, z = world_T_part.position
    return Pose((x - dx, y - dy, z - dz), flat.quaternion)


def pose_on_tray(station: TrayPlace, kind: PartFigures, tray_T_part: Pose, drop: float = DROP_HEIGHT) -> Pose:
    """Return world_T_part of a part released just above the plate, or `drop` [m] above it."""
    x, y, _ = station.world_T_tray.transform(tray_T_part.position)
    height = station.surface + kind.below + drop
    return Pose.from_rpy((x, y, height), (0.0, 0.0, station.world_T_tray.yaw + tray_T_part.yaw))
