"""Vector of Gymnasium of served environments: each cell has a process of its own, and all step at the same time.

envs = RemoteVectorEnv("pick_from_bin", 4, python="/opt/cellwright/bin/python")
observations, infos = envs.reset(seed=1)
observations, rewards, terminated, truncated, infos = envs.step(observations["agent_pos"])
envs.close()
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache, partial
from typing import Any

import numpy as np
from cellwright_env import EnvError, RemoteEnv
from gymnasium.spaces import Box, Dict
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space, concatenate, create_empty_array

NEW_ROLLOUT = "lerobot_new_rollout"
"""Option of `reset` with which LeRobot begins to count an episode of each environment."""


@lru_cache
def description(task: str, **options: Any) -> dict[str, Any]:
    """Return what a server says of its environment; the server ends again.

    Args:
        task: as for `RemoteEnv`.
        options: as for `RemoteEnv`, and values that can be hashed.

    Raises:
        EnvError: the server refuses, or cannot be started.
    """
    with RemoteEnv(task, **options) as env:
        return env.description


class RemoteVectorEnv(VectorEnv[Any, Any, Any]):
    """Environments of one task, each behind a server of its own; the servers start with the first `reset` or `call`.

    The step after the end of an episode begins the next one, and ignores its action (NEXT_STEP). After a reset with the
    option `lerobot_new_rollout`, an environment whose episode is over stands still instead, until the next reset. Its
    observation, flags and info stay, and its reward is 0. So an evaluation pays for no steps that it does not count.

    Args:
        task: as for `RemoteEnv`.
        num_envs: number of environments.
        options: further arguments of `RemoteEnv`, and values that can be hashed.

    Raises:
        EnvError: a server refuses or cannot be started, or an `address` has to serve several environments.
    """

    def __init__(self, task: str, num_envs: int = 1, **options: Any) -> None:
        address = options.get("address")
        if address is not None and num_envs != 1:
            raise EnvError("request", f"{address}: has one client (got {num_envs} environments); leave the address out")
        described = description(task, **options)
        self.num_envs, self.render_mode = num_envs, "rgb_array"
        self.metadata = {
            "render_modes": ["rgb_array"],
            "render_fps": max(1, round(described["rate"])),  # LeRobot's writers of videos and data sets refuse 20.0
            "autoreset_mode": AutoresetMode.NEXT_STEP,
        }
        self.single_action_space, self.single_observation_space = _spaces(described)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._made = partial(RemoteEnv, task, **options)
        self._pool = ThreadPoolExecutor(num_envs)
        self._envs: list[RemoteEnv] = []
        self._latest: list[tuple[Any, float, bool, bool, dict[str, Any]]] = []
        self._freezes = False

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode in each environment.

        Args:
            seed: seed of the first environment, and those after it for the others; or one for each.
            options: as for `RemoteEnv`.

        Raises:
            ValueError: there are more or fewer seeds than environments.
            EnvError: a server is gone, or refuses.
        """
        if seed is None or isinstance(seed, int):
            seeds = [None if seed is None else seed + number for number in range(self.num_envs)]
        else:
            seeds = [*seed]
        if len(seeds) != self.num_envs:
            raise ValueError(f"seed: must be one number, or {self.num_envs} of them (got {len(seeds)})")
        self._freezes = bool((options or {}).get(NEW_ROLLOUT))

        def begin(env: RemoteEnv, own: int | None) -> tuple[Any, float, bool, bool, dict[str, Any]]:
            observation, info = env.reset(seed=own, options=options)
            return observation, 0.0, False, False, info

        self._latest = [*self._pool.map(begin, self._started(), seeds)]
        observations, _, _, _, infos = self._batch()
        return observations, infos

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Apply an action in each environment, but for those whose episode is over; see the class.

        Args:
            actions: (n, D) numbers.

        Raises:
            ValueError: there are more or fewer actions than environments.
            EnvError: no episode has begun, or a server is gone or refuses an action.
        """
        if not self._latest:
            raise EnvError("request", "step: no episode has begun; call reset first")
        rows = np.asarray(actions)
        if len(rows) != self.num_envs:
            raise ValueError(f"actions: must be {self.num_envs} rows (got {len(rows)})")
        self._latest = [*self._pool.map(self._advanced, self._envs, rows, self._latest)]
        return self._batch()

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Return an attribute of each environment, or what its method of that name returns."""
        return tuple(self._pool.map(lambda env: _called(getattr(env, name), args, kwargs), self._started()))

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Return an attribute of each environment."""
        return tuple(getattr(env, name) for env in self._started())

    def close_extras(self, **_: Any) -> None:
        """End the servers."""
        for env in self._envs:
            env.close()
        self._pool.shutdown()

    def _started(self) -> list[RemoteEnv]:
        if not self._envs:
            starts = [self._pool.submit(self._made) for _ in range(self.num_envs)]
            failures = [each.exception() for each in starts]
            self._envs = [each.result() for each, failure in zip(starts, failures, strict=True) if failure is None]
            for failure in filter(None, failures):
                self.close()
                raise failure
        return self._envs

    def _advanced(
        self, env: RemoteEnv, action: Any, latest: tuple[Any, float, bool, bool, dict[str, Any]]
    ) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        observation, _, terminated, truncated, info = latest
        if not (terminated or truncated):
            return env.step(action)
        if self._freezes:
            return observation, 0.0, terminated, truncated, info
        observation, info = env.reset()
        return observation, 0.0, False, False, info

    def _batch(self) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        observations, rewards, terminated, truncated, own = zip(*self._latest, strict=True)
        infos: dict[str, Any] = {}
        for number, info in enumerate(own):
            infos = self._add_info(infos, info, number)
        out: Any = create_empty_array(self.single_observation_space, n=self.num_envs)
        batched: Any = concatenate(self.single_observation_space, observations, out)
        return batched, np.array(rewards), np.array(terminated), np.array(truncated), infos


def _spaces(described: dict[str, Any]) -> tuple[Box, Dict]:
    """Return the spaces of actions and observations that a server describes."""

    def numbers(each: dict[str, Any]) -> Box:
        is_picture = each["dtype"] == "uint8"
        most = 255 if is_picture else np.inf
        return Box(0 if is_picture else -most, most, tuple(each["shape"]), each["dtype"])

    spaces: dict[str, Any] = {}
    for key, each in described["observation"].items():
        is_leaf = "dtype" in each
        spaces[key] = numbers(each) if is_leaf else Dict({name: numbers(own) for name, own in each.items()})
    return Box(described["action"]["low"], described["action"]["high"], dtype=np.float32), Dict(spaces)


def _called(found: Any, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
    return found(*args, **kwargs) if callable(found) else found
