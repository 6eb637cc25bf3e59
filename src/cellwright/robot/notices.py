"""Lines about the commands of a robot: the rate-limited log, and the warning of topics that contend for joints."""

from collections import deque
from collections.abc import Callable, Mapping, Sequence

from cellwright.engine.clock import NANOSECONDS
from cellwright.robot.limiter import NO_SOURCE, Numbers

MAX_NAMES = 256
"""Maximum number of names that are kept; the limit protects memory from clients."""
MAX_LINES_PER_SECOND = 20
"""Maximum number of lines about rare events in a second; further ones are only counted."""
_MAX_NAME_LENGTH = 80
_MAX_NAMES_PER_LINE = 3  # in one line
RIVALRY_TIME = NANOSECONDS
"""Longest time [ns] between two changes of the topic, there and back, that are a contest; later ones are a choice."""


class Notices:
    """Log of rate-limited lines: each kind at most once a second, or only once."""

    def __init__(self, now: Callable[[], int], report: Callable[[str], None]) -> None:
        self._now, self._report = now, report
        self._last: dict[str, int] = {}
        self._log_times: deque[int] = deque(maxlen=MAX_LINES_PER_SECOND)  # times of the newest lines [ns]
        self._suppressed = 0
        self._once: set[str] = set()
        self.unknown: list[str] = []
        """Unknown joint names in commands, in the order of their first use."""

    def log(self, line: str) -> None:
        """Log a rare event; events in a flood are partly counted instead."""
        now = self._now()
        if len(self._log_times) == MAX_LINES_PER_SECOND and 0 <= now - self._log_times[0] < NANOSECONDS:
            self._suppressed += 1
            return
        self._log_times.append(now)
        more = f" ({self._suppressed} lines suppressed before)" if self._suppressed else ""
        self._suppressed = 0
        self._report(f"{line}{more}")

    def log_throttled(self, kind: str, line: str) -> None:
        """Log a line unless one of its kind was logged less than a second ago."""
        now, last = self._now(), self._last.get(kind)
        if last is None or not 0 <= now - last < NANOSECONDS:
            self._last[kind] = now
            self._report(line)

    def log_limits(self, topic: str, beyond: Sequence[tuple[str, float, float, float]]) -> None:
        """Log targets beyond limits, throttled: (joint, requested position, lower limit, upper limit), [rad; m]."""
        shown = [
            f"{joint} to {lower:.4g} .. {upper:.4g} (got {requested:.4g})"
            for joint, requested, lower, upper in beyond[:_MAX_NAMES_PER_LINE]
        ]
        more = f" (and {len(beyond) - _MAX_NAMES_PER_LINE} more)" if len(beyond) > _MAX_NAMES_PER_LINE else ""
        self.log_throttled(f"limits {topic}", f"{topic}: clipped to limits: {'; '.join(shown)}{more}")

    def log_once(self, name: str, line: str) -> None:
        """Log a line once for a name."""
        if name not in self._once and len(self._once) < MAX_NAMES:
            self._once.add(name)
            self._report(line)

    def log_unknown(self, topic: str, names: Mapping[str, str]) -> None:
        """Log each ignored name of a command once, with the reason; all in one line."""
        lines: list[str] = []
        if len(self._once) >= MAX_NAMES and len(self.unknown) >= MAX_NAMES:
            # New names are not kept, and a long message must not delay the physics.
            return
        for name, why in names.items():
            shown = name if len(name) <= _MAX_NAME_LENGTH else f"{name[: _MAX_NAME_LENGTH - 3]}..."
            if len(self.unknown) < MAX_NAMES and shown not in self.unknown:
                self.unknown.append(shown)
            key = f"{topic} {shown}"
            if key not in self._once and len(self._once) < MAX_NAMES:
                self._once.add(key)
                lines.append(f"{shown!r} {why}")
        if lines:
            more = f" and {len(lines) - _MAX_NAMES_PER_LINE} more" if len(lines) > _MAX_NAMES_PER_LINE else ""
            self._report(f"{topic}: {', '.join(lines[:_MAX_NAMES_PER_LINE])}{more}; ignored (logged once)")


class RivalTopics:
    """Warning of two topics that command the same joints in turn; for each pair once.

    Only a joint's newest target counts, so the robot would move between two programs' targets, or stand in between.

    Args:
        joints: names of the joints.
        sources: the topics, in the order of their indices.
        now: returns the time of the run [ns].
        notices: log.
    """

    def __init__(self, joints: Sequence[str], sources: Sequence[str], now: Callable[[], int], notices: Notices) -> None:
        self._joints, self._sources, self._now, self._notices = joints, sources, now, notices
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
        one, two = self._sources[first], self._sources[second]
        self._notices.log_once(
            f"rivals {one} {two}",
            f"{one} and {two} both command {joint}: it follows whichever message is newest; choose one with "
            f"--command-topic {one.rpartition('/')[2]} (logged once)",
        )
