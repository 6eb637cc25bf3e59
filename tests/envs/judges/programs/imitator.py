"""Policy of the judges, with NumPy alone: does what was shown in the episode that began most like this one."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np


class Imitator:
    """Policy that repeats the demonstration whose start is nearest, and then holds its last action.

    Args:
        path: demonstrations: `starts` (n, k), the observations that they began with, and `actions` (n, steps, D).

    Attributes:
        seen: for each episode that is over its steps, and a digest of the observations that were acted upon.
    """

    def __init__(self, path: Path | str) -> None:
        with np.load(path) as shown:
            self._starts, self._actions = shown["starts"], shown["actions"]
        self.seen: list[tuple[int, str]] = []
        self._steps = 0
        self.begin()

    def begin(self) -> None:
        """Begin an episode; the last one is over."""
        self.end()
        self._steps, self._hash = 0, hashlib.sha256()
        self._plan = self._actions[0]

    def act(self, agent_pos: Any, environment_state: Any, sentence: str) -> Any:
        """Return the action for an observation: float32, (D,)."""
        observed = np.concatenate([np.asarray(agent_pos, np.float32), np.asarray(environment_state, np.float32)])
        self._hash.update(observed.tobytes() + sentence.encode())
        if not self._steps:
            distances = np.linalg.norm(self._starts - observed, axis=1)
            self._plan = self._actions[int(distances.argmin())]
        action = self._plan[min(self._steps, len(self._plan) - 1)]
        self._steps += 1
        return action.copy()

    def end(self) -> None:
        """End the episode, if there is one."""
        if self._steps:
            self.seen.append((self._steps, self._hash.hexdigest()))
        self._steps = 0
