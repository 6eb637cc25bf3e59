"""Classes of the messages and services that Cellwright adds to a contract (`definitions/cellwright_msgs`)."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from cellwright.middleware.messages.conversions import duration, stamp
from cellwright.middleware.messages.standard import Duration, Time

Counts = np.ndarray[tuple[int, ...], np.dtype[np.uint64]]
"""What a `uint64[]` field holds."""


def _none() -> Counts:
    return np.zeros(0, np.uint64)


@dataclass(slots=True)
class StepRequest:
    """Let `duration` pass, once as many messages as were `published` on each of the `topics` have come."""

    duration: Duration = field(default_factory=duration)
    topics: list[str] = field(default_factory=list)
    published: Counts = field(default_factory=_none)
    __msgtype__: ClassVar[str] = "cellwright_msgs/srv/Step_Request"


@dataclass(slots=True)
class StepResponse:
    """Whether it passed, until when, and how many messages the caller was sent on each of the `topics` by then."""

    success: bool = False
    message: str = ""
    time: Time = field(default_factory=stamp)
    topics: list[str] = field(default_factory=list)
    sent: Counts = field(default_factory=_none)
    __msgtype__: ClassVar[str] = "cellwright_msgs/srv/Step_Response"


@dataclass(slots=True)
class TeleopStatus:
    """What a robot controller node takes commands from, and what it refused; see the definition file."""

    enabled: bool = True
    emergency_stop: bool = False
    resetting: bool = False
    silent: bool = False
    commander: str = ""
    taken: int = 0
    refused: int = 0
    ignored: int = 0
    unknown_names: list[str] = field(default_factory=list)
    message: str = ""
    __msgtype__: ClassVar[str] = "cellwright_msgs/msg/TeleopStatus"
