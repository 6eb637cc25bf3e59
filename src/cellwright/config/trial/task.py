"""Task of a trial: a sentence, the start, the conditions of success, and the kind of reward."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

from cellwright.util.pose import Pose, Vector3

RewardKind: TypeAlias = Literal["sparse", "shaped"]
"""Kind of a reward: 1 at success and else 0, or else the potential of the conditions."""


@dataclass(frozen=True, slots=True)
class Held:
    """A cup, fingers or a hand hold a part of a type.

    Attributes:
        part: type of the part.
        lifted: height [m] of the part over the place where it lay or appeared at the start.
        by: its holder: the name of an arm, or a hand such as `qinglong/left`; None for any.
    """

    part: str
    lifted: float = 0.0
    by: str | None = None


@dataclass(frozen=True, slots=True)
class OnTray:
    """A part of a type stands on the plate of a tray, at rest and not held.

    Attributes:
        part: type of the part.
        tray: name of the AGV or of the fixed tray.
        at: place of its origin in the frame of the tray [m]; None for any.
        yaw: its yaw in that frame [rad], for parts with their own side up; None for any.
        tolerance: greatest distance from the place along the plate [m].
        turn_tolerance: greatest difference from the yaw [rad].
    """

    part: str
    tray: str
    at: tuple[float, float] | None = None
    yaw: float | None = None
    tolerance: float = 0.03
    turn_tolerance: float = 0.1


@dataclass(frozen=True, slots=True)
class KitBuilt:
    """A tray holds the worth of some points as a kit of an announced order, without a submission.

    Attributes:
        points: least points; None for all that are attainable.
    """

    points: float | None = None


@dataclass(frozen=True, slots=True)
class Scored:
    """The score of the submitted kits.

    Attributes:
        points: least points; None for all that are attainable.
    """

    points: float | None = None


@dataclass(frozen=True, slots=True)
class Discarded:
    """No faulty part stands on a tray or is held.

    Attributes:
        tray: name of the AGV or of the fixed tray.
    """

    tray: str


@dataclass(frozen=True, slots=True)
class Turned:
    """A part of a type lies on its other side: its z axis is opposite to that at the start. At rest and not held.

    Attributes:
        part: type of the part.
        tolerance: greatest angle from the opposite direction [rad].
    """

    part: str
    tolerance: float = 0.2


@dataclass(frozen=True, slots=True)
class LinkAt:
    """The origin of a robot's link is at a point.

    Attributes:
        robot: name of the robot in the cell.
        link: name of the link in the robot's file.
        at: the point in the world [m]; in a file it is in the frame of the cell.
        tolerance: greatest distance [m].
    """

    robot: str
    link: str
    at: Vector3
    tolerance: float = 0.02


Condition: TypeAlias = Held | OnTray | KitBuilt | Scored | Discarded | Turned | LinkAt


@dataclass(frozen=True, slots=True)
class TaskStart:
    """Start of a task, beside what the trial says.

    Attributes:
        joints: positions of arm joints [rad; m for the rail], by name.
        jitter: greatest shift of each joint of an arm, also a robot's, from there [rad; m], drawn from the seed's own
            stream.
        holding: type of a part that the suction cup holds as the run begins; None for none.
    """

    joints: Mapping[str, float] = field(default_factory=dict)
    jitter: float = 0.0
    holding: str | None = None


@dataclass(frozen=True, slots=True)
class Task:
    """Task of a trial.

    Attributes:
        sentence: the task in plain English.
        success: conditions that must hold together.
        start: its start.
        hold_for: time for which the conditions must hold without a break [s].
        reward: kind of the reward.
        starts_competition: True if the competition starts without a client.

    Example:
        >>> from cellwright import load_trial
        >>> load_trial("pick_from_bin").task.sentence
        'Pick up a gear from the bin.'
    """

    sentence: str
    success: tuple[Condition, ...]
    start: TaskStart = field(default_factory=TaskStart)
    hold_for: float = 0.0
    reward: RewardKind = "sparse"
    starts_competition: bool = True

    def moved(self, by: Pose) -> Task:
        """Return the task of a cell that is moved by a pose of the world."""
        placed = (
            replace(each, at=by.transform(each.at)) if isinstance(each, LinkAt) else each for each in self.success
        )
        return replace(self, success=tuple(placed))
