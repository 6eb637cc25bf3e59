"""Bundled policies without weights, to compare others with: one that stands, and one that moves at random."""

from collections.abc import Mapping
from typing import Final

import numpy as np
import numpy.typing as npt

from cellwright.config.control import ControlSpace
from cellwright.engine.random_streams import generator
from cellwright.util.errors import UsageError

STATE: Final = "state"
"""Key of an observation with a number for each channel of the cell, in their order."""
STREAM: Final = "random policy"
"""Name of the random stream of `random`, a child of the episode's seed."""


class Hold:
    """Answers with the state itself: the robot stands.

    Args:
        space: channels of the cell.
    """

    def __init__(self, space: ControlSpace) -> None:
        self._space = space

    def infer(self, observation: Mapping[str, object]) -> npt.NDArray[np.float64]:
        """Return the state as one action, in the channels' ranges.

        Raises:
            UsageError: the observation has no `state` with a number for each channel.
        """
        state = np.asarray(observation.get(STATE, ()))
        if state.shape != (len(self._space.channels),) or state.dtype.kind not in "fiu":
            raise UsageError(
                f"observation: the policy hold needs {STATE} with {len(self._space.channels)} numbers, one for each "
                f"channel (got {'shape ' + str(state.shape) if STATE in observation else 'none'})"
            )
        return np.array([self._space.targets(state.tolist())])


class Random:
    """Answers with a random target for each channel, uniform in its range; equal seeds give equal targets.

    Args:
        space: channels of the cell.
    """

    def __init__(self, space: ControlSpace) -> None:
        self._low = [channel.low for channel in space.channels]
        self._high = [channel.high for channel in space.channels]
        self._random = generator(0, STREAM)

    def reset(self, seed: int, sentence: str) -> None:  # noqa: ARG002 - all tasks are the same to it
        """Begin an episode with the stream of its seed."""
        self._random = generator(seed, STREAM)

    def infer(self, observation: Mapping[str, object]) -> npt.NDArray[np.float64]:  # noqa: ARG002
        """Return one action."""
        return self._random.uniform(self._low, self._high)[np.newaxis]
