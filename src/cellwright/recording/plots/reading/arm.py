"""The arm of a cell: where its controller wanted the joints, and where they were."""

from __future__ import annotations

import numpy as np

from cellwright.middleware.messages import from_cdr
from cellwright.middleware.messages.control_msgs import JointTrajectoryControllerState
from cellwright.recording.format.reader import RecordedMessage
from cellwright.recording.plots.reading.reader import SECOND
from cellwright.recording.plots.tracks import JointTrack

_SLIDES = "linear"  # in the names of joints that slide


class Arm:
    """Reads /ariac/arm/state."""

    topics = ("/ariac/arm/state",)

    def __init__(self) -> None:
        self._names: tuple[str, ...] = ()
        self._rows: list[tuple[float, list[float], list[float]]] = []

    def take(self, message: RecordedMessage) -> None:
        """Take the next state."""
        state = from_cdr(message.data, JointTrajectoryControllerState)
        names = tuple(state.joint_names)
        wanted, seen = (list(point.positions) for point in (state.desired, state.actual))
        self._names = self._names or names
        if names == self._names and len(wanted) == len(seen) == len(names):
            self._rows.append((message.time / SECOND, seen, wanted))

    def tracks(self) -> list[JointTrack]:
        """The joints."""
        if not self._rows:
            return []
        times = np.array([time for time, _, _ in self._rows])
        seen, wanted = (np.array([row[place] for row in self._rows]) for place in (1, 2))
        return [
            JointTrack(_plain(name), "m" if _SLIDES in name else "rad", times, seen[:, n], times, wanted[:, n])
            for n, name in enumerate(self._names)
        ]


def _plain(name: str) -> str:
    """A joint's name as one says it: `shoulder_pan_joint` is the shoulder pan."""
    return "rail" if name.startswith("linear_arm") else name.removesuffix("_joint").replace("_", " ")
