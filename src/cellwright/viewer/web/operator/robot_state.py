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
"""So far [m] a sliding joint without limits can be sent here; one that turns without end, `FULL_TURN` [rad]."""
_SHORTEST = 1e-6  # a quaternion shorter than this has no direction


@dataclass(frozen=True, slots=True)
class SeenJoint:
    """A joint: its name, its limits [rad; m], and its unit."""

    name: str
    lower: float
    upper: float
    unit: str


@dataclass(frozen=True, slots=True)
class SeenGroup:
    """Joints that belong together, by number; see `cellwright.viewer.services.robot_panel.JointGroup`."""

    name: str
    kind: str
    joints: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class SeenRobot:
    """What stays as it is; see `RobotPanel.robot`. Of the arms it has the names."""

    digest: str
    joints: tuple[SeenJoint, ...]
    groups: tuple[SeenGroup, ...]
    arms: tuple[str, ...]
    grippers: tuple[str, ...]
    base_mode: str | None
    is_real: bool

    @classmethod
    def read(cls, panel: dict[str, Any]) -> SeenRobot:
        """The robot in an answer that holds it; MessageError: it holds none."""
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
            raise MessageError(f"the panel tells of no robot: {fault!r}") from None

    def clamped(self, joint: int, position: float) -> float:
        """A position [rad; m] within the limits of a joint."""
        seen = self.joints[joint]
        return min(max(position, seen.lower), seen.upper)


def _read(key: str, convert: Callable[[Any], Any]) -> Any:
    """A field of `Standing`: its key in the panel, and what makes its value of the JSON."""
    return field(metadata={"key": key, "convert": convert})


@dataclass(frozen=True, slots=True)
class Standing:
    """How a robot stands; the keys are explained in `cellwright.viewer.services.robot_panel`."""

    time: int = _read("time", int)
    stamp: int = _read("stamp", int)
    positions: tuple[float | None, ...] = _read("positions", tuple)
    targets: tuple[float, ...] = _read("targets", lambda told: tuple(float(each or 0.0) for each in told))
    tips: tuple[Pose, ...] = _read("tips", lambda told: tuple(map(pose_of, told)))
    references: tuple[Pose, ...] = _read("references", lambda told: tuple(map(pose_of, told)))
    aims: tuple[Pose | None, ...] = _read("aims", lambda told: tuple(_pose_or_none(each) for each in told))
    grippers: tuple[float, ...] = _read("grippers", lambda told: tuple(map(float, told)))
    gripper_targets: tuple[float, ...] = _read("gripper_targets", lambda told: tuple(map(float, told)))
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
    def read(cls, panel: dict[str, Any]) -> Standing:
        """How it stands by an answer; MessageError: the answer is none."""
        try:
            return cls(**{each.name: each.metadata["convert"](panel[each.metadata["key"]]) for each in fields(cls)})
        except (KeyError, TypeError, ValueError) as fault:
            raise MessageError(f"the panel tells of no robot: {fault!r}") from None

    @property
    def why_not(self) -> str:
        """Why the robot takes no commands now; empty when it does."""
        if self.is_stopped:
            return "its emergency stop is on"
        if self.is_homing:
            return "it is on its way home"
        return "" if self.is_enabled else "it is switched off"


def pose_of(numbers: Any) -> Pose:
    """The pose in x, y, z [m], qw, qx, qy, qz, which may come from a browser; ValueError: there is none in it."""
    try:
        x, y, z, *quaternion = (float(each) for each in numbers)
        qw, qx, qy, qz = quaternion
    except TypeError:
        raise ValueError("a pose is seven numbers") from None
    length = math.hypot(qw, qx, qy, qz)
    if not all(map(math.isfinite, (x, y, z, length))) or length < _SHORTEST:
        raise ValueError("a pose must be finite, and have a direction")
    return Pose((x, y, z), normalized((qw, qx, qy, qz)))


def _pose_or_none(numbers: Any) -> Pose | None:
    return None if numbers is None else pose_of(numbers)


def _joint(told: dict[str, Any]) -> SeenJoint:
    unit = str(told["unit"])
    far = ROOM if unit == "m" else FULL_TURN
    lower, upper = (
        end if limit is None else float(limit) for limit, end in ((told["lower"], -far), (told["upper"], far))
    )
    return SeenJoint(str(told["name"]), lower, upper, unit)


_NEAR, _NEAR_ROTATION = 0.005, 0.03  # [m], [rad] from its pose within which a tip is there
REST_DURATION = 0.4
"""So long [s] of the robot's time a tip has to rest short of its pose until that is told."""
_STILL = 0.002  # [m] and [rad] that a tip may move meanwhile


class Reach(Enum):
    """How it stands with a hand and its pose."""

    THERE = "there"
    ON_ITS_WAY = "on its way"
    SHORT = "cannot get there"


class ReachOfHand:
    """Watches a hand. One that rests while its pose is elsewhere does not get there, also where the pose moves on."""

    def __init__(self) -> None:
        self._seen: deque[tuple[int, Pose]] = deque()

    def look(self, time: int, aim: Pose | None, tip: Pose) -> Reach:
        """How it stands at the robot's time [ns]; both are world_T_tip, `aim` what it is being brought to."""
        seen = self._seen
        if seen and time < seen[-1][0]:
            seen.clear()
        if aim is None or is_near(aim, tip):
            seen.clear()
            return Reach.THERE
        seen.append((time, tip))
        while len(seen) > 1 and time - seen[1][0] >= REST_DURATION * 1e9:
            seen.popleft()
        begun, there = seen[0]
        is_still = is_near(there, tip, _STILL, _STILL)
        return Reach.SHORT if time - begun >= REST_DURATION * 1e9 and is_still else Reach.ON_ITS_WAY


def rotation_angle(one: Pose, other: Pose) -> float:
    """By how much [rad] two poses are turned against each other."""
    return 2.0 * math.acos(min(1.0, abs(float(np.dot(one.quaternion, other.quaternion)))))


def is_near(one: Pose, other: Pose, distance: float = _NEAR, angle: float = _NEAR_ROTATION) -> bool:
    """Whether two poses are less than this apart [m; rad]; by default, whether a tip is where it is to be."""
    return math.dist(one.position, other.position) < distance and rotation_angle(one, other) < angle


MAX_DELAY = 2.0
"""A robot that has not moved after so long [s] was not going to."""
_MOVED, _TURNED = 5e-4, 2e-3  # [m], [rad; m for joints]
_MAX_DELAYS = 9


class Delay:
    """Measures it at the beginning of each motion, when the robot was at rest."""

    def __init__(self) -> None:
        self._found: deque[float] = deque(maxlen=_MAX_DELAYS)
        self._begun: float | None = None
        self._tips: tuple[Pose, ...] = ()
        self._positions: tuple[float | None, ...] = ()

    @property
    def seconds(self) -> float | None:
        """The median of the newest ones [s]; None before the first."""
        return median(self._found) if self._found else None

    def begin(self, standing: Standing, now: float) -> None:
        """A hand begins to move at `now` [s]; not while another motion is still waited for."""
        if self._begun is None or now - self._begun > MAX_DELAY:
            self._begun, self._tips, self._positions = now, standing.tips, standing.positions

    def look(self, standing: Standing, now: float) -> None:
        """This was heard of the robot at `now` [s]."""
        if self._begun is None:
            return
        if now - self._begun > MAX_DELAY or len(standing.positions) != len(self._positions):
            self._begun = None
        elif self._has_moved(standing):
            self._found.append(now - self._begun)
            self._begun = None

    def forget(self) -> None:
        """What began is no motion of the robot's any more."""
        self._begun = None

    def _has_moved(self, standing: Standing) -> bool:
        pairs = zip(self._positions, standing.positions, strict=True)
        if any(before is not None and now is not None and abs(now - before) > _TURNED for before, now in pairs):
            return True
        tips = zip(self._tips, standing.tips, strict=True)
        return not all(is_near(before, now, _MOVED, _TURNED) for before, now in tips)
