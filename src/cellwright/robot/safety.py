"""Safety of commands: the settings, and the gate that admits or refuses each command."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

import numpy as np

from cellwright.engine.clock import nanoseconds
from cellwright.robot.interface import COMMAND_TOPICS
from cellwright.robot.servos import Array
from cellwright.util.errors import RejectedCommandError, UnknownNameError, UsageError

RESUME_SPEED = 0.5
"""Speed of joints towards their first targets after a hold [rad/s; m/s]."""
TIP_SPEED, TIP_TURNING = 2.0, 2.0 * math.pi
"""Maximum speed of an arm's tip towards a pose [m/s], and of its rotation [rad/s]."""
COMMANDER_TIMEOUT = 1.0
"""Time [s] after its newest command for which a node counts as commander."""
_STAMP_MEMORY = nanoseconds(1.0)  # after this time a node may use older stamps, as after its restart


class Guard(StrEnum):
    """Reaction to a first target that is too far away."""

    REFUSE = "refuse"
    """Messages are refused until one is near enough."""
    BLEND = "blend"
    """The robot goes there at the resume speed."""


@dataclass(frozen=True)
class SafetySettings:
    """Safety settings of a robot.

    Always on: names that the robot does not have are ignored, invalid messages are refused whole, and targets are kept
    within the limits of the joints. All else changes how a robot behaves, and is off by default.

    Attributes:
        start_disabled: take no commands until enabled by the service.
        silence: hold the joints of a topic that has been silent for this time [s].
        max_speeds: speed limits of targets [rad/s; m/s], by patterns of joint names; the last match counts. A joint
            never moves faster than its URDF allows.
        start_guard: maximum distance [rad; m] of a first target from the joint's position; first after the start, and
            after each hold and homing.
        guard: reaction to a first target farther away.
        resume_speed: speed of joints towards their first targets after a hold [rad/s; m/s].
        one_commander: take a topic's commands from one node only, until it has been silent for this time [s].
        max_age: refuse commands with a stamp older than this [s], and those out of order.
        tip_speed: speed of an arm's tip towards a pose [m/s]; None: 2 m/s.
        tip_turning: speed of its rotation [rad/s]; None: one turn a second.
        clutch: make targets relative to the first target and the joint's position then, so that a client need not begin
            at the robot's posture.
        command_topics: names of the topics that command the robot, as the operators of io_teleop publish poses beside
            the joint targets that follow from them; messages on other topics are ignored. Empty: all command it.
    """

    start_disabled: bool = False
    silence: float | None = None
    max_speeds: tuple[tuple[str, float], ...] = ()
    start_guard: float | None = None
    guard: Guard = Guard.REFUSE
    resume_speed: float = RESUME_SPEED
    one_commander: float | None = None
    max_age: float | None = None
    tip_speed: float | None = None
    tip_turning: float | None = None
    clutch: bool = False
    command_topics: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Validate the settings.

        Raises:
            UsageError: a number is not above 0.
            UnknownNameError: a name is not that of a command topic.
        """
        for topic in self.command_topics:
            if topic not in COMMAND_TOPICS:
                raise UnknownNameError("command topic", topic, COMMAND_TOPICS)
        named = {
            "watchdog": self.silence,
            "start guard": self.start_guard,
            "resume speed": self.resume_speed,
            "one commander": self.one_commander,
            "max age": self.max_age,
            "tip speed": self.tip_speed,
            "tip turning": self.tip_turning,
            **{f"max speed of {pattern}": speed for pattern, speed in self.max_speeds},
        }
        for name, value in named.items():
            if value is not None and not 0.0 < value < math.inf:
                raise UsageError(f"{name} must be a finite number above 0 (got {value:g})")

    def speeds(self, joints: Sequence[str], own: Array) -> Array:
        """Return speed limits of the joints' targets [rad/s; m/s]; infinite where only the URDF (`own`) limits them.

        Raises:
            UnknownNameError: a pattern that fits no joint.
        """
        found = np.full(len(joints), math.inf)
        for pattern, speed in self.max_speeds:
            fits = [fnmatchcase(joint, pattern) for joint in joints]
            if not any(fits):
                raise UnknownNameError("joint", pattern, joints)
            found[fits] = speed
        limited: Array = np.where(np.isfinite(found), np.minimum(found, own), math.inf)
        return limited


class _Stream(NamedTuple):
    """Newest command that was taken on a topic: its node, its time of arrival [ns], and its stamp [ns]."""

    node: str
    heard: int
    stamp: int


class CommandGate:
    """Gate of commands: admits or refuses them, by the node's own time and that of messages.

    Args:
        safety: safety settings.
        now: returns the time of the run [ns].
        message_time: returns the time that messages carry [ns].
        offset: returns by how much message time is ahead of the run's [ns], as after a reset that kept the clock.
    """

    def __init__(
        self,
        safety: SafetySettings,
        now: Callable[[], int],
        message_time: Callable[[], int],
        offset: Callable[[], int] = lambda: 0,
    ) -> None:
        self._now, self._message_time, self._offset = now, message_time, offset
        self.arrived = message_time()
        """Arrival of the newest input, in the time of message stamps [ns]."""
        self._streams: dict[str, _Stream] = {}
        limits = (safety.silence, safety.one_commander, safety.max_age)
        self._silence, self._exclusive, self._age = (None if each is None else nanoseconds(each) for each in limits)

    def forget(self) -> None:
        """Clear."""
        self._streams.clear()

    def note_arrival(self, _input: object = None) -> None:
        """Note that input has arrived now."""
        self.arrived = self._message_time()

    def check(self, topic: str, node: str, stamp: int) -> None:
        """Check a command before it is carried out; `stamp` [ns] 0 means that it has none.

        Raises:
            RejectedCommandError: it is refused.
        """
        newest, limit = self._streams.get(topic), self._age
        quiet = 0 if newest is None else self._now() - newest.heard
        if newest is not None and self._exclusive is not None and newest.node != node and quiet <= self._exclusive:
            raise RejectedCommandError(
                f"{newest.node or 'another node'} commands this topic; others may after {self._exclusive / 1e9:g} s "
                "of silence"
            )
        if limit is None or not stamp:
            return
        age = self.arrived - stamp
        if age > limit:
            raise RejectedCommandError(f"stamp must be at most {limit / 1e9:g} s old (got {age / 1e9:.3g} s)")
        if age < -limit:
            raise RejectedCommandError(f"stamp is {-age / 1e9:.3g} s ahead of the node's clock")
        is_known = newest is not None and newest.node == node and quiet <= _STAMP_MEMORY
        if newest is not None and is_known and stamp < newest.stamp:
            raise RejectedCommandError(
                f"stamp is {(newest.stamp - stamp) / 1e9:.3g} s older than that of the previous command"
            )

    def confirm(self, topic: str, node: str, stamp: int) -> None:
        """Note a command that was carried out."""
        self._streams[topic] = _Stream(node, self._now(), stamp)

    def is_silent(self, topic: str) -> bool:
        """Return True if a topic has been silent for too long; False without a limit, and before its first command."""
        newest = self._streams.get(topic)
        return newest is not None and self._silence is not None and self._now() - newest.heard > self._silence

    @property
    def commanders(self) -> tuple[str, ...]:
        """Nodes with recently taken commands."""
        since = self._now() - nanoseconds(COMMANDER_TIMEOUT)
        return tuple(sorted({each.node for each in self._streams.values() if each.node and each.heard >= since}))

    def get_state(self) -> dict[str, Any]:
        """Return the state, as JSON values, with stamps in the time of the run."""
        offset = self._offset()
        return {topic: [node, heard, stamp and stamp - offset] for topic, (node, heard, stamp) in self._streams.items()}

    def set_state(self, state: dict[str, Any]) -> None:
        """Restore what `get_state` returned."""
        offset = self._offset()
        self._streams = {
            topic: _Stream(node, heard, stamp and stamp + offset) for topic, (node, heard, stamp) in state.items()
        }
