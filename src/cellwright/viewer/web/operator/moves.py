"""Moves that browsers ask for: dragged hands, joint and gripper sliders, and the buttons of the base.

Moves of a handle count from where it was taken hold of, and are added to where the tip then was: the first pose is
never far from the robot, however the handle stood. While it moves, poses are sent; when it rests for long, or is let go
of, none are, and the robot's own watchdog may hold it. Whatever ends the robot's motion ends the hold: one has to let
go, and take hold again.

`target_ee_poses` takes a pose for every arm. Arms that nobody holds keep the pose that they are being brought to, or
have; it is looked up once for each drag, so that nothing creeps.

A slider can be thrown from one end to the other in an instant. The target then walks from where the joint is measured
to be, and waits for a joint that is held up. A slider that nobody touches shows where its joint is; what was set that
way is never taken for a wish.
"""

from dataclasses import dataclass

from cellwright.config.robot.config import BaseMode
from cellwright.util.pose import Pose, normalized
from cellwright.viewer.web.operator.robot_state import SeenRobot, Standing, is_near

HAND_PERIOD = 0.02  # [s]; poses are sent no more often
HAND_REPEAT = 2.0  # [s] for which a handle that is held and rests is repeated: the way to its pose may take some time
_STRAYED = 1e-3  # [m; rad]


@dataclass(slots=True)
class Hold:
    """A handle in somebody's hand.

    Attributes:
        browser: whose hand.
        handle: world_T_handle where it was taken hold of.
        tip: world_T_tip that its moves are added to.
        pose: world_T_tip that is wanted; None before it has moved.
        moved: when it moved last [s].
    """

    browser: int
    handle: Pose
    tip: Pose
    pose: Pose | None = None
    moved: float = 0.0

    def follow(self, handle: Pose) -> None:
        """Want what a handle at world_T_handle means: as far, and turned by as much, as it is now."""
        turn = Pose(quaternion=handle.quaternion) @ Pose(quaternion=self.handle.quaternion).inverse()
        turned = turn @ Pose(quaternion=self.tip.quaternion)
        x, y, z = (
            tip + now - then
            for tip, now, then in zip(self.tip.position, handle.position, self.handle.position, strict=True)
        )
        self.pose = Pose((x, y, z), normalized(turned.quaternion))


class Hands:
    """The handles of a robot's arms, of which there are `count`."""

    def __init__(self, count: int) -> None:
        self._count = count
        self.holds: dict[int, Hold] = {}
        """Handles in hands, by arm."""
        self._kept: list[Pose | None] = [None] * count
        self._is_new = False
        self._sent = float("-inf")

    def grab(self, arm: int, browser: int, handle: Pose, standing: Standing) -> str:
        """A browser takes hold of a handle at world_T_handle; why it does not get it, or nothing."""
        if not 0 <= arm < self._count:
            return "there is no such arm"
        held = self.holds.get(arm)
        if held is not None and held.browser != browser:
            return "another browser holds this hand"
        if not self.holds:
            self._kept = [None] * self._count
        # moves are added to what the arm is being brought to if it is there but for the servos' error, so that nothing
        # creeps; else to where it is, so that nothing jumps
        aim, tip = standing.aims[arm], standing.tips[arm]
        self.holds[arm] = Hold(browser, handle, aim if aim is not None and is_near(aim, tip) else tip)
        return ""

    def move(self, arm: int, browser: int, handle: Pose, now: float) -> bool:
        """A handle was moved to world_T_handle, at `now` [s]; False when this browser does not hold it (any more)."""
        held = self.holds.get(arm)
        if held is None or held.browser != browser:
            return False
        held.follow(handle)
        held.moved = now
        self._is_new = True
        return True

    def release(self, arm: int, browser: int) -> None:
        """A browser lets go of a handle."""
        held = self.holds.get(arm)
        if held is not None and held.browser == browser:
            self._kept[arm] = None  # the others may be held on: it stays where it is being brought
            del self.holds[arm]

    def forget(self) -> bool:
        """All holds are over, also in hands that have not opened yet; whether there were any."""
        had = bool(self.holds)
        self.holds.clear()
        self._is_new = False
        return had

    def held(self, arm: int) -> Pose | None:
        """World_T_tip that is wanted of a hand whose handle is held and has been moved; None for others."""
        held = self.holds.get(arm)
        return None if held is None else held.pose

    def has_strayed(self, arm: int) -> bool:
        """Whether a handle that is held wants its hand elsewhere than where it was taken hold of."""
        wanted = self.held(arm)
        return wanted is not None and not is_near(wanted, self.holds[arm].tip, _STRAYED, _STRAYED)

    def due(self, standing: Standing, now: float) -> tuple[Pose, ...] | None:
        """The poses that are to be sent now, reference_T_tip of each arm; None if none are."""
        moved = [hold for hold in self.holds.values() if hold.pose is not None]
        if not moved or now - self._sent < HAND_PERIOD:
            return None
        if not self._is_new and now - max(hold.moved for hold in moved) > HAND_REPEAT:
            return None
        self._is_new = False
        self._sent = now
        return tuple(self._target(arm, standing) for arm in range(self._count))

    def _target(self, arm: int, standing: Standing) -> Pose:
        """Reference_T_tip that an arm is to go to."""
        world_T_reference = standing.references[arm]
        wanted = self.held(arm)
        if wanted is not None:
            return world_T_reference.inverse() @ wanted
        kept = self._kept[arm]
        if kept is None:
            kept = world_T_reference.inverse() @ (standing.aims[arm] or standing.tips[arm])
            self._kept[arm] = kept
        return kept


HOLD_TIME = 1.0  # [s] after it was moved for which a slider still stands where it was put


class TouchTimes:
    """When sliders were moved last [s], by number."""

    def __init__(self) -> None:
        self.touched: dict[int, float] = {}

    def is_touched(self, slider: int, now: float) -> bool:
        """Whether a slider stands where somebody wants it, and is not to follow what it moves."""
        return now - self.touched.get(slider, float("-inf")) < HOLD_TIME


JOINT_SPEED = {"rad": 1.5, "m": 0.3}  # [rad/s; m/s] at which targets walk
JOINT_LEAD = {"rad": 0.3, "m": 0.1}  # [rad; m] that a target may be ahead of its joint
JOINT_PATIENCE = 2.0  # [s] after which a joint that does not get on is given up
_MAX_STEP = 0.25  # [s]: no more than this is walked at once, however late one comes
_MIN_PROGRESS = 1e-3  # [rad; m]


@dataclass(slots=True)
class _Walk:
    """A target on its way: what is wanted, and how far it is [rad; m]."""

    wanted: float
    target: float | None = None
    stepped: float = 0.0
    nearest: float = float("inf")
    gained: float = 0.0


class JointMoves(TouchTimes):
    """The sliders of a robot's joints."""

    def __init__(self, robot: SeenRobot) -> None:
        super().__init__()
        self._robot = robot
        self._walks: dict[int, _Walk] = {}
        self.note = ""
        """What became of a joint that did not get where it should, in a sentence; to be read and emptied."""

    def ask(self, joint: int, position: float, now: float) -> None:
        """Somebody wants a joint at a position [rad; m], which is cut off at its limits."""
        wanted = self._robot.clamped(joint, position)
        walk = self._walks.get(joint)
        if walk is None:
            self._walks[joint] = _Walk(wanted, stepped=now, gained=now)
        else:
            walk.wanted, walk.nearest, walk.gained = wanted, float("inf"), now
        self.touched[joint] = now

    def forget(self) -> bool:
        """No joint goes on; whether any was on its way."""
        had = bool(self._walks)
        self._walks.clear()
        self.touched.clear()
        return had

    def give_way(self, joints: tuple[int, ...]) -> None:
        """These joints are moved by something else now."""
        for joint in joints:
            self._walks.pop(joint, None)
            self.touched.pop(joint, None)

    def is_touched(self, slider: int, now: float) -> bool:
        """Whether a slider stands where somebody wants it, also while its joint is on its way there."""
        return slider in self._walks or super().is_touched(slider, now)

    def due(self, standing: Standing, now: float) -> dict[int, float]:
        """Targets that are to be sent now [rad; m], by joint."""
        found = {}
        for joint, walk in list(self._walks.items()):
            position = standing.positions[joint]
            measured = standing.targets[joint] if position is None else position
            target = self._step(walk, self._robot.joints[joint].unit, measured, now)
            if target is not None:
                found[joint] = target
            if walk.target == walk.wanted:
                self._end(joint, now)
            elif now - walk.gained > JOINT_PATIENCE:
                self._end(joint, now)
                self.note = f"{self._robot.joints[joint].name} is held up: it stands at {measured:.3f}"
        return found

    def _step(self, walk: _Walk, unit: str, measured: float, now: float) -> float | None:
        """The next target of a walk; None if it has to wait."""
        before = measured if walk.target is None else walk.target
        reach, lead = JOINT_SPEED[unit] * min(now - walk.stepped, _MAX_STEP), JOINT_LEAD[unit]
        target = before + min(max(walk.wanted - before, -reach), reach)
        target = min(max(target, measured - lead), measured + lead)
        walk.stepped = now
        if (left := abs(walk.wanted - target)) < walk.nearest - _MIN_PROGRESS or left == 0.0:
            walk.nearest, walk.gained = left, now
        if target == walk.target:
            return None
        walk.target = target
        return target

    def _end(self, joint: int, now: float) -> None:
        del self._walks[joint]
        self.touched[joint] = now


GRIPPER_PERIOD = 0.02  # [s]; they are told no more often


class Grips(TouchTimes):
    """The sliders of a robot's grippers, of which there are `count`: 0 open, 1 closed."""

    def __init__(self, count: int) -> None:
        super().__init__()
        self._count = count
        self._wanted: dict[int, float] = {}
        self._is_new = False
        self._sent = float("-inf")

    def ask(self, gripper: int, closed: float, now: float) -> None:
        """Somebody wants a gripper to be closed so far; what is beyond 0 and 1 is cut off."""
        self._wanted[gripper] = min(max(closed, 0.0), 1.0)
        self.touched[gripper] = now
        self._is_new = True

    def forget(self) -> bool:
        """Nothing more is to be sent; whether anything was."""
        had, self._is_new = self._is_new, False
        self._wanted.clear()
        self.touched.clear()
        return had

    def due(self, standing: Standing, now: float) -> tuple[float, ...] | None:
        """How far each gripper is to be closed, if that is to be sent now."""
        if not self._is_new or now - self._sent < GRIPPER_PERIOD:
            return None
        self._is_new, self._sent = False, now
        return tuple(
            self._wanted[each]
            if each in self._wanted and self.is_touched(each, now)
            else standing.gripper_targets[each]
            for each in range(self._count)
        )


BUTTON_RATE = 10.0  # [Hz] at which a button that is held says so; the base keeps a speed for 0.2 s
BASE_SPEED, BASE_TURN_SPEED = 0.3, 0.6  # [m/s], [rad/s]

BASE_DIRECTIONS = {
    "forward": (0.0, 1.0, 0.0),
    "back": (0.0, -1.0, 0.0),
    "left": (0.0, 0.0, 1.0),
    "right": (0.0, 0.0, -1.0),
    "turn left": (1.0, 0.0, 0.0),
    "turn right": (-1.0, 0.0, 0.0),
}
"""Turn, along x, along y: as a share of the speeds."""


def base_directions(mode: BaseMode) -> tuple[str, ...]:
    """The buttons that there are; the original's commands go along y only."""
    return tuple(name for name, (_, x, _) in BASE_DIRECTIONS.items() if x == 0.0 or mode is not BaseMode.ORIGINAL)


def base_command(mode: BaseMode, direction: str) -> tuple[float, ...]:
    """The command for a button that is held; for modes that move at once, as much as is due until it says so again."""
    turn, x, y = BASE_DIRECTIONS[direction]
    share = 1.0 if mode is BaseMode.VELOCITY else 1.0 / BUTTON_RATE
    turn, x, y = turn * BASE_TURN_SPEED * share, x * BASE_SPEED * share, y * BASE_SPEED * share
    return (turn, y) if mode is BaseMode.ORIGINAL else (turn, x, y)
