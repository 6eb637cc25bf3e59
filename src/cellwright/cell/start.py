"""Start of a run: the seed, the variation and the posture of the arm with which a cell begins."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from operator import index

import numpy as np

from cellwright.cell.variation import Bounds, vary
from cellwright.config.layout.arm_models import home_of, joints_of
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import Limits
from cellwright.config.trial.trial import Trial
from cellwright.engine.clock import NANOSECONDS
from cellwright.engine.random_streams import generator
from cellwright.engine.snapshot import Snapshot
from cellwright.util.errors import UnknownNameError, UsageError


@dataclass(frozen=True)
class Start:
    """Start of a run.

    Attributes:
        seed: root of all random streams.
        bounds: bounds of the variation that the seed draws; None: the trial as written.
        joints: initial positions of arm joints [rad; m for the rail], in place of the trial's.
    """

    seed: int
    bounds: Bounds | None = None
    joints: Mapping[str, float] = field(default_factory=dict)

    def changed(
        self,
        *,
        seed: int | None = None,
        variation: bool | Bounds | None = None,
        joints: Mapping[str, float] | None = None,
        limits: Mapping[str, Limits] | None = None,
    ) -> Start:
        """Return the start with other values; None keeps one.

        Args:
            seed: root of all random streams, from 0.
            variation: bounds of a variation; True for the usual ones, False for the trial as written.
            joints: initial positions of arm joints; empty for those of the trial.
            limits: joints of the arm with their limits, by name; None without an arm.

        Raises:
            UsageError: a value that no run can start with.
            UnknownNameError: an arm joint that does not exist.
        """
        found = self
        if seed is not None:
            found = replace(found, seed=_checked_seed(seed))
        if variation is not None:
            bounds = variation if isinstance(variation, Bounds) else Bounds() if variation else None
            found = replace(found, bounds=bounds)
        if joints is not None:
            found = replace(found, joints=_checked_positions(joints, limits or {}))
        return found

    def of(self, written: Trial) -> Trial:
        """Return the trial of the run.

        Args:
            written: the trial as written.

        Raises:
            UsageError: the trial has no arm for the joints, or has been varied before.
        """
        if self.joints and not written.has_arm:
            raise UsageError(f"joints: trial {written.name} has no arm; leave them out")
        trial = _begun(written, self.seed)
        if self.joints:
            trial = replace(trial, initial_joint_states={**trial.initial_joint_states, **self.joints})
        if self.bounds is None:
            return trial
        if trial.circumstances.seed is not None:
            raise UsageError(
                f"variation: trial {trial.name} is a variation already, of seed {trial.circumstances.seed}; "
                "build the cell from the trial as written"
            )
        return vary(trial, self.seed, self.bounds)


@dataclass(frozen=True, eq=False)
class CellSnapshot:
    """Snapshot of a cell in memory, from `Cell.snapshot` for `Cell.restore`.

    Attributes:
        state: state of the simulation.
        start: seed, variation and posture of the arm with which the run began.
        written: the trial as written.
        in_competition: mode of the cell.
    """

    state: Snapshot
    start: Start
    written: Trial
    in_competition: bool

    @property
    def time(self) -> float:
        """Simulation time of the run [s]."""
        return self.state.time / NANOSECONDS


def _begun(trial: Trial, seed: int) -> Trial:
    """Return the trial with the posture of its task's start, of which nothing is left to draw."""
    if trial.task is None or not (trial.task.start.joints or trial.task.start.jitter):
        return trial
    begin, limits = trial.task.start, trial.joints
    found = {**trial.initial_joint_states, **begin.joints}
    chance = generator(seed, "task/start")
    for arm in trial.arms if begin.jitter else ():
        for name, usual in home_of(arm, joints_of(arm, trial.arm_models)).items():
            key = arm.start_prefix + name
            position = found.get(key, usual) + begin.jitter * float(chance.uniform(-1.0, 1.0))
            found[key] = min(max(position, limits[key].lower), limits[key].upper)
    robots = {
        robot.name: _shifted(trial.robot_models[robot.name], begin.jitter, chance)
        for robot in (trial.layout.robots if begin.jitter else ())
    }
    task = replace(trial.task, start=replace(begin, joints={}, jitter=0.0))
    return replace(trial, initial_joint_states=found, robot_starts=robots, task=task)


def _shifted(config: RobotConfig, jitter: float, chance: np.random.Generator) -> dict[str, float]:
    """Return positions of the joints of a robot's arms, shifted from those in which a run usually begins."""
    found = {}
    for name, usual in config.start.items():
        joint = config.robot.joint(name)
        if joint.mimic is None:
            position = usual + jitter * float(chance.uniform(-1.0, 1.0))
            found[name] = min(max(position, joint.limits.lower), joint.limits.upper)
    return found


def _checked_seed(seed: int) -> int:
    try:
        number = index(seed)
    except TypeError:
        raise UsageError(f"seed must be a whole number (got {seed!r})") from None
    if number < 0:
        raise UsageError(f"seed must not be below 0 (got {number})")
    return number


def _checked_positions(joints: Mapping[str, float], limits: Mapping[str, Limits]) -> dict[str, float]:
    if not limits:
        return dict(joints)
    for name in joints:
        if name not in limits:
            raise UnknownNameError("arm joint", name, limits)
    return {name: _checked_position(name, position, limits[name]) for name, position in joints.items()}


def _checked_position(name: str, position: float, limits: Limits) -> float:
    try:
        number = float(position)
    except (TypeError, ValueError):
        raise UsageError(f"joints: {name} must be a number (got {position!r})") from None
    if not limits.lower <= number <= limits.upper:
        lower, upper = limits.lower, limits.upper
        bounds = f"±{upper:g}" if lower == -upper else f"{lower:g} to {upper:g}"
        raise UsageError(f"joints: {name} must be within the joint's limits of {bounds} (got {number:g})")
    return number
