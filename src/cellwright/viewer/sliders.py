"""The sliders of a window: what somebody has moved since they were set."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Sliders:
    """One slider for each driven joint, at its target [rad; m].

    Args:
        names: of the joints.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._names = tuple(names)
        self._set: Array | None = None

    def set(self, targets: Array) -> Array:
        """Where they are to stand now [rad; m], in the order of the joints."""
        self._set = np.array(targets, dtype=float)
        return self._set

    def moved(self, now: Array) -> dict[str, float]:
        """Joints whose slider stands elsewhere than it was set to, with where it stands; none before the first time."""
        if self._set is None:
            return {}
        return {self._names[number]: float(now[number]) for number in np.flatnonzero(now != self._set)}
