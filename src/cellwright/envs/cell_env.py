"""Environment of Gymnasium for a cell with a task."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final, TypeAlias

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.effects import CompetitionState
from cellwright.cell.start import CellSnapshot
from cellwright.cell.tasks.monitor import TaskMonitor
from cellwright.config.control import ControlSpace, period_ticks
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.envs.actions import Actions, Control
from cellwright.envs.observations import Asked, Observation, Observations
from cellwright.envs.stepper import CellStepper
from cellwright.rendering.views import OVERVIEW
from cellwright.util.errors import UsageError

PICTURE_SIZE: Final = (640, 480)
"""Width and height of the pictures of `render`."""
_SEEDS = 2**31
"""Number of seeds that episodes without one are drawn from."""

Info: TypeAlias = dict[str, Any]


@dataclass(frozen=True, eq=False)
class EnvSnapshot:
    """Snapshot of an environment within an episode, from `CellEnv.snapshot` for the option `snapshot` of `reset`.

    Attributes:
        cell: the cell.
        steps: number of steps of the episode.
    """

    cell: CellSnapshot
    steps: int


class CellEnv(gymnasium.Env[Observation, NDArray[np.float32]]):
    """Environment of a trial with a task: one episode is one run, one step one control period.

    An episode is terminated by success, or when the competition is over, and truncated at the trial's time limit.
    Episodes of one seed are equal, bit for bit. The cell is built for the first reset.

    Options of `reset`: `variation`, True or False in place of the environment's own; `joints`, positions of arm joints
    [rad; m] by name; `snapshot`, an `EnvSnapshot`, to go on from there. Others are ignored.

    Args:
        trial: name or file of a trial with a task, or the trial itself.
        rate: control periods in a second [Hz].
        control: `absolute`: actions are targets in rad and m, with suction on above 0.5; `delta`: changes of them,
            scaled to ±1.
        cameras: names of the cell's colour cameras whose pictures are observed.
        privileged: True to observe `environment_state`, which no real sensor tells.
        variation: True to vary each episode by its seed, as `--vary` does.
        render_mode: `rgb_array`, or None.

    Attributes:
        task: name of the trial.
        task_description: sentence of the task.
        control: kind of its actions.
        period: control period [s].
        agent_pos_names: names of the numbers of `agent_pos` and of an action.
        environment_state_names: names of the numbers of `environment_state`.

    Raises:
        UsageError: the trial has no task or no time limit, or an argument is wrong.
        UnknownNameError: there is no such trial or camera.
        DescriptionError: the file has errors.

    Example:
        >>> env = CellEnv("pick_from_bin")
        >>> observation, info = env.reset(seed=1)
        >>> observation["agent_pos"].shape, info["is_success"]
        ((8,), False)
        >>> observation, reward, terminated, truncated, info = env.step(observation["agent_pos"])
        >>> terminated, truncated, info["time"]
        (False, False, 0.05)
        >>> env.close()
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 20.0}  # noqa: RUF012  # as in Gymnasium

    def __init__(
        self,
        trial: str | Path | Trial,
        *,
        rate: float = 20.0,
        control: Control = "absolute",
        cameras: Sequence[str] = (),
        privileged: bool = True,
        variation: bool = True,
        render_mode: str | None = None,
    ) -> None:
        self._trial = trial if isinstance(trial, Trial) else load_trial([find_trial(trial)]).trial
        if self._trial.task is None:
            raise UsageError(f"trial {self._trial.name}: there is no task; add a section `task` to its file")
        if self._trial.time_limit is None:
            raise UsageError(f"trial {self._trial.name}: an episode needs a time limit; add `time_limit` to its file")
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise UsageError(f"render_mode: must be rgb_array or None (got {render_mode!r})")
        space, timestep = ControlSpace.of(self._trial), self._trial.settings.timestep
        self.control, self.period = control, period_ticks(rate, timestep) * timestep[0] / timestep[1]
        self._rate, self._variation, self.render_mode = rate, variation, render_mode
        self.metadata = {**self.metadata, "render_fps": rate}
        self._actions = Actions(space, control, self.period)
        self._observations = Observations(self._trial, space, cameras, privileged=privileged)
        self.action_space, self.observation_space = self._actions.box, self._observations.space
        self._max_episode_steps = math.ceil(self._trial.time_limit / self.period - 1e-9)
        self.task, self.task_description = self._trial.name, self._trial.task.sentence
        self.agent_pos_names, self.environment_state_names = space.names, self._observations.state_names
        self._steps = -1

    @cached_property
    def stepper(self) -> CellStepper:
        """The stepper of the cell, with the cell itself as `stepper.cell`."""
        return CellStepper(Cell(self._trial), self._rate)

    def reset(self, *, seed: int | None = None, options: Mapping[str, Any] | None = None) -> tuple[Observation, Info]:
        """Begin an episode.

        Args:
            seed: seed of the episode, and of the seeds of the episodes after it; None: the next of these.
            options: see the class.

        Raises:
            UsageError: an option has a wrong value.
            UnknownNameError: an arm joint that does not exist.
        """
        self.begin(seed=seed, options=options)
        return self.observe(), self.info()

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, Info]:
        """Apply an action for a control period; values out of range are clipped.

        Raises:
            UsageError: it has another length, a number is not finite, or there was no reset; nothing has happened.
            SimulationError: the state has become unstable.
        """
        reward, terminated, truncated = self.advance(action)
        return self.observe(), reward, terminated, truncated, self.info()

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture of the whole cell, height × width × 3; None without `render_mode`.

        Raises:
            UsageError: nothing can be drawn.
        """
        if self.render_mode is None:
            return None
        cell = self._running().cell
        pending = cell.render_service.ask_view(cell.views[OVERVIEW], PICTURE_SIZE)
        drawn = None if pending is None else cell.render_service.fetch(pending)
        if drawn is None or drawn[0] is None:
            raise UsageError("render: no picture, since rendering has failed in this episode")
        return drawn[0]

    def snapshot(self) -> EnvSnapshot:
        """Return the whole state of the episode, for `reset(options={"snapshot": …})`; it has no effect on it."""
        return EnvSnapshot(self._running().cell.snapshot(), self._steps)

    def close(self) -> None:
        """Release the render process."""
        if "stepper" in self.__dict__:
            cell = self.stepper.cell
            cell.simulation.close()
            cell.render_service.close()  # a cell without cameras is rendered, too

    def begin(self, *, seed: int | None = None, options: Mapping[str, Any] | None = None) -> None:
        """Begin an episode as `reset` does, without observing it."""
        super().reset(seed=seed)
        options = options or {}
        cell, snapshot = self.stepper.cell, options.get("snapshot")
        if snapshot is not None:
            if not isinstance(snapshot, EnvSnapshot):
                raise UsageError(f"snapshot: must be one of `CellEnv.snapshot` (got {type(snapshot).__name__})")
            cell.restore(snapshot.cell)
            self._steps = snapshot.steps
            return
        number = int(self.np_random.integers(_SEEDS)) if seed is None else seed
        variation = options.get("variation", self._variation)
        cell.reset(seed=number, variation=variation, joints=options.get("joints") or {})
        self._steps = 0

    def advance(self, action: ArrayLike) -> tuple[float, bool, bool]:
        """Apply an action as `step` does, without observing; return reward, terminated and truncated."""
        stepper = self._running()
        stepper.step(self._actions.targets(action, stepper))
        self._steps += 1
        is_late = self._steps >= self._max_episode_steps
        is_over = stepper.cell.competition.state is CompetitionState.DONE
        terminated = self.is_success or (is_over and not is_late)
        return self._monitor.reward(), terminated, is_late and not terminated

    def observe(self) -> Observation:
        """Return the observation of now."""
        return self.ask()()

    def ask(self) -> Asked:
        """Begin to observe what is now, and return the function that waits for the pictures and returns all of it."""
        return self._observations.ask(self._running())

    def info(self) -> Info:
        """Return `is_success`, and `time`, the simulation time of the episode [s]."""
        return {"is_success": self.is_success, "time": self.stepper.cell.simulation.time}

    @property
    def is_success(self) -> bool:
        """True if the task is done now."""
        return self._monitor.success

    @property
    def _monitor(self) -> TaskMonitor:
        monitor = self._running().cell.task
        assert monitor is not None  # the trial has a task
        return monitor

    def _running(self) -> CellStepper:
        """Return the stepper; a UsageError before the first reset."""
        if self._steps < 0:
            raise UsageError("the environment has not begun an episode; call reset first")
        return self.stepper
