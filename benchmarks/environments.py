"""Environments for learning: control steps a second, resets, pictures, and memory of many cells in one process.

All are the environment `PickFromBin-v0` at 20 Hz: a step is 25 ticks. Actions move the arm a little in each step.
Steps with the state alone observe joints and privileged numbers, and get a shaped reward. Pictures are 84 x 84, three a
step, by the backend of this machine. Times are processor times, and wall times where pictures are drawn.

For comparison, measured apart: robosuite 1.5.2 makes 180 steps a second on one core of that machine, and a reset takes
190 ms. That is its task PickPlace with a Panda at 20 Hz, with objects observed and without pictures.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.benchmarks import BenchmarkSkippedError, Figure, OnProgress
from benchmarks.timing import best_in_turn, processor_time
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.rendering.backend import RAYS

TASK = "pick_from_bin"
STEPS, REPEATS, RESETS = 100, 5, 20
CELLS = (1, 4, 16)
LEAST, LEAST_SEEN = 2000.0, 200.0
"""Bounds of the steps a second, with the state alone and with pictures."""
SLOWEST_RESET = 5.0
"""Bound of a reset [ms]."""


def measure(on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure]:
    """Time steps and resets of one environment, then of many in one process."""
    try:
        from cellwright.envs.cell_env import CellEnv
        from cellwright.envs.vector import CellVectorEnv
    except ImportError:
        raise BenchmarkSkippedError("Gymnasium is not installed: pip install 'cellwright[gym]'") from None
    steps, repeats, resets = (4, 1, 2) if quick else (STEPS, REPEATS, RESETS)
    trial = load_trial([find_trial(TASK)]).trial
    on_progress("one environment")
    env = CellEnv(trial)
    first, _ = env.reset(seed=0)
    actions = _actions(first["agent_pos"], steps)
    (spent,) = best_in_turn(repeats, partial(processor_time, partial(_steps, env.step, actions)))
    yield Figure("steps, state alone", steps / spent, "steps/s", minimum=LEAST)
    (spent,) = best_in_turn(repeats, partial(processor_time, partial(_resets, env.reset, resets)))
    yield Figure("a reset, with another variation", spent / resets * 1e3, "ms", maximum=SLOWEST_RESET)
    on_progress("pictures")
    yield _with_pictures(trial, steps, repeats)
    for count in CELLS[:2] if quick else CELLS:
        on_progress(f"{count} cells")
        before = _resident()
        envs = CellVectorEnv(trial, count)
        with closing(envs):
            observations, _ = envs.reset(seed=0)
            taken = _actions(observations["agent_pos"], steps)
            memory = (_resident() - before) / count
            (spent,) = best_in_turn(repeats, partial(processor_time, partial(_steps, envs.step, taken)))
        label = f"{count} cells in one process" if count > 1 else "1 cell as a vector"
        yield Figure(f"{label}: steps of all", count * steps / spent, "steps/s", note=f"{memory:.1f} MiB a cell")


def _with_pictures(trial: Trial, steps: int, repeats: int) -> Figure:
    """Time steps with three pictures each, one of them a second overhead camera."""
    from cellwright.envs.cell_env import CellEnv

    overhead = next(each for each in trial.sensors if each.name == "overhead")
    with_third = replace(trial, sensors=(*trial.sensors, replace(overhead, name="second")))
    env = CellEnv(with_third, cameras=("overhead", "wrist", "second"))
    with closing(env):
        first, _ = env.reset(seed=0)
        actions = _actions(first["agent_pos"], steps)
        (spent,) = best_in_turn(repeats, partial(_wall_time, partial(_steps, env.step, actions)))
        backend = env.stepper.cell.render_service.backend
    minimum = None if backend == RAYS else LEAST_SEEN
    return Figure("steps, three pictures of 84 x 84", steps / spent, "steps/s", minimum=minimum, note=backend)


def _actions(first: Any, steps: int) -> list[Any]:
    """Return actions near a posture, of one environment or of many; suction stays off."""
    shifts = 0.05 * np.sin(0.2 * np.arange(steps)[:, None] + np.arange(first.shape[-1]))
    shifts[:, -1] = 0.0
    return [first + shift.astype(np.float32) for shift in shifts]


def _steps(step: Callable[[Any], object], actions: list[Any]) -> None:
    for action in actions:
        step(action)


def _resets(reset: Callable[..., object], count: int) -> None:
    for seed in range(count):
        reset(seed=seed)


def _wall_time(work: Callable[[], object]) -> float:
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def _resident() -> float:
    """Return this process's memory [MiB]."""
    with open("/proc/self/status", encoding="ascii") as status:
        return next(int(line.split()[1]) / 1024 for line in status if line.startswith("VmRSS"))
