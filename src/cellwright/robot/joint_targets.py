"""Joint targets by name, as a sensor_msgs/JointState brings them: looked at before anything is done with them."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

from cellwright.util.errors import RejectedCommandError

MOST = 4096
"""Longer messages are refused: no robot has so many joints."""


def targets(message: Any) -> dict[str, float]:
    """Positions [rad; m] by joint name.

    Raises:
        RejectedCommandError: the message makes no sense; the text says why.
    """
    names: list[str] = message.name
    count = len(message.position)
    if len(names) > MOST or count > MOST:
        raise RejectedCommandError(f"{max(len(names), count)} entries are too many: {MOST} are the most")
    if len(names) != count:
        raise RejectedCommandError(
            f"{len(names)} names and {count} positions: as many are needed of the one as of the other"
        )
    found = dict(zip(names, message.position.tolist(), strict=True))
    if len(found) != count:
        counts = Counter(names)  # in one walk: the message is a stranger's, and physics waits
        twice = next(name for name in names if counts[name] > 1)
        raise RejectedCommandError(f"{twice!r:.80} is named twice: which of the two is meant")
    for name, position in found.items():
        if not math.isfinite(position):
            raise RejectedCommandError(f"the position of {name!r:.80} is {position}")
    return found


def statuses(message: Any, count: int) -> list[float]:
    """How far each of `count` grippers is to be closed; names count for nothing, and what is too much is cut off.

    Raises:
        RejectedCommandError: there are fewer numbers than grippers, or some are not finite.
    """
    given = len(message.position)
    if given > MOST:
        raise RejectedCommandError(f"{given} entries are too many: {MOST} are the most")
    if given < count:
        raise RejectedCommandError(f"{given} of {count} grippers: a number is needed for each, right, left")
    values: list[float] = message.position.tolist()
    if not all(map(math.isfinite, values)):
        raise RejectedCommandError(f"a gripper's status is from 0 to 1, not {values[:8]}")
    return values[:count]
