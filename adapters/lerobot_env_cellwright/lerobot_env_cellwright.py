"""Tasks of Cellwright for LeRobot: `lerobot-eval --env.type=cellwright`.

LeRobot imports this module by the name of its distribution. The cell has a process of its own, and a Python of its own:

    lerobot-eval --env.type=cellwright --env.task=pick_from_bin --env.python=/opt/cellwright/bin/python …
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from cellwright_vector import RemoteVectorEnv, description
from lerobot.configs.types import FeatureType, PolicyFeature
from lerobot.envs.configs import EnvConfig

_STATES = {"agent_pos": "observation.state", "environment_state": "observation.environment_state"}


@EnvConfig.register_subclass("cellwright")
@dataclass
class CellwrightEnv(EnvConfig):
    """A task of Cellwright as an environment of LeRobot.

    Features are those that the server describes: `action`, `agent_pos`, `environment_state` and, for each camera,
    `observation.images.NAME`. A feature of the policy is the same under LeRobot's name.

    Attributes:
        task: name of a bundled task, or a trial's file.
        fps: control periods in a second [Hz].
        control: `absolute`: actions are targets in rad and m, with suction on above 0.5; `delta`: changes of them from
            -1 to 1, with suction on above 0.
        cameras: names of the cameras whose pictures are observed, such as `overhead,wrist`.
        python: the Python that has Cellwright; None: the one that LeRobot runs in.
        address: `ws://HOST:PORT` of a server that runs, in place of one that is started; its own options hold.

    Raises:
        EnvError: there is no server, it cannot be started, or it refuses.
    """

    task: str | None = "pick_from_bin"
    fps: int = 20
    control: str = "absolute"
    cameras: str = ""
    python: str | None = None
    address: str | None = None

    def __post_init__(self) -> None:
        """Ask the server for the features."""
        described = description(str(self.task), **self._options)
        self.fps = round(described["rate"])
        self.features: dict[str, PolicyFeature] = {}
        self.features_map: dict[str, str] = {}
        self._add("action", FeatureType.ACTION, described["action"], "action")
        for key, each in described["observation"].items():
            if key == "pixels":
                for name, own in each.items():
                    self._add(f"observation.images.{name}", FeatureType.VISUAL, own, f"observation.images.{name}")
            else:
                kind = FeatureType.STATE if key == "agent_pos" else FeatureType.ENV
                self._add(key, kind, each, _STATES[key])

    @property
    def gym_kwargs(self) -> dict[str, Any]:
        """None: `create_envs` makes the environments."""
        return {}

    def create_envs(self, n_envs: int, use_async_envs: bool = False) -> dict[str, dict[int, RemoteVectorEnv]]:  # noqa: ARG002, FBT001  # as LeRobot calls it
        """Return the environments by suite and number; each is a process, so all run at the same time either way."""
        return {str(self.task): {0: RemoteVectorEnv(str(self.task), n_envs, **self._options)}}

    @property
    def _options(self) -> dict[str, Any]:
        cameras = tuple(each.strip() for each in self.cameras.split(",") if each.strip())
        served = {"rate": float(self.fps), "control": self.control, "cameras": cameras}
        return {"python": self.python, "address": self.address, **served}

    def _add(self, name: str, kind: FeatureType, described: dict[str, Any], policy_name: str) -> None:
        self.features[name] = PolicyFeature(type=kind, shape=tuple(described["shape"]))
        self.features_map[name] = policy_name
