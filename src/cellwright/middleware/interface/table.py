"""Rows of an interface: one for each topic, service and action.

A row names its handler, and `binding.bind` puts all rows of a table on a bus. The table itself loads without handlers.
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
    ACTION = "action"  # over topics, which have rows of their own; the row tells that they belong together


class Pace(Enum):
    """When messages of a topic come, if not so many times a second."""

    EACH_STEP = "each step"
    ON_EVENT = "on event"


Rate: TypeAlias = Fraction | Pace  # messages per second of simulation time [Hz], or the occasion


@dataclass(frozen=True, slots=True)
class Qos:
    """Quality of service of a topic, in the terms of ROS 2.

    Where lost messages are sent again a publisher `is_reliable`; a subscription that asks for it gets nothing from a
    publisher that is not.
    """

    is_reliable: bool = True
    is_transient_local: bool = False  # whether a late subscriber gets the newest messages
    depth: int = 10  # messages that are kept

    @property
    def text(self) -> str:
        """The quality of service in words: "reliable", "best effort, depth 1"."""
        words = ["reliable" if self.is_reliable else "best effort"]
        words += ["transient local"] * self.is_transient_local
        return ", ".join([*words, f"depth {self.depth}"])


RELIABLE = Qos()
LATCHED = Qos(is_transient_local=True, depth=1)
BEST_EFFORT = Qos(is_reliable=False, depth=1)

# Types whose messages are too large to be sent again.
_LARGE_TYPES = frozenset({"sensor_msgs/Image", "sensor_msgs/PointCloud", "sensor_msgs/PointCloud2"})


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
    """One topic, service or action."""

    name: str  # absolute; `of` fills in `{sensor}` and `{n}`, the name of a sensor and the number of an AGV
    type: str  # short name of the message, service or action type
    about: str  # what it is, in a sentence
    kind: Kind = Kind.TOPIC
    direction: Direction = Direction.OUT
    rate: Rate | None = None  # None for what comes from clients
    latch: bool = False  # whether a late listener is given the newest message
    where: Where = Where.ALWAYS
    competition: Competition = Competition.SAME
    node: str = "/gazebo"  # the node that publishes, hears or serves it, as the original's graph names it
    source: str = ""  # the part of the original that this is taken from
    handler: str = ""  # name of the method that serves it; see `binding.bind`
    qos: Qos = RELIABLE
    subject: str | None = None  # the sensor or the number in the name; None where it has no gap, or is not filled

    @property
    def period(self) -> Fraction | None:
        """Time between two messages [s]; None for what does not come at a rate."""
        return 1 / self.rate if isinstance(self.rate, Fraction) else None

    @property
    def rate_text(self) -> str:
        """The rate in words: "50 Hz", "each step", "on event", or nothing for what comes from clients."""
        if isinstance(self.rate, Fraction):
            return f"{float(self.rate):g} Hz"
        return "" if self.rate is None else self.rate.value

    def of(self, subject: str | None) -> Row:
        """The row for one sensor or AGV, or for none."""
        if subject is None:
            return self
        return replace(self, name=self.name.replace("{sensor}", subject).replace("{n}", subject), subject=subject)


class RowOptions(TypedDict, total=False):
    """What a row may say besides."""

    competition: Competition
    node: str
    source: str
    handler: str
    qos: Qos


def says(
    name: str,
    type_name: str,
    rate: int | Pace,
    where: Where,
    about: str,
    *,
    latch: bool = False,
    **more: Unpack[RowOptions],
) -> Row:
    """The row of a topic that the cell publishes; `rate` in Hz or on which occasion.

    Latched topics are transient local, pictures and point clouds best effort, and all others reliable.
    """
    more.setdefault("qos", LATCHED if latch else BEST_EFFORT if type_name in _LARGE_TYPES else RELIABLE)
    pace = Fraction(rate) if isinstance(rate, int) else rate
    return Row(name=name, type=type_name, rate=pace, where=where, about=about, latch=latch, **more)


def takes(kind: Kind, name: str, type_name: str, where: Where, about: str, **more: Unpack[RowOptions]) -> Row:
    """The row of a topic that the cell hears, of a service or of an action. A topic is reliable."""
    return Row(name=name, type=type_name, kind=kind, direction=Direction.IN, where=where, about=about, **more)
