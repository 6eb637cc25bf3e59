"""Rows of an interface: one for each topic, service and action.

A row names its handler, and `binding.bind` puts all rows of a table on a bus. The table itself loads without handlers.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from fractions import Fraction
from typing import Any, Self, TypeAlias, TypedDict, Unpack

from cellwright.middleware.bus import COMMANDS, LARGE, LATCHED, RELIABLE, Direction, Qos

_PLACEHOLDER = re.compile(r"\{\w+\}")

# Types with large messages.
_LARGE_TYPES = frozenset({"sensor_msgs/Image", "sensor_msgs/PointCloud", "sensor_msgs/PointCloud2"})


class EndpointKind(Enum):
    """Kind of a row."""

    TOPIC = "topic"
    SERVICE = "service"
    ACTION = "action"  # over topics, which have rows of their own; this row groups them


class Timing(Enum):
    """Timing of a topic's messages, if it has no rate in Hz."""

    EACH_STEP = "each step"
    ON_EVENT = "on event"


Rate: TypeAlias = Fraction | Timing  # messages per second of simulation time [Hz], or the occasion


@dataclass(frozen=True, slots=True)
class Where:
    """Occurrence of a row: in which cells or robots, and how often.

    Attributes:
        text: for readers, such as "with an arm".
        subjects: takes the description of a cell or robot; returns the names or numbers for which it has the row. A row
            without a placeholder has the subject None, or no subject where it is absent.
    """

    text: str
    subjects: Callable[[Any], Sequence[str | None]]

    @classmethod
    def when(cls, text: str, holds: Callable[[Any], object]) -> Self:
        """Return the occurrence of a row that exists once, if a predicate of the description holds."""
        return cls(text, lambda description: (None,) if holds(description) else ())


ALWAYS = Where.when("always", lambda _description: True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Endpoint:
    """Row of one topic, service or action."""

    name: str  # absolute; `of` fills in a placeholder such as `{sensor}` or `{n}`
    type: str  # short name of the message, service or action type
    about: str  # description in a sentence
    kind: EndpointKind = EndpointKind.TOPIC
    direction: Direction = Direction.OUT
    rate: Rate | None = None  # None for what comes from clients
    latch: bool = False  # true if a late listener gets the newest message
    where: Where = ALWAYS
    node: str = ""  # publishes, receives or serves it; empty for the node of the table's owner
    source: str = ""  # the program that first had it; empty for a row of Cellwright
    handler: str = ""  # name of the method that serves it; see `binding.bind`
    qos: Qos = RELIABLE
    subject: str | None = None  # in the name; None if the name has no placeholder, or it is not filled in

    @property
    def period(self) -> Fraction | None:
        """Time between two messages [s]; None without a rate."""
        return 1 / self.rate if isinstance(self.rate, Fraction) else None

    @property
    def rate_text(self) -> str:
        """Rate in words: "50 Hz", "each step", "on event", or "" for what comes from clients."""
        if isinstance(self.rate, Fraction):
            return f"{float(self.rate):g} Hz"
        return "" if self.rate is None else self.rate.value

    def of(self, subject: str | None) -> Endpoint:
        """Return the row for one subject, such as a sensor's name, or for none."""
        if subject is None:
            return self
        return replace(self, name=_PLACEHOLDER.sub(lambda _match: subject, self.name), subject=subject)


class EndpointOptions(TypedDict, total=False):
    """Optional fields of a row."""

    node: str
    source: str
    handler: str
    qos: Qos


def publishes(
    name: str,
    type_name: str,
    rate: int | Timing,
    where: Where,
    about: str,
    *,
    latch: bool = False,
    **more: Unpack[EndpointOptions],
) -> Endpoint:
    """Return the row of a topic that the cell publishes; `rate` in Hz or a `Timing`.

    Latched topics are transient local. All are reliable; of pictures and point clouds few are kept.
    """
    more.setdefault("qos", LATCHED if latch else LARGE if type_name in _LARGE_TYPES else RELIABLE)
    pace = Fraction(rate) if isinstance(rate, int) else rate
    return Endpoint(name=name, type=type_name, rate=pace, where=where, about=about, latch=latch, **more)


def accepts(
    kind: EndpointKind, name: str, type_name: str, where: Where, about: str, **more: Unpack[EndpointOptions]
) -> Endpoint:
    """Return the row of a topic that the cell receives, of a service or of an action.

    A topic is reliable, and keeps the messages of a burst.
    """
    more.setdefault("qos", COMMANDS)
    return Endpoint(name=name, type=type_name, kind=kind, direction=Direction.IN, where=where, about=about, **more)
