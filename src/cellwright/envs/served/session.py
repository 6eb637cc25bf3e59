"""Session of a served environment: requests in, replies out; time passes only in a step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cellwright.clients.policies.array_forms import OPENPI
from cellwright.clients.policies.codec import pack
from cellwright.config.trial.catalogue import bundled_tasks, find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.envs.actions import Control
from cellwright.envs.cell_env import CellEnv
from cellwright.envs.served.protocol import Close, Hello, Render, Request, Reset, Step, description, read_request
from cellwright.util.errors import CellwrightError, MessageError, UnknownNameError, UsageError


@dataclass(frozen=True)
class Reply:
    """Reply to a request.

    Attributes:
        frame: its bytes.
        is_last: True if the connection ends with it.
    """

    frame: bytes
    is_last: bool = False


class EpisodeError(CellwrightError):
    """The episode cannot go on; another one can begin."""


class EnvSession:
    """An environment that replies to requests, one after the other. Its errors are replies too.

    Args:
        trial: trial with a task; a client may choose a bundled one instead, and this again.
        rate: as for `CellEnv`, and so are the others.

    Raises:
        UsageError: as for `CellEnv`.
        UnknownNameError: there is no such camera.

    Example:
        >>> from cellwright.clients.policies.codec import unpack
        >>> session = EnvSession(load_trial([find_trial("pick_from_bin")]).trial)
        >>> unpack(session.reply(pack({"type": "hello"}, OPENPI)).frame, OPENPI)["sentence"]
        'Pick up a gear from the bin.'
        >>> unpack(session.reply(pack({"type": "step", "action": [0.0]}, OPENPI)).frame, OPENPI)["error"]
        'step: no episode has begun, or it is over; send reset first'
    """

    def __init__(
        self,
        trial: Trial,
        *,
        rate: float = 20.0,
        control: Control = "absolute",
        cameras: Sequence[str] = (),
        privileged: bool = True,
    ) -> None:
        self._options: dict[str, Any] = {"rate": rate, "control": control, "cameras": tuple(cameras)}
        self._options["privileged"] = privileged
        self._given = self._trial = trial
        self._env = self._made(trial)
        self._has_begun = self._is_on = self._is_ending = False

    def forget(self) -> None:
        """End the episode: the next client begins its own, and sees nothing of this one."""
        self._has_begun = self._is_on = False

    def end(self) -> None:
        """Let a chunk that runs in another thread stop after its present action."""
        self._is_ending = True

    def close(self) -> None:
        """Release the environment."""
        self._env.close()

    def reply(self, frame: bytes | str) -> Reply:
        """Do what a request wants, and return the reply."""
        try:
            request = read_request(frame)
            done = self._done(request)
        except EpisodeError as error:
            return error_reply("episode", str(error))
        except CellwrightError as error:
            return error_reply("request", str(error))
        frame = pack({"type": type(request).__name__.lower(), **done}, OPENPI)
        return Reply(frame, isinstance(request, Close))

    def _done(self, request: Request) -> dict[str, Any]:
        match request:
            case Hello(task):
                self._choose(task)
                return description(self._env, self._trial, self._tasks())
            case Reset():
                return self._reset(request)
            case Step():
                return self._step(request)
            case Render():
                if not self._has_begun:
                    raise UsageError("render: no episode has begun; send reset first")
                return {"picture": self._env.render()}
            case Close():
                return {}

    def _reset(self, request: Reset) -> dict[str, Any]:
        self._env.begin(seed=request.seed, options=request.options)
        self._is_on = False
        reply = self._observed()
        self._has_begun = self._is_on = True
        return reply

    def _step(self, request: Step) -> dict[str, Any]:
        if not self._is_on:
            raise UsageError("step: no episode has begun, or it is over; send reset first")
        size = len(self._env.agent_pos_names)
        if request.actions.shape[1] != size:
            raise MessageError(f"step: action: must have {size} numbers (got {request.actions.shape[1]})")
        rewards: list[float] = []
        terminated = truncated = self._is_on = False
        try:
            for action in request.actions:
                reward, terminated, truncated = self._env.advance(action)
                rewards.append(reward)
                if terminated or truncated or self._is_ending:
                    break
        except CellwrightError as error:
            raise EpisodeError(f"step: {error}; begin another episode") from None
        reply = {"terminated": terminated, "truncated": truncated, **self._observed()}
        self._is_on = not (terminated or truncated)
        if request.is_chunk:
            return reply | {"rewards": np.array(rewards), "executed": len(rewards)}
        return reply | {"reward": rewards[0]}

    def _observed(self) -> dict[str, Any]:
        try:
            return {"observation": self._env.observe(), "info": self._env.info()}
        except CellwrightError as error:
            raise EpisodeError(f"observation: {error}") from None

    def _choose(self, task: str | None) -> None:
        """Change to another task; a name alone, so that no client reads files."""
        if task in (None, self._trial.name):
            return
        if task not in self._tasks():
            raise UnknownNameError("task", str(task)[:60], self._tasks())
        trial = self._given if task == self._given.name else load_trial([find_trial(task)]).trial
        made = self._made(trial)
        self._env.close()
        self._env, self._trial = made, trial
        self.forget()

    def _tasks(self) -> list[str]:
        return [*dict.fromkeys((self._given.name, *bundled_tasks()))]

    def _made(self, trial: Trial) -> CellEnv:
        return CellEnv(trial, render_mode="rgb_array", **self._options)


def error_reply(kind: str, text: str) -> Reply:
    """Return the reply that says what is wrong."""
    return Reply(pack({"type": "error", "kind": kind, "error": "; ".join(text.splitlines())}, OPENPI))
