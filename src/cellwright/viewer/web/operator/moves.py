"""Motion requests of browsers: dragged hands, joint and gripper sliders, and the buttons of the base.

A drag counts from the grab, and is added to the tip's pose at that moment. So the first pose is always close to the
robot, wherever the handle was. Poses are sent while the handle moves. They stop when it rests for long or is released,
and the robot's own watchdog may hold it. Whatever ends the robot's motion ends the hold, and needs a new grab.

`target_ee_poses` takes a pose for every arm. Arms without a held handle keep their target or pose, which is read once
per drag, so that nothing creeps.

A slider can jump from one end to the other. The target then walks from the measured position, and waits for a joint
that is held up. An untouched slider shows its joint's position; such a value never counts as a request.
"""

from dataclasses import dataclass

from cellwright.config.robot.config import BaseMode
from cellwright.util.pose import Pose, normalized
from cellwright.viewer.web.operator.robot_state import RobotState, SeenRobot, is_near

HAND_PERIOD = 0.02  # [s] between two poses, at least
HAND_REPEAT = 2.0  # [s] for which a held handle at rest repeats its pose: the way there may take some time
_STRAYED = 1e-3  # [m; rad]
HOLD_TIME = 1.0  # [s] after a move for which a slider does not follow its joint
JOINT_SPEED = {"rad": 1.5, "m": 0.3}  # [rad/s; m/s] at which targets walk
JOINT_LEAD = {"rad": 0.3, "m": 0.1}  # [rad; m] that a target may be ahead of its joint
JOINT_PATIENCE = 2.0  # [s] without progress, after which a joint's move ends
_MAX_STEP = 0.25  # [s]: longest step of a walk, however late the call
_MIN_PROGRESS = 1e-3  # [rad; m]
GRIPPER_PERIOD = 0.02  # [s] between two commands, at least
BUTTON_RATE = 10.0  # [Hz] of a held button; the base keeps a speed for 0.2 s
BASE_SPEED, BASE_TURN_SPEED = 0.3, 0.6  # [m/s], [rad/s]
BASE_DIRECTIONS = {
    "forward": (0.0, 1.0, 0.0),
    "back": (0.0, -1.0, 0.0),
    "left": (0.0, 0.0, 1.0),
    "right": (0.0, 0.0, -1.0),
    "turn left": (1.0, 0.0, 0.0),
    "turn right": (-1.0, 0.0, 0.0),
}
"""Turn, along x, along y: as shares of the speeds."""


@dataclass(slots=True)
class HeldHandle:
    """Handle that a browser holds.

    Attributes:
        browser: its client id.
        handle: world_T_handle at the grab.
        tip: world_T_tip to which its moves are added.
        pose: requested world_T_tip; None before the first move.
        moved: time of the last move [s].
    """

    browser: int
    handle: Pose
    tip: Pose
    pose: Pose | None = None
    moved: float = 0.0

    def follow(self, handle: Pose) -> None:
        """Request the tip pose for a handle at world_T_handle: the same translation and rotation since the grab."""
        turn = Pose(quaternion=handle.quaternion) @ Pose(quaternion=self.handle.quaternion).inverse()
        turned = turn @ Pose(quaternion=self.tip.quaternion)
        x, y, z = (
            tip + now - then
            for tip, now, then in zip(self.tip.position, handle.position, self.handle.position, strict=True)
        )
        self.pose = Pose((x, y, z), normalized(turned.quaternion))


class Hands:
    """Handles of a robot's `count` arms."""

    def __init__(self, count: int) -> None:
        self._count = count
        self.holds: dict[int, HeldHandle] = {}
        """Held handles, by arm."""
        self._kept: list[Pose | None] = [None] * count
        self._is_new = False
        self._sent = float("-inf")

    def grab(self, arm: int, browser: int, handle: Pose, state: RobotState) -> str:
        """Grab a handle at world_T_handle for a browser; return the reason if refused, else an empty text."""
        if not 0 <= arm < self._count:
            return f"unknown arm {arm}; the robot has {self._count}"
        held = self.holds.get(arm)
        if held is not None and held.browser != browser:
            return "another browser holds this hand"
        if not self.holds:
            self._kept = [None] * self._count
        # moves are added to the arm's target if the tip is there up to the servos' error, so that nothing creeps; else
        # to the tip's pose, so that nothing jumps
        aim, tip = state.aims[arm], state.tips[arm]
        self.holds[arm] = HeldHandle(browser, handle, aim if aim is not None and is_near(aim, tip) else tip)
        return ""

    def move(self, arm: int, browser: int, handle: Pose, now: float) -> bool:
        """Move a handle to world_T_handle, at `now` [s]; return False if this browser does not hold it (any more)."""
        held = self.holds.get(arm)
        if held is None or held.browser != browser:
            return False
        held.follow(handle)
        held.moved = now
        self._is_new = True
        return True

    def release(self, arm: int, browser: int) -> None:
        """Release a browser's handle."""
        held = self.holds.get(arm)
        if held is not None and held.browser == browser:
            # The other hands may stay held: this one keeps its target.
            self._kept[arm] = None
            del self.holds[arm]

    def forget(self) -> bool:
        """End all holds, also of handles not released yet; return whether there were any."""
        had = bool(self.holds)
        self.holds.clear()
        self._is_new = False
        return had

    def held(self, arm: int) -> Pose | None:
        """Requested world_T_tip of a hand whose handle is held and has moved; None for others."""
        held = self.holds.get(arm)
        return None if held is None else held.pose

    def has_strayed(self, arm: int) -> bool:
        """Return whether a held handle requests a pose away from the grab."""
        requested = self.held(arm)
        return requested is not None and not is_near(requested, self.holds[arm].tip, _STRAYED, _STRAYED)

    def due(self, state: RobotState, now: float) -> tuple[Pose, ...] | None:
        """Poses to send now, reference_T_tip of each arm; None if none are due."""
        moved = [hold for hold in self.holds.values() if hold.pose is not None]
        if not moved or now - self._sent < HAND_PERIOD:
            return None
        if not self._is_new and now - max(hold.moved for hold in moved) > HAND_REPEAT:
            return None
        self._is_new = False
        self._sent = now
        return tuple(self._target(arm, state) for arm in range(self._count))

    def _target(self, arm: int, state: RobotState) -> Pose:
        """Target of an arm, reference_T_tip."""
        world_T_reference = state.references[arm]
        requested = self.held(arm)
        if requested is not None:
            return world_T_reference.inverse() @ requested
        kept = self._kept[arm]
        if kept is None:
            kept = world_T_reference.inverse() @ (state.aims[arm] or state.tips[arm])
            self._kept[arm] = kept
        return kept


class TouchTimes:
    """Times of the last slider moves [s], by number."""

    def __init__(self) -> None:
        self.touched: dict[int, float] = {}

    def is_touched(self, slider: int, now: float) -> bool:
        """Return whether a slider keeps its requested value, and does not follow its joint."""
        return now - self.touched.get(slider, float("-inf")) < HOLD_TIME


@dataclass(slots=True)
class _Walk:
    """Target that moves at limited speed: requested position and current target [rad; m]."""

    requested: float
    target: float | None = None
    stepped: float = 0.0
    nearest: float = float("inf")
    gained: float = 0.0


class JointMoves(TouchTimes):
    """Sliders of a robot's joints."""

    def __init__(self, robot: SeenRobot) -> None:
        super().__init__()
        self._robot = robot
        self._walks: dict[int, _Walk] = {}
        self.note = ""
        """Sentence about a joint that did not reach its target; the caller reads and empties it."""

    def ask(self, joint: int, position: float, now: float) -> None:
        """Request a joint position [rad; m], clamped to its limits."""
        requested = self._robot.clamped(joint, position)
        walk = self._walks.get(joint)
        if walk is None:
            self._walks[joint] = _Walk(requested, stepped=now, gained=now)
        else:
            walk.requested, walk.nearest, walk.gained = requested, float("inf"), now
        self.touched[joint] = now

    def forget(self) -> bool:
        """End all moves; return whether there were any."""
        had = bool(self._walks)
        self._walks.clear()
        self.touched.clear()
        return had

    def give_way(self, joints: tuple[int, ...]) -> None:
        """End the moves of joints that something else moves now."""
        for joint in joints:
            self._walks.pop(joint, None)
            self.touched.pop(joint, None)

    def is_touched(self, slider: int, now: float) -> bool:
        """Return whether a slider keeps its requested value, also while its joint is on the way."""
        return slider in self._walks or super().is_touched(slider, now)

    def due(self, state: RobotState, now: float) -> dict[int, float]:
        """Targets to send now [rad; m], by joint."""
        found = {}
        for joint, walk in list(self._walks.items()):
            position = state.positions[joint]
            measured = state.targets[joint] if position is None else position
            target = self._step(walk, self._robot.joints[joint].unit, measured, now)
            if target is not None:
                found[joint] = target
            if walk.target == walk.requested:
                self._end(joint, now)
            elif now - walk.gained > JOINT_PATIENCE:
                self._end(joint, now)
                self.note = f"{self._robot.joints[joint].name} is blocked at {measured:.3f}"
        return found

    def _step(self, walk: _Walk, unit: str, measured: float, now: float) -> float | None:
        """Next target of a walk; None if it waits."""
        before = measured if walk.target is None else walk.target
        reach, lead = JOINT_SPEED[unit] * min(now - walk.stepped, _MAX_STEP), JOINT_LEAD[unit]
        target = before + min(max(walk.requested - before, -reach), reach)
        target = min(max(target, measured - lead), measured + lead)
        walk.stepped = now
        if (left := abs(walk.requested - target)) < walk.nearest - _MIN_PROGRESS or left == 0.0:
            walk.nearest, walk.gained = left, now
        if target == walk.target:
            return None
        walk.target = target
        return target

    def _end(self, joint: int, now: float) -> None:
        del self._walks[joint]
        self.touched[joint] = now


class GripperSliders(TouchTimes):
    """Sliders of a robot's `count` grippers: 0 open, 1 closed."""

    def __init__(self, count: int) -> None:
        super().__init__()
        self._count = count
        self._requested: dict[int, float] = {}
        self._is_new = False
        self._sent = float("-inf")

    def ask(self, gripper: int, closed: float, now: float) -> None:
        """Request a gripper closing, clamped to 0..1."""
        self._requested[gripper] = min(max(closed, 0.0), 1.0)
        self.touched[gripper] = now
        self._is_new = True

    def forget(self) -> bool:
        """Discard the requests; return whether one was due."""
        had, self._is_new = self._is_new, False
        self._requested.clear()
        self.touched.clear()
        return had

    def due(self, state: RobotState, now: float) -> tuple[float, ...] | None:
        """Closing of each gripper to send now; None if none is due."""
        if not self._is_new or now - self._sent < GRIPPER_PERIOD:
            return None
        self._is_new, self._sent = False, now
        return tuple(
            self._requested[each]
            if each in self._requested and self.is_touched(each, now)
            else state.gripper_targets[each]
            for each in range(self._count)
        )


def base_directions(mode: BaseMode) -> tuple[str, ...]:
    """Buttons of a base mode; the original's commands move along y only."""
    return tuple(name for name, (_, x, _) in BASE_DIRECTIONS.items() if x == 0.0 or mode is not BaseMode.ORIGINAL)


def base_command(mode: BaseMode, direction: str) -> tuple[float, ...]:
    """Command for a held button; in modes that move at once, the way until its next event."""
    turn, x, y = BASE_DIRECTIONS[direction]
    share = 1.0 if mode is BaseMode.VELOCITY else 1.0 / BUTTON_RATE
    turn, x, y = turn * BASE_TURN_SPEED * share, x * BASE_SPEED * share, y * BASE_SPEED * share
    return (turn, y) if mode is BaseMode.ORIGINAL else (turn, x, y)
