"""Requests to a served environment, and what it says of itself.

Each frame is a map of MessagePack with arrays in OpenPI's form, and each request has one reply of the same `type`:

- `hello`, which may choose another `task`: what `description` returns
- `reset` with `seed` and `options`, or without them: `observation`, `info`
- `step` with an `action`, numbers (D,): `observation`, `reward`, `terminated`, `truncated`, `info`
- `step` with a chunk, numbers (H, D), which stops where the episode is over: the same, but in place of `reward` it has
  `rewards`, one for each applied action, and `executed`, their number
- `render`: `picture`
- `close`: nothing, and the connection ends

Or the reply is an `error`: its `kind` is `request` if nothing has happened, `episode` if the episode cannot go on, and
`busy` if another client is connected.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright._package import VERSION
from cellwright.clients.policies.array_forms import OPENPI
from cellwright.clients.policies.codec import unpack
from cellwright.config.control import ControlSpace
from cellwright.config.sensors import PictureCameraConfig
from cellwright.config.trial.settings import MAX_SEED
from cellwright.config.trial.trial import Trial
from cellwright.envs.cell_env import CellEnv
from cellwright.envs.observations import AGENT_POS, ENVIRONMENT_STATE, PIXELS
from cellwright.util.errors import MessageError, one_printable_line, suggestion

PROTOCOL: Final = 1
"""Version of the protocol; a change that a client must know of raises it."""
MAX_REQUEST: Final = 2**20
"""Largest request [bytes]: a chunk of 1000 actions of 50 numbers has 0.4 MiB."""

_KEYS: Final[Mapping[str, tuple[str, ...]]] = {
    "hello": ("task",),
    "reset": ("seed", "options"),
    "step": ("action",),
    "render": (),
    "close": (),
}


@dataclass(frozen=True)
class Hello:
    """Request for what the environment is.

    Attributes:
        task: name of the task to choose; None: the present one.
    """

    task: str | None = None


@dataclass(frozen=True)
class Render:
    """Request for a picture of the whole cell."""


@dataclass(frozen=True)
class Close:
    """Request to end the connection."""


@dataclass(frozen=True)
class Reset:
    """Request for an episode.

    Attributes:
        seed: as for `CellEnv.reset`.
        options: as for `CellEnv.reset`, without `snapshot`.
    """

    seed: int | None = None
    options: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Step:
    """Request for steps.

    Attributes:
        actions: actions, one for each control period: float64, shape (H, D), H at least 1, all finite.
        is_chunk: True if they were sent as a chunk.
    """

    actions: NDArray[np.float64]
    is_chunk: bool


Request: TypeAlias = Hello | Reset | Step | Render | Close


def read_request(frame: bytes | str) -> Request:
    """Return a request as it was sent.

    Raises:
        MessageError: it is none; the error begins with its key.

    Example:
        >>> from cellwright.clients.policies.codec import pack
        >>> read_request(pack({"type": "reset", "seed": 7}, OPENPI))
        Reset(seed=7, options={})
        >>> read_request(pack({"type": "reset", "sed": 7}, OPENPI))
        Traceback (most recent call last):
        cellwright.util.errors.MessageError: reset: unknown key 'sed'; did you mean seed
    """
    if isinstance(frame, str):
        raise MessageError("a request is a binary frame of MessagePack (got text)")
    fields = unpack(frame, OPENPI)
    if not isinstance(fields, dict):
        raise MessageError(f"a request must be a map (got {type(fields).__name__})")
    kind = fields.pop("type", None)
    if not isinstance(kind, str) or kind not in _KEYS:
        raise MessageError(f"type: must be {', '.join(_KEYS)} (got {_short(kind)})")
    for key in fields:
        if key not in _KEYS[kind]:
            raise MessageError(f"{kind}: unknown key {_short(key)}{suggestion(key[:60], _KEYS[kind])}")
    match kind:
        case "hello":
            return Hello(_task(fields.get("task")))
        case "reset":
            return Reset(_seed(fields.get("seed")), _options(fields.get("options")))
        case "step":
            return _step(fields.get("action"))
    return Render() if kind == "render" else Close()


def description(env: CellEnv, trial: Trial, tasks: Sequence[str]) -> dict[str, Any]:
    """Return what an environment says of itself, as `hello` sends it.

    Args:
        env: the environment.
        trial: its trial.
        tasks: names of the tasks that a client may choose.
    """
    channels = ControlSpace.of(trial).channels
    action: Any = env.action_space
    whole: Any = env.observation_space
    spaces = whole.spaces
    units = [each.unit for each in channels]
    observed: dict[str, Any] = {AGENT_POS: {"names": [*env.agent_pos_names], "units": units, **_box(spaces[AGENT_POS])}}
    if ENVIRONMENT_STATE in spaces:
        observed[ENVIRONMENT_STATE] = {"names": [*env.environment_state_names], **_box(spaces[ENVIRONMENT_STATE])}
    if PIXELS in spaces:
        observed[PIXELS] = {name: _box(space) for name, space in spaces[PIXELS].spaces.items()}
    cameras = [each for each in trial.sensors if isinstance(each, PictureCameraConfig) and each.has_colour]
    scaled = [""] * len(channels)
    return {
        "protocol": PROTOCOL,
        "version": VERSION,
        "engine": f"MuJoCo {mujoco.__version__}",
        "task": env.task,
        "tasks": [*tasks],
        "sentence": env.task_description,
        "control": env.control,
        "rate": env.metadata["render_fps"],
        "period": env.period,
        "max_steps": env._max_episode_steps,
        "cameras": {each.name: [each.height, each.width, 3] for each in cameras},
        "action": {
            "names": [*env.agent_pos_names],
            "units": units if env.control == "absolute" else scaled,
            "low": action.low,
            "high": action.high,
            **_box(action),
        },
        "observation": observed,
    }


def _box(space: Any) -> dict[str, Any]:
    return {"shape": [*space.shape], "dtype": str(space.dtype)}


def _task(value: object) -> str | None:
    if value is not None and not isinstance(value, str):
        raise MessageError(f"hello: task: must be a name (got {_short(value)})")
    return value


def _seed(value: object) -> int | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not 0 <= value <= MAX_SEED:
        raise MessageError(f"reset: seed: must be a whole number from 0 to 2**63 - 1 (got {_short(value)})")
    return int(value)


def _options(value: object) -> dict[str, Any]:
    """Return the options; unknown ones are ignored, as in `CellEnv`, and so are values of None."""
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise MessageError(f"reset: options: must be a map (got {_short(value)})")
    options = {key: each for key, each in value.items() if each is not None}
    if "snapshot" in options:
        raise MessageError("reset: options/snapshot: cannot be sent; repeat the episode by its seed and actions")
    variation, joints = options.get("variation", True), options.get("joints", {})
    if not isinstance(variation, (bool, np.bool_)):
        raise MessageError(f"reset: options/variation: must be true or false (got {_short(variation)})")
    if not isinstance(joints, dict) or not all(_is_finite(each) for each in joints.values()):
        raise MessageError(f"reset: options/joints: must be a map of names to numbers (got {_short(joints)})")
    known: dict[str, Any] = {}
    if "variation" in options:
        known["variation"] = bool(variation)
    if joints:
        known["joints"] = {name: float(each) for name, each in joints.items()}
    return known


def _step(value: object) -> Step:
    try:
        numbers = np.asarray(value)
    except ValueError:  # rows of different lengths
        numbers = np.asarray(None)
    if numbers.dtype.kind not in "iuf" or numbers.ndim not in (1, 2) or not numbers.size:
        raise MessageError(f"step: action: must be numbers, D or a chunk of H x D (got {_short(value)})")
    actions = np.atleast_2d(numbers.astype(np.float64))
    if not np.isfinite(actions).all():
        raise MessageError("step: action: a number must be finite (got one that is not)")
    return Step(actions, numbers.ndim == 2)


def _is_finite(value: object) -> bool:
    is_number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    return is_number and math.isfinite(value)  # type: ignore[arg-type]  # a number


def _short(value: object) -> str:
    return one_printable_line(repr(value)[:60])
