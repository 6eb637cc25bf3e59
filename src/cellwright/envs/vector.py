"""Many cells in one process, under the interface of Gymnasium's vectors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from gymnasium.vector import SyncVectorEnv
from gymnasium.vector.utils import concatenate, create_empty_array
from numpy.typing import ArrayLike, NDArray

from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.envs.cell_env import CellEnv, Info
from cellwright.envs.observations import Asked, Observation
from cellwright.util.errors import UsageError

NEW_ROLLOUT: Final = "lerobot_new_rollout"
"""Option of `reset` with which LeRobot begins to count an episode of each environment."""
_MASK = "reset_mask"


class CellVectorEnv(SyncVectorEnv):
    """Environments of one trial, in one process, one after the other; one render process draws for all meanwhile.

    The step after the end of an episode begins the next one, and ignores its action (NEXT_STEP). After a reset with the
    option `lerobot_new_rollout`, an environment whose episode is over stands still instead, until the next reset. Its
    observation, flags and info stay, and its reward is 0. So an evaluation pays for no steps that it does not count.

    Args:
        trial: as for `CellEnv`.
        num_envs: number of environments.
        options: further arguments of `CellEnv`.

    Raises:
        UsageError: as `CellEnv` does, or there are no environments.

    Example:
        >>> envs = CellVectorEnv("pick_from_bin", num_envs=2)
        >>> observations, infos = envs.reset(seed=1)
        >>> observations["agent_pos"].shape, infos["is_success"].tolist()
        ((2, 8), [False, False])
        >>> envs.close()
    """

    def __init__(self, trial: str | Path | Trial, num_envs: int = 1, **options: Any) -> None:
        if num_envs < 1:
            raise UsageError(f"num_envs: must be at least 1 (got {num_envs})")
        loaded = trial if isinstance(trial, Trial) else load_trial([find_trial(trial)]).trial
        super().__init__([partial(CellEnv, loaded, **options)] * num_envs)
        self._cells = [each for each in self.envs if isinstance(each, CellEnv)]
        self._latest: dict[int, Observation] = {}
        self._infos: dict[int, Info] = {}
        self._ended = np.zeros(num_envs, dtype=np.bool_)
        self._freezes = False

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, Info]:
        """Begin an episode in each environment, or in those of the option `reset_mask`.

        Args:
            seed: seed of the first environment, and those after it for the others; or one for each.
            options: as for `CellEnv`.

        Raises:
            UsageError: the seeds or the mask do not fit, or an option has a wrong value.
        """
        others = dict(options or {})
        chosen = self._chosen(others.pop(_MASK, None))
        self._freezes = bool(others.get(NEW_ROLLOUT))
        asked: dict[int, Asked] = {}
        for number, own in zip(range(self.num_envs), self._seeds(seed), strict=True):
            if number in chosen:
                self._cells[number].begin(seed=own, options=others)
                asked[number] = self._cells[number].ask()
        self._ended[chosen] = self._terminations[chosen] = self._truncations[chosen] = False
        return self._observed(asked, chosen)

    def step(
        self, actions: ArrayLike
    ) -> tuple[Observation, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Info]:
        """Apply an action in each environment, but for those whose episode is over; see the class.

        Raises:
            UsageError: an action has another length, or a number is not finite.
            SimulationError: the state of a cell has become unstable.
        """
        rows = np.asarray(actions, dtype=np.float64)
        if rows.shape != self.action_space.shape:
            raise UsageError(f"actions: must have the shape {self.action_space.shape} (got {rows.shape})")
        asked: dict[int, Asked] = {}
        self._rewards[:] = 0.0
        for number, env in enumerate(self._cells):
            if self._ended[number] and self._freezes:
                continue
            terminated = truncated = False
            if self._ended[number]:
                env.begin()
            else:
                self._rewards[number], terminated, truncated = env.advance(rows[number])
            self._terminations[number], self._truncations[number] = terminated, truncated
            asked[number] = env.ask()  # drawn while the next ones step
        self._ended = self._terminations | self._truncations
        observations, infos = self._observed(asked, range(self.num_envs))
        return observations, self._rewards.copy(), self._terminations.copy(), self._truncations.copy(), infos

    def _observed(self, asked: Mapping[int, Asked], reported: Iterable[int]) -> tuple[Observation, Info]:
        """Return the observations of all, with those awaited that were asked for, and the infos of those to tell of."""
        for number, awaited in asked.items():
            self._latest[number], self._infos[number] = awaited(), self._cells[number].info()
        infos: Info = {}
        for number in reported:
            infos = self._add_info(infos, self._infos[number], number)
        out: Any = create_empty_array(self.single_observation_space, n=self.num_envs, fn=np.zeros)
        latest = [self._latest[number] for number in range(self.num_envs)]
        observations: Any = concatenate(self.single_observation_space, latest, out)
        return observations, infos

    def _chosen(self, mask: Any) -> list[int]:
        """Return the numbers of the environments that a mask chooses; all without one."""
        if mask is None:
            return [*range(self.num_envs)]
        if not self._latest:
            raise UsageError(f"{_MASK}: the first reset is one of all environments; leave it out")
        mask = np.asarray(mask)
        if mask.shape != (self.num_envs,) or mask.dtype != np.bool_ or not mask.any():
            raise UsageError(
                f"{_MASK}: must be {self.num_envs} booleans, one of them True (got {mask.dtype} {mask.tolist()})"
            )
        return [int(each) for each in np.flatnonzero(mask)]

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int):
            return [seed + number for number in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise UsageError(
                f"seed: must be one number, or one for each of {self.num_envs} environments (got {len(seed)})"
            )
        return [*seed]
