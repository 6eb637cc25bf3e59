"""Warning of command topics that take the same joints from each other."""

from collections.abc import Callable

from cellwright.engine.clock import NANOSECONDS
from cellwright.robot.interface import JOINT_SOURCES
from cellwright.robot.safety import NO_SOURCE, Notices, Numbers

RIVALRY_TIME = NANOSECONDS
"""Longest time [ns] between two changes of the topic, there and back, that are a contest; later ones are a choice."""


class RivalTopics:
    """Warning of two topics that command the same joints in turn; for each pair once.

    Only a joint's newest target counts, so the robot would move between two programs' targets, or stand in between.

    Args:
        joints: names of the joints.
        now: returns the time of the run [ns].
        notices: log.
    """

    def __init__(self, joints: tuple[str, ...], now: Callable[[], int], notices: Notices) -> None:
        self._joints, self._now, self._notices = joints, now, notices
        self._changes: dict[tuple[int, int], int] = {}  # time of the newest change from one source to another [ns]

    def forget(self) -> None:
        """Clear."""
        self._changes.clear()

    def note(self, source: int, joints: Numbers, before: Numbers) -> None:
        """Note that joints follow a source, by index, and which sources they followed before."""
        now = self._now()
        for other, joint in dict(zip(before.tolist(), joints.tolist(), strict=True)).items():
            if other in (source, NO_SOURCE):
                continue
            self._changes[other, source] = now
            back = self._changes.get((source, other))
            if back is not None and 0 <= now - back <= RIVALRY_TIME:
                self._warn(min(source, other), max(source, other), self._joints[joint])

    def _warn(self, first: int, second: int, joint: str) -> None:
        one, two = JOINT_SOURCES[first], JOINT_SOURCES[second]
        self._notices.log_once(
            f"rivals {one} {two}",
            f"{one} and {two} both command {joint}: it follows whichever message is newest; choose one with "
            f"--command-topic {one.rpartition('/')[2]} (logged once)",
        )
