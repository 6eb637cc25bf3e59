"""Tasks of Cellwright for inspect-robots: `inspect-robots run --task cellwright --embodiment cellwright …`.

The cell has a process of its own, and a Python of its own. Both the task and the embodiment name it, with
`-T python=/opt/cellwright/bin/python` and `-E python=/opt/cellwright/bin/python`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from cellwright_env import RemoteEnv
from inspect_robots.embodiment import PRIVILEGED_SUCCESS, RESETTABLE, SEEDABLE, EmbodimentInfo
from inspect_robots.scene import Scene
from inspect_robots.spaces import ActionSemantics, Box, CameraSpec, ObservationSpace, StateField, StateSpec
from inspect_robots.task import Task
from inspect_robots.types import Action, Observation, StepResult

STATE = "joint_pos"
"""Name of the state with the measured value of each number of an action."""
_TASK = "cellwright_task"  # in the metadata of a scene


class Cellwright:
    """A task of Cellwright as an embodiment, in simulation time: steps take no longer than the machine needs.

    An action is the targets of all channels at the end of the control period [rad; m], with suction on above 0.5. The
    state `joint_pos` has their measured values. A success terminates an episode, and the trial's time limit truncates
    it. Episodes of one seed are equal, bit for bit. The limits of a step, which inspect-robots derives, are the whole
    ranges: its guardrails change no action that is within the bounds.

    Args:
        task: name of a bundled task, or a trial's file.
        python: the Python that has Cellwright; None: this one.
        address: `ws://HOST:PORT` of a server that runs, in place of one that is started; its own options hold.
        rate: control periods in a second [Hz].
        cameras: names of the cameras whose pictures are observed, such as `overhead,wrist`.
        privileged: True to give the policy what no sensor tells, as `extra["environment_state"]`.

    Attributes:
        info: the description that inspect-robots checks.

    Raises:
        EnvError: there is no server, it cannot be started, or it refuses.
        ValueError: the server has other actions than absolute ones.
    """

    def __init__(
        self,
        task: str = "pick_from_bin",
        *,
        python: str | None = None,
        address: str | None = None,
        rate: float = 20.0,
        cameras: str = "",
        privileged: bool = False,
    ) -> None:
        names = [each.strip() for each in cameras.split(",") if each.strip()]
        self._env = RemoteEnv(task, python=python, address=address, rate=float(rate), cameras=names)
        self._privileged, self._instruction = privileged, self._env.task_description
        try:
            self.info = _info(self._env.description)
        except BaseException:
            self._env.close()
            raise

    def reset(self, scene: Scene, *, seed: int | None = None) -> Observation:
        """Begin an episode.

        Args:
            scene: its instruction is observed. A scene of `task` must be of the embodiment's own task.
            seed: seed of the episode, as inspect-robots derives it from its own seed, the scene's and the epoch.

        Raises:
            EnvError: the server is gone.
            ValueError: the scene is of another task.
        """
        wanted = scene.metadata.get(_TASK, self._env.task)
        if wanted != self._env.task:
            raise ValueError(f"scene {scene.id}: is of task {wanted} (got {self._env.task}); give -E task={wanted}")
        self._instruction = scene.instruction
        observation, info = self._env.reset(seed=seed)
        return self._observed(observation, info)

    def step(self, action: Action) -> StepResult:
        """Apply an action for a control period.

        Raises:
            EnvError: no episode has begun, it is over, or the server is gone.
        """
        observation, reward, terminated, truncated, info = self._env.step(np.asarray(action.data).reshape(-1))
        reason = ("success" if info["is_success"] else "failure") if terminated else None
        return StepResult(
            observation=self._observed(observation, info),
            reward=reward,
            terminated=terminated,
            termination_reason=reason,
            truncated=truncated,
            info=info,
        )

    def close(self) -> None:
        """Leave the server, and end it if this embodiment has started it."""
        self._env.close()

    def _observed(self, observation: dict[str, Any], info: dict[str, Any]) -> Observation:
        images = observation.get("pixels", {})
        key = "environment_state"
        return Observation(
            images=images,
            state={STATE: observation["agent_pos"]},
            instruction=self._instruction,
            image_times=dict.fromkeys(images, info["time"]),
            state_time=info["time"],
            extra={key: observation[key]} if self._privileged and key in observation else {},
        )


def task(
    task: str = "pick_from_bin",
    *,
    episodes: int = 10,
    seed: int = 1,
    python: str | None = None,
    address: str | None = None,
) -> Task:
    """Return a task of Cellwright with a scene for each episode; success at its end is the score.

    Args:
        task: name of a bundled task, or a trial's file.
        episodes: number of scenes.
        seed: seed of the first scene; each of the others has the next one.
        python: as for `Cellwright`.
        address: as for `Cellwright`.

    Raises:
        EnvError: there is no server, it cannot be started, or it refuses.
    """
    with RemoteEnv(task, python=python, address=address) as env:
        name, sentence, described = env.task, env.task_description, env.description
    scenes = [
        Scene(id=f"{name}-{number}", instruction=sentence, init_seed=number, metadata={_TASK: name})
        for number in range(seed, seed + episodes)
    ]
    limit = described["max_steps"] * described["period"]
    return Task(name=f"cellwright/{name}", scenes=scenes, scorer="success_at_end", max_seconds=limit)


def _info(described: dict[str, Any]) -> EmbodimentInfo:
    """Return what a server says of its environment in the words of inspect-robots."""
    if described["control"] != "absolute":
        raise ValueError(f"control: must be absolute (got {described['control']}); start the server with it")
    action = described["action"]
    names, shape = tuple(action["names"]), tuple(action["shape"])
    low, high = (np.asarray(action[end], np.float64) for end in ("low", "high"))
    kinds = {name.rpartition("/")[2] for name in names}
    gripper: Any = "binary" if "suction" in kinds else "continuous" if "width" in kinds else "none"
    whole = tuple(each or None for each in (high - low).tolist())  # a channel that cannot move has no limit
    semantics = ActionSemantics("joint_pos", gripper=gripper, dim_labels=names, max_step=whole)
    pictures = described["observation"].get("pixels", {})
    return EmbodimentInfo(
        name=f"cellwright/{described['task']}",
        action_space=Box(shape, low, high, semantics),
        observation_space=ObservationSpace(
            cameras=tuple(CameraSpec(name, *each["shape"]) for name, each in pictures.items()),
            state=StateSpec((StateField(STATE, shape, unit="rad", dtype="float32"),)),
        ),
        control_hz=described["rate"],
        is_simulated=True,
        capabilities=frozenset({SEEDABLE, RESETTABLE, PRIVILEGED_SUCCESS}),
        docs=_notes(names, action["units"], low, high),
    )


def _notes(names: tuple[str, ...], units: list[str], low: Any, high: Any) -> str:
    """Return what a policy that reads text should know of the numbers of an action."""
    lines = [
        f"- `{name}`: {least:g} to {most:g} {unit}".rstrip()
        for name, unit, least, most in zip(names, units, low, high, strict=True)
    ]
    lead = "An action is a target for each channel at the end of the control period; suction is on above 0.5."
    return "\n".join([lead, "", *lines])
