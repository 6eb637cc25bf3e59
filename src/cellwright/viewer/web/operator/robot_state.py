"""Robot state as its panel reports it, whether hands reach their targets, and the command delay."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from enum import Enum
from statistics import median
from typing import Any

import numpy as np

from cellwright.util.errors import MessageError
from cellwright.util.pose import Pose, normalized

FULL_TURN = 2.0 * math.pi
ROOM = 1.0
"""Range here [m] of a prismatic joint without limits; of a continuous one, `FULL_TURN` [rad]."""
_MIN_LENGTH = 1e-6  # a quaternion shorter than this has no direction
_NEAR, _NEAR_ROTATION = 0.005, 0.03  # [m], [rad] of deviation at which a tip has reached its pose
REST_DURATION = 0.4
"""Time [s] of the robot that a tip must rest short of its pose before that is reported."""
_STILL = 0.002  # [m] and [rad] that a tip may move meanwhile
MAX_DELAY = 2.0
"""Time [s] after which a robot at rest is not expected to move any more."""
_MOVED, _TURNED = 5e-4, 2e-3  # [m], [rad; m for joints]
_MAX_DELAYS = 9


@dataclass(frozen=True, slots=True)
class SeenJoint:
    """Joint: name, limits [rad; m] and unit."""

    name: str
    lower: float
    upper: float
    unit: str


@dataclass(frozen=True, slots=True)
class SeenGroup:
    """Group of joints, by number; see `cellwright.viewer.services.robot_panel.JointGroup`."""

    name: str
    kind: str
    joints: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class SeenRobot:
    """Constants of a robot, with the names of its arms; see `RobotPanel.robot`."""

    digest: str
    joints: tuple[SeenJoint, ...]
    groups: tuple[SeenGroup, ...]
    arms: tuple[str, ...]
    grippers: tuple[str, ...]
    base_mode: str | None
    is_real: bool

    @classmethod
    def read(cls, panel: dict[str, Any]) -> SeenRobot:
        """Read the robot from a panel.

        Raises:
            MessageError: the panel holds no robot.
        """
        try:
            robot = panel["robot"]
            return cls(
                digest=str(panel["digest"]),
                joints=tuple(_joint(each) for each in robot["joints"]),
                groups=tuple(
                    SeenGroup(str(each["name"]), str(each["kind"]), tuple(each["joints"])) for each in robot["groups"]
                ),
                arms=tuple(str(each["name"]) for each in robot["arms"]),
                grippers=tuple(map(str, robot["grippers"])),
                base_mode=robot["base_mode"],
                is_real=bool(robot["is_real"]),
            )
        except (KeyError, TypeError, ValueError) as fault:
            raise MessageError(f"panel has no robot: {fault!r}") from None

    def clamped(self, joint: int, position: float) -> float:
        """Clamp a position [rad; m] to the limits of a joint."""
        seen = self.joints[joint]
        return min(max(position, seen.lower), seen.upper)


def _read(key: str, convert: Callable[[Any], Any]) -> Any:
    """Field of `RobotState`: its key in the panel, and the conversion of its JSON value."""
    return field(metadata={"key": key, "convert": convert})


@dataclass(frozen=True, slots=True)
class RobotState:
    """State of a robot; see the keys in `cellwright.viewer.services.robot_panel`."""

    time: int = _read("time", int)
    stamp: int = _read("stamp", int)
    positions: tuple[float | None, ...] = _read("positions", tuple)
    targets: tuple[float, ...] = _read("targets", lambda value: tuple(float(each or 0.0) for each in value))
    tips: tuple[Pose, ...] = _read("tips", lambda value: tuple(map(pose_of, value)))
    references: tuple[Pose, ...] = _read("references", lambda value: tuple(map(pose_of, value)))
    aims: tuple[Pose | None, ...] = _read("aims", lambda value: tuple(_pose_or_none(each) for each in value))
    grippers: tuple[float, ...] = _read("grippers", lambda value: tuple(map(float, value)))
    gripper_targets: tuple[float, ...] = _read("gripper_targets", lambda value: tuple(map(float, value)))
    is_stopped: bool = _read("stopped", bool)
    is_enabled: bool = _read("enabled", bool)
    is_homing: bool = _read("homing", bool)
    is_silent: bool = _read("silent", bool)
    message: str = _read("message", str)
    commander: str = _read("commander", str)
    taken: int = _read("taken", int)
    refused: int = _read("refused", int)
    ignored: int = _read("ignored", int)

    @classmethod
    def read(cls, panel: dict[str, Any]) -> RobotState:
        """Read the state from a panel.

        Raises:
            MessageError: the panel holds no robot state.
        """
        try:
            return cls(**{each.name: each.metadata["convert"](panel[each.metadata["key"]]) for each in fields(cls)})
        except (KeyError, TypeError, ValueError) as fault:
            raise MessageError(f"panel has no robot state: {fault!r}") from None

    @property
    def why_not(self) -> str:
        """Reason why the robot accepts no commands now; empty if it does."""
        if self.is_stopped:
            return "the emergency stop is active"
        if self.is_homing:
            return "it is moving home"
        return "" if self.is_enabled else "it is not enabled"


def pose_of(numbers: Any) -> Pose:
    """Return the pose of x, y, z [m], qw, qx, qy, qz, which may come from a browser.

    Raises:
        ValueError: the numbers are no pose.
    """
    try:
        x, y, z, *quaternion = (float(each) for each in numbers)
        qw, qx, qy, qz = quaternion
    except TypeError:
        raise ValueError("pose must be seven numbers: x, y, z, qw, qx, qy, qz") from None
    length = math.hypot(qw, qx, qy, qz)
    if not all(map(math.isfinite, (x, y, z, length))) or length < _MIN_LENGTH:
        raise ValueError("pose must be finite, with a quaternion that is not zero")
    return Pose((x, y, z), normalized((qw, qx, qy, qz)))


def _pose_or_none(numbers: Any) -> Pose | None:
    return None if numbers is None else pose_of(numbers)


def _joint(value: dict[str, Any]) -> SeenJoint:
    unit = str(value["unit"])
    far = ROOM if unit == "m" else FULL_TURN
    lower, upper = (
        end if limit is None else float(limit) for limit, end in ((value["lower"], -far), (value["upper"], far))
    )
    return SeenJoint(str(value["name"]), lower, upper, unit)


class Reach(Enum):
    """Progress of a hand to its pose."""

    THERE = "there"
    ON_ITS_WAY = "on its way"
    SHORT = "cannot get there"


class ReachOfHand:
    """Reach monitor of a hand. A hand at rest away from its target cannot get there, even if the target moves on."""

    def __init__(self) -> None:
        self._seen: deque[tuple[int, Pose]] = deque()

    def look(self, time: int, aim: Pose | None, tip: Pose) -> Reach:
        """Return the reach at the robot's time [ns]; `aim` is the target, and both are world_T_tip."""
        seen = self._seen
        if seen and time < seen[-1][0]:
            seen.clear()
        if aim is None or is_near(aim, tip):
            seen.clear()
            return Reach.THERE
        seen.append((time, tip))
        while len(seen) > 1 and time - seen[1][0] >= REST_DURATION * 1e9:
            seen.popleft()
        started_at, there = seen[0]
        is_still = is_near(there, tip, _STILL, _STILL)
        return Reach.SHORT if time - started_at >= REST_DURATION * 1e9 and is_still else Reach.ON_ITS_WAY


def rotation_angle(one: Pose, other: Pose) -> float:
    """Angle between two orientations [rad]."""
    return 2.0 * math.acos(min(1.0, abs(float(np.dot(one.quaternion, other.quaternion)))))


def is_near(one: Pose, other: Pose, distance: float = _NEAR, angle: float = _NEAR_ROTATION) -> bool:
    """Return whether two poses are less than this apart [m; rad]; by default, whether a tip is at its target."""
    return math.dist(one.position, other.position) < distance and rotation_angle(one, other) < angle


class Delay:
    """Command delay, measured from the first request to the first motion of a robot at rest."""

    def __init__(self) -> None:
        self._found: deque[float] = deque(maxlen=_MAX_DELAYS)
        self._started_at: float | None = None
        self._tips: tuple[Pose, ...] = ()
        self._positions: tuple[float | None, ...] = ()

    @property
    def seconds(self) -> float | None:
        """Median of the newest delays [s]; None before the first."""
        return median(self._found) if self._found else None

    def begin(self, state: RobotState, now: float) -> None:
        """Start measuring at `now` [s], unless a measurement is under way."""
        if self._started_at is None or now - self._started_at > MAX_DELAY:
            self._started_at, self._tips, self._positions = now, state.tips, state.positions

    def look(self, state: RobotState, now: float) -> None:
        """Handle a state of the robot received at `now` [s]."""
        if self._started_at is None:
            return
        if now - self._started_at > MAX_DELAY or len(state.positions) != len(self._positions):
            self._started_at = None
        elif self._has_moved(state):
            self._found.append(now - self._started_at)
            self._started_at = None

    def forget(self) -> None:
        """Cancel the measurement: the motion was cancelled."""
        self._started_at = None

    def _has_moved(self, state: RobotState) -> bool:
        pairs = zip(self._positions, state.positions, strict=True)
        if any(before is not None and now is not None and abs(now - before) > _TURNED for before, now in pairs):
            return True
        tips = zip(self._tips, state.tips, strict=True)
        return not all(is_near(before, now, _MOVED, _TURNED) for before, now in tips)
