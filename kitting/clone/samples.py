"""Samples of demonstrations: what was observed at a control instant, and the targets of the periods that followed."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellwright.cell.cell import Cell
from cellwright.config.control import SUCTION_ON, ControlSpace
from cellwright.config.trial.trial import Trial
from cellwright.envs.privileged import PrivilegedState
from cellwright.envs.stepper import CellStepper
from cellwright.recording.dataset.frames import frame_instants
from cellwright.recording.dataset.outcomes import Outcomes
from cellwright.recording.dataset.readings import readings_of
from cellwright.recording.format.reader import RecordingFile
from cellwright.util.errors import UsageError
from kitting.benchmark import RATE

HORIZON: Final = 8
"""Number of actions in a chunk: 0.4 s."""
STILL: Final = 2e-3
"""Change [rad; m] below which nothing has moved between two control instants."""

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Demonstration:
    """Observations and targets of a run, by control periods.

    Attributes:
        observations: numbers of `Observed.read` at the begin of each period, shape (T, D).
        targets: targets of the channels at its end, shape (T, C).
        is_success: True if the task has succeeded.
    """

    observations: Array
    targets: Array
    is_success: bool


class Observed:
    """Observation of a clone: the measured channels of a cell, then the privileged state of its task.

    Args:
        cell: the cell.

    Attributes:
        channels: number of channels.
        names: names of the numbers.

    Raises:
        UsageError: the trial has no task.
    """

    def __init__(self, cell: Cell) -> None:
        if cell.trial.task is None:
            raise UsageError(f"{cell.trial.name}: there is no task; add a section task to its file")
        self._cell, self._stepper = cell, CellStepper(cell, RATE)
        self._state = PrivilegedState(cell.trial, cell.trial.task)
        self.channels = len(self._stepper.space.channels)
        self.names = names_of(cell.trial)

    def read(self) -> list[float]:
        """Return the numbers of now."""
        return [*self._stepper.read(), *self._state.read(self._cell)]


def names_of(trial: Trial) -> tuple[str, ...]:
    """Return the names of what a clone observes in a trial with a task."""
    assert trial.task is not None
    return (*ControlSpace.of(trial).names, *PrivilegedState(trial, trial.task).names)


def read_demonstration(path: Path) -> Demonstration:
    """Return what happened in a recorded run of a task; the run is repeated from its commands.

    Raises:
        RecordingError: the recording is truncated, or its run differs here.
        UsageError: it is none of a cell with a task.
    """
    observations: list[list[float]] = []
    targets: list[list[float]] = []
    is_success = False
    with RecordingFile(path) as recording, closing(frame_instants(recording, RATE)) as instants:
        cell = next(instants, None)
        if not isinstance(cell, Cell):
            raise UsageError(f"{path}: is no recording of a cell with a task; record one by demonstrate")
        observed, readings, outcomes = Observed(cell), readings_of(cell, RATE), Outcomes(cell)
        observations.append(observed.read())
        for _ in instants:
            targets.append(readings.executed())
            outcome = outcomes.read()
            is_success = outcome.is_success
            if outcome.is_over:
                break
            observations.append(observed.read())
    if not targets:
        raise UsageError(f"{path}: the run is shorter than a tick; record a longer one")
    return Demonstration(np.array(observations[: len(targets)]), np.array(targets), is_success)


def chunks_of(demonstrations: Iterable[Demonstration]) -> tuple[Array, Array]:
    """Return observations and the chunks to be answered, of all demonstrations that succeeded.

    Periods in which nothing changes are left out, see `moving`: a policy that sees one instant at a time would learn to
    wait in them for ever. After the last period its target is repeated.

    Returns:
        Observations, shape (N, D), and chunks, shape (N, `HORIZON`, C).

    Raises:
        UsageError: no demonstration succeeded.
    """
    inputs: list[Array] = []
    outputs: list[Array] = []
    for each in demonstrations:
        if not each.is_success:
            continue
        kept = moving(each)
        observations, targets = each.observations[kept], each.targets[kept]
        places = np.minimum(np.arange(len(kept))[:, np.newaxis] + np.arange(HORIZON), len(kept) - 1)
        inputs.append(observations)
        outputs.append(targets[places])
    if not inputs:
        raise UsageError("demonstrations: none has succeeded; record others")
    return np.concatenate(inputs), np.concatenate(outputs)


def moving(demonstration: Demonstration) -> NDArray[np.intp]:
    """Return the places of the periods to learn from: the first, and those in which something changes or is gripped.

    The arm stands still for a while as it grips; without that, a policy learns to rise without the part. The last
    channel is the suction.
    """
    observations, targets = demonstration.observations, demonstration.targets
    changes = [np.abs(np.diff(each, axis=0, prepend=each[:1] + 1.0)).max(axis=1) for each in (observations, targets)]
    return np.flatnonzero((np.maximum(*changes) > STILL) | (targets[:, -1] > SUCTION_ON))
