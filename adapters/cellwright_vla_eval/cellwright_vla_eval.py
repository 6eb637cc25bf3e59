"""Tasks of Cellwright as a benchmark of vla-eval, `cellwright_vla_eval:Cellwright`.

The cell has a process of its own, and a Python of its own:

    benchmarks:
      - benchmark: cellwright_vla_eval:Cellwright
        episodes_per_task: 10
        params: {tasks: [pick_from_bin], seed: 1, python: /opt/cellwright/bin/python}
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from cellwright_env import EnvError, RemoteEnv
from vla_eval.benchmarks.base import StepBenchmark, StepResult
from vla_eval.specs import IMAGE_RGB, LANGUAGE, RAW, STATE_JOINT, DimSpec

_NO_LIMIT = 10**9  # steps: each episode ends at the time limit of its own task


class Cellwright(StepBenchmark):
    """Tasks of Cellwright, in simulation time: an episode waits for the policy, and no figure comes from a clock.

    An action is the targets of all channels at the end of the control period [rad; m], with suction on above 0.5. An
    observation has `images` by camera, `states`, the measured values of the channels, and `task_description`. Episode
    i of each task has the seed `seed + i`, and episodes of one seed are equal, bit for bit. The mode `live` is refused,
    because its clock is the machine's.

    Args:
        tasks: names of bundled tasks, or files of trials.
        seed: seed of the first episode of each task.
        cameras: names of the cameras whose pictures are sent.
        send_wrist_image: True to send the camera `wrist` too.
        send_state: False to send no `states`.
        privileged: True to send what no sensor tells, as `environment_state`.
        rate: control periods in a second [Hz].
        python: the Python that has Cellwright; None: this one.
        address: `ws://HOST:PORT` of a server that runs, in place of those that are started; its own options hold.
    """

    render_backends = frozenset({"cpu", "gpu"})

    def __init__(
        self,
        tasks: Sequence[str] = ("pick_from_bin",),
        *,
        seed: int = 1,
        cameras: Sequence[str] = ("overhead",),
        send_wrist_image: bool = False,
        send_state: bool = True,
        privileged: bool = False,
        rate: float = 20.0,
        python: str | None = None,
        address: str | None = None,
    ) -> None:
        super().__init__()
        self._cameras = tuple(dict.fromkeys((*cameras, "wrist") if send_wrist_image else cameras))
        self._tasks, self._seed = tuple(tasks), seed
        self._sends_state, self._privileged = send_state, privileged
        self._served: dict[str, Any] = {"rate": float(rate), "python": python, "address": address}
        self._env: RemoteEnv | None = None
        self._name, self._time = "", 0.0

    @classmethod
    def configure_render(cls, mode: str) -> dict[str, str]:  # noqa: ARG003  # as it is called
        """Change nothing: the process that draws the cell chooses for itself."""
        return {}

    def get_tasks(self) -> list[dict[str, Any]]:
        """Return the tasks."""
        return [{"name": name, "suite": "cellwright"} for name in self._tasks]

    def reset(self, task: Mapping[str, Any]) -> Any:
        """Begin an episode; a task other than the last one gets a server of its own.

        Raises:
            EnvError: the server cannot be started, is gone, or refuses.
        """
        if self._env is None or self._name != task["name"]:
            self.cleanup()
            self._env, self._name = RemoteEnv(task["name"], cameras=self._cameras, **self._served), task["name"]
        seed = self._seed + task["episode_idx"]
        observation, info = self._ask(self._env.reset, seed=seed)
        self._time = info["time"]
        return observation

    def step(self, action: Mapping[str, Any]) -> StepResult:
        """Apply an action for a control period.

        Raises:
            EnvError: no episode has begun, the server refuses the action, or is gone.
        """
        if self._env is None:
            raise EnvError("request", "step: no episode has begun; call reset first")
        numbers = np.asarray(action["actions"]).reshape(-1)
        observation, reward, terminated, truncated, info = self._ask(self._env.step, numbers)
        self._time = info["time"]
        return StepResult(obs=observation, reward=reward, done=terminated or truncated, info=info)

    def make_obs(self, raw_obs: Any, task: Mapping[str, Any]) -> dict[str, Any]:  # noqa: ARG002  # as it is called
        """Return an observation as model servers expect it."""
        assert self._env is not None  # there is an observation
        found = {"images": raw_obs.get("pixels", {}), "task_description": self._env.task_description}
        if self._sends_state:
            found["states"] = raw_obs["agent_pos"]
        if self._privileged and "environment_state" in raw_obs:
            found["environment_state"] = raw_obs["environment_state"]
        return found

    def get_step_result(self, step_result: StepResult) -> dict[str, Any]:
        """Return whether the episode has succeeded."""
        return {"success": bool(step_result.info.get("is_success", False))}

    def get_metric_keys(self) -> dict[str, str]:
        """Return how episodes are summed up: the share of successes."""
        return {"success": "mean"}

    async def get_time(self) -> float:
        """Return the simulation time of the episode [s]."""
        return self._time

    def get_metadata(self) -> dict[str, Any]:
        """Return that no episode is cut short, since each ends at the time limit of its task."""
        return {"max_steps": _NO_LIMIT}

    def get_action_spec(self) -> dict[str, DimSpec]:
        """Return the form of actions, which is no other benchmark's."""
        return {"actions": RAW}

    def get_observation_spec(self) -> dict[str, DimSpec]:
        """Return the forms of observations."""
        state = {"state": STATE_JOINT} if self._sends_state else {}
        return {**dict.fromkeys(self._cameras, IMAGE_RGB), **state, "language": LANGUAGE}

    def render(self) -> Any:
        """Return a picture of the whole cell, height x width x 3; None before the first episode."""
        return None if self._env is None else self._env.render()

    def cleanup(self) -> None:
        """Leave the server, and end it if this benchmark has started it."""
        env, self._env = self._env, None
        if env is not None:
            env.close()

    def _ask(self, request: Any, *args: Any, **kwargs: Any) -> Any:
        """Return a reply; after the loss of a server the next episode has another one."""
        try:
            return request(*args, **kwargs)
        except EnvError as error:
            if error.kind == "connection":
                self.cleanup()
            raise
