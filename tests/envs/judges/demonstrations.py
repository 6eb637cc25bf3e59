"""Demonstrations for the policy of the judges, and what it comes to in our own environment."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cellwright.envs.cell_env import CellEnv
from cellwright.motion import Joints, arm_frame, solve, tool_down
from cellwright.util.pose import Pose
from tests.envs.judges.programs.imitator import Imitator

PICK = "pick_from_bin"
"""The task that an expert demonstrates, in every other episode; all others show a seeded walk about the start."""

_ABOVE, _BELOW, _LIFT = 0.1, -0.02, 0.2  # heights of the cup's face over the part's origin [m]
_FAST, _SLOW = 0.04, 0.008  # most that a joint turns in a period [rad]
_DWELL, _WALK = 8, 30  # [periods]: at each height, and of a walk


@dataclass(frozen=True)
class Episode:
    """Outcome of an episode.

    Attributes:
        success: True if it succeeded.
        steps: number of its steps.
        time: simulation time at its end [s].
        digest: digest of all observations but the last one.
    """

    success: bool
    steps: int
    time: float
    digest: str


def demonstrate(task: str, seeds: Iterable[int], path: Path) -> None:
    """Write a demonstration of a task for each seed.

    Args:
        task: name of the task.
        seeds: seeds of the episodes.
        path: file for `Imitator`.
    """
    starts, plans = [], []
    with closing(CellEnv(task)) as env:
        for number, seed in enumerate(seeds):
            observation, _ = env.reset(seed=seed)
            starts.append(np.concatenate([observation["agent_pos"], observation["environment_state"]]))
            shows = task == PICK and number % 2 == 0
            plans.append(_picked(env, observation) if shows else _walked(env, observation, seed))
    length = max(map(len, plans))
    actions = [np.pad(plan, ((0, length - len(plan)), (0, 0)), mode="edge") for plan in plans]
    np.savez(path, starts=np.array(starts, np.float32), actions=np.array(actions, np.float32))


def evaluate(task: str, seeds: Sequence[int], path: Path) -> list[Episode]:
    """Return what the imitator comes to in our own environment, seed by seed."""
    policy, found = Imitator(path), []
    with closing(CellEnv(task)) as env:
        for seed in seeds:
            observation, _ = env.reset(seed=seed)
            policy.begin()
            is_over = False
            while not is_over:
                action = policy.act(observation["agent_pos"], observation["environment_state"], env.task_description)
                observation, _, terminated, truncated, info = env.step(action)
                is_over = terminated or truncated
            policy.end()
            found.append(Episode(info["is_success"], policy.seen[-1][0], info["time"], policy.seen[-1][1]))
    return found


def _picked(env: CellEnv, observation: dict[str, Any]) -> Any:
    """Return the actions of an expert, which knows the arm: over the part, down until it is held, and up."""
    plan: list[Any] = []
    names = env.environment_state_names
    posture = observation["agent_pos"][:-1].astype(np.float64)

    def state(prefix: str) -> Pose:
        at = names.index(f"{prefix}.x")
        numbers = observation["environment_state"][at : at + 7].astype(float).tolist()
        return Pose(tuple(numbers[:3]), tuple(numbers[3:]))

    world_T_arm = arm_frame(env.stepper.cell.trial.arms[0].mount.pose)
    part = (state("tool") @ state("gear_part")).position
    for height, step, suction in ((_ABOVE, _FAST, 0.0), (_BELOW, _SLOW, 1.0), (_LIFT, _FAST, 1.0)):
        pose = world_T_arm.inverse() @ tool_down(*part[:2], part[2] + height)
        goal = np.array(solve(pose, Joints(*posture.tolist()), rail=float(posture[0])))
        first, count = posture, int(np.abs(goal - posture).max() / step) + 1
        for number in range(1, count + _DWELL):
            posture = first + min(1.0, number / count) * (goal - first)
            plan.append(np.append(posture, suction).astype(np.float32))
            observation, _, terminated, truncated, _ = env.step(plan[-1])
            if terminated or truncated:
                return np.array(plan)
            if height == _BELOW and observation["environment_state"][names.index("holds")]:
                break
    return np.array(plan)


def _walked(env: CellEnv, observation: dict[str, Any], seed: int) -> Any:
    """Return the actions of a seeded walk about the start, within the bounds."""
    moves = np.random.default_rng(seed).uniform(-0.02, 0.02, (_WALK, len(observation["agent_pos"])))
    low, high = env.action_space.low, env.action_space.high  # type: ignore[attr-defined]  # a box
    return np.clip(observation["agent_pos"] + moves.cumsum(axis=0), low, high).astype(np.float32)
