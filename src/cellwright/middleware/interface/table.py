"""The rows that a contract is written in: one for each topic, service and action.

A contract is a table and nothing else. What a row is bound to stands elsewhere; here is what a client can rely on.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from fractions import Fraction
from typing import TypeAlias, TypedDict, Unpack

from cellwright.middleware.bus import Direction


class Kind(Enum):
    """What a row names."""

    TOPIC = "topic"
    SERVICE = "service"
    ACTION = "action"
    """Said and heard over topics, which have rows of their own; the row tells that they belong together."""


class Pace(Enum):
    """When messages of a topic come, if not so many times a second."""

    EACH_STEP = "each step"
    ON_EVENT = "on event"


Rate: TypeAlias = Fraction | Pace
"""Messages per second of simulation time [Hz], or the occasion."""


class Where(Enum):
    """In which cells a row is there, and how often."""

    ALWAYS = "always"
    ARM = "with an arm"
    AGVS = "with AGVs"
    EACH_AGV = "for each AGV"
    BELT_PARTS = "with belt parts"
    CAMERAS = "with AGVs or logical cameras"
    BREAK_BEAM = "for each break beam"
    PROXIMITY_SENSOR = "for each proximity sensor"
    LASER_PROFILER = "for each laser profiler"
    LOGICAL_CAMERA = "for each logical camera"
    COLOUR_CAMERA = "for each rgb_camera and rgbd_camera"
    DEPTH_CAMERA = "for each depth_camera and rgbd_camera"
    CLOUD_CAMERA = "for each depth_camera"
    ARMS = "with arms in the robot configuration"
    GRIPPERS = "with grippers in the robot configuration"
    EACH_CAMERA = "for each camera of the robot configuration"
    FREE_BASE = "without a fixed link"
    SIMULATED_TIME = "with simulated time"


class Competition(Enum):
    """What becomes of a row in competition mode."""

    SAME = "the same"
    REFUSES = "answers success = false"
    SILENCED = "silent"
    """Nothing comes for anybody. Listening has no price, unlike in the original, where it spoilt the score."""
    ABSENT = "absent"


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One topic, service or action.

    Attributes:
        template: absolute name; `{sensor}` and `{n}` stand for the name of a sensor and the number of an AGV.
        type: short name of the message, service or action type.
        about: what it is, in a sentence.
        kind: topic, service or action.
        direction: out of the cell, or into it.
        rate: how often it comes; None for what comes from clients.
        latch: whether a late listener is given the newest message.
        where: in which cells it is there.
        competition: what becomes of it in competition mode.
        node: the node that publishes, hears or serves it, as the original's graph names it.
        source: the part of the original that this is taken from.
        subject: the sensor or the number that the template is filled with; None where it has no gap, or is not filled.
    """

    template: str
    type: str
    about: str
    kind: Kind = Kind.TOPIC
    direction: Direction = Direction.OUT
    rate: Rate | None = None
    latch: bool = False
    where: Where = Where.ALWAYS
    competition: Competition = Competition.SAME
    node: str = "/gazebo"
    source: str = ""
    subject: str | None = None

    @property
    def name(self) -> str:
        """The name, filled in where the row has a subject."""
        if self.subject is None:
            return self.template
        return self.template.replace("{sensor}", self.subject).replace("{n}", self.subject)

    @property
    def period(self) -> Fraction | None:
        """Time between two messages [s]; None for what does not come at a rate."""
        return 1 / self.rate if isinstance(self.rate, Fraction) else None

    @property
    def rate_text(self) -> str:
        """The rate in words: "50 Hz", "each step", "on event", or nothing for what comes from clients."""
        match self.rate:
            case None:
                return ""
            case Pace() as pace:
                return pace.value
            case rate:
                return f"{float(rate):g} Hz"

    def of(self, subject: str | None) -> Row:
        """The row for one sensor or AGV, or for none."""
        return replace(self, subject=subject)


class Says(TypedDict, total=False):
    """What a row of a topic from the cell may say besides."""

    latch: bool
    competition: Competition
    node: str
    source: str


class Takes(TypedDict, total=False):
    """What a row of a topic to the cell, a service or an action may say besides."""

    competition: Competition
    source: str


def says(template: str, type_name: str, rate: int | Pace, where: Where, about: str, **more: Unpack[Says]) -> Row:
    """The row of a topic that the cell publishes; `rate` in Hz or on which occasion."""
    pace = Fraction(rate) if isinstance(rate, int) else rate
    return Row(template=template, type=type_name, rate=pace, where=where, about=about, **more)


def takes(kind: Kind, template: str, type_name: str, where: Where, about: str, **more: Unpack[Takes]) -> Row:
    """The row of a topic that the cell hears, of a service or of an action."""
    return Row(template=template, type=type_name, kind=kind, direction=Direction.IN, where=where, about=about, **more)
