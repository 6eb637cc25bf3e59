"""What people are told about commands that were taken otherwise than they were meant: few lines, whatever comes."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence

from cellwright.engine.clock import NANOSECONDS

MOST_NAMES = 256
"""So many names are kept; they come from outside, and must not eat the memory."""

MOST_LINES = 20
"""So many lines about what happens seldom are told in a second; what is switched on and off in a flood is counted."""

_LONGEST = 80
_MOST_TOLD = 3  # names in one line


class Notices:
    """Lines for people, each kind at most once a second, or once for all.

    Args:
        now: the node's own time [ns].
        report: takes a line.
    """

    def __init__(self, now: Callable[[], int], report: Callable[[str], None]) -> None:
        self._now, self._report = now, report
        self._told: dict[str, int] = {}
        self._said: deque[int] = deque(maxlen=MOST_LINES)  # when the newest lines were told [ns]
        self._untold = 0
        self._once: set[str] = set()
        self.unknown: list[str] = []
        """Names that commands gave and the robot does not have, in the order in which they came."""

    def tell(self, line: str) -> None:
        """Tell of something that happens seldom; of what happens in a flood some lines, and how many there were."""
        now = self._now()
        if len(self._said) == MOST_LINES and 0 <= now - self._said[0] < NANOSECONDS:
            self._untold += 1
            return
        self._said.append(now)
        more = f" (and {self._untold} lines more since the last one)" if self._untold else ""
        self._untold = 0
        self._report(f"{line}{more}")

    def tell_now_and_then(self, kind: str, line: str) -> None:
        """Tell of something unless something of its kind was told less than a second ago."""
        now, last = self._now(), self._told.get(kind)
        if last is None or not 0 <= now - last < NANOSECONDS:
            self._told[kind] = now
            self._report(line)

    def tell_of_limits(self, topic: str, beyond: Sequence[tuple[str, float, float, float]]) -> None:
        """Tell now and then of targets beyond limits: (joint, what it was asked for, least, greatest), [rad; m]."""
        said = [
            f"{joint} was asked for {asked:.4g}, and goes from {lower:.4g} to {upper:.4g}"
            for joint, asked, lower, upper in beyond[:_MOST_TOLD]
        ]
        more = f" (and {len(beyond) - _MOST_TOLD} more)" if len(beyond) > _MOST_TOLD else ""
        self.tell_now_and_then(f"limits {topic}", f"{topic}: kept within limits: {'; '.join(said)}{more}")

    def tell_once(self, name: str, line: str) -> None:
        """Tell of a name once."""
        if name not in self._once and len(self._once) < MOST_NAMES:
            self._once.add(name)
            self._report(line)

    def tell_of_unknown(self, topic: str, names: Mapping[str, str]) -> None:
        """Tell once of names that a command gave and that are passed over, with the reason for each; in one line."""
        told: list[str] = []
        if len(self._once) >= MOST_NAMES and len(self.unknown) >= MOST_NAMES:
            return  # whatever comes now is not kept, and a stranger's long message must not hold up the physics
        for name, why in names.items():
            said = name if len(name) <= _LONGEST else f"{name[: _LONGEST - 3]}..."
            if len(self.unknown) < MOST_NAMES and said not in self.unknown:
                self.unknown.append(said)
            key = f"{topic} {said}"
            if key not in self._once and len(self._once) < MOST_NAMES:
                self._once.add(key)
                told.append(f"{said!r} {why}")
        if told:
            more = f" and {len(told) - _MOST_TOLD} more such names" if len(told) > _MOST_TOLD else ""
            self._report(f"{topic}: {', '.join(told[:_MOST_TOLD])}{more}; passed over (told once)")
