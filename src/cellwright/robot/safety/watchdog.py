"""The watchdog: joints whose commands have stopped coming are held, each topic for itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from cellwright.robot.safety.approach import NOBODY, Approach, Numbers
from cellwright.robot.safety.gate import Gate
from cellwright.robot.safety.notices import Notices
from cellwright.robot.safety.settings import SafetySettings
from cellwright.robot.servos import Array

SELDOM = ("/io_teleop/target_gripper_status", "/io_teleop/target_base_move")
"""Topics on which a command may come once and hold for long: silence means nothing there."""


class Watchdog:
    """Holds joints that a topic moves when nothing has come on it for too long.

    Args:
        safety: how long that is; never, where nobody asked for it.
        sources: the topics, by the number that `approach` knows them by.
        gate: knows when a command was taken last.
        approach: holds the joints.
        measured: tells where all joints stand [rad; m].
        notices: where people are told.
    """

    def __init__(
        self,
        safety: SafetySettings,
        sources: Sequence[str],
        gate: Gate,
        approach: Approach,
        measured: Callable[[], Array],
        notices: Notices,
    ) -> None:
        self._silence = safety.silence
        self._watched = [] if safety.silence is None else [each for each in enumerate(sources) if each[1] not in SELDOM]
        self._gate, self._approach, self._measured, self._notices = gate, approach, measured, notices
        self._silent: dict[str, list[int]] = {}  # topics, with the joints that were held for their silence

    @property
    def topics(self) -> tuple[str, ...]:
        """The topics that have fallen silent, and for which joints are still held: nobody else moves them."""
        source = self._approach.source
        return tuple(sorted(topic for topic, joints in self._silent.items() if (source[joints] == NOBODY).any()))

    @property
    def is_all_silent(self) -> bool:
        """Whether the robot holds because nothing has come for too long, from anybody."""
        return bool(self.topics) and not (self._approach.source >= 0).any()

    def look(self) -> None:
        """Hold the joints of topics that have fallen silent by now."""
        for number, topic in self._watched:
            if topic in self._silent or not self._gate.is_silent(topic):
                continue
            joints: Numbers = np.flatnonzero(self._approach.source == number)
            if len(joints):
                self._approach.hold(self._measured(), joints)
                self._silent[topic] = joints.tolist()
                self._notices.tell(f"nothing has come on {topic} for {self._silence:g} s: its joints are held")

    def hear(self, topic: str, node: str) -> None:
        """Take note of a command that was taken."""
        if topic in self._silent:
            del self._silent[topic]
            self._notices.tell(f"{topic} is heard again, from {node or 'a client'}")

    def forget(self) -> None:
        """Begin anew: all joints are held for another reason, or go home."""
        self._silent.clear()

    def get_state(self) -> dict[str, list[int]]:
        """The silent topics and what was held for them, as JSON values."""
        return {topic: list(joints) for topic, joints in self._silent.items()}

    def set_state(self, state: Mapping[str, list[int]]) -> None:
        """Take over what `get_state` returned."""
        self._silent = {topic: list(joints) for topic, joints in state.items()}
