"""Behaviour cloning as a program of the benchmark: networks that `python -m kitting train` has written, at work."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

import numpy as np

from cellwright.clients.client import Client
from cellwright.clients.policies.cell_workplace import CellWorkplace
from cellwright.middleware.messages.conversions import NANOSECONDS
from cellwright.util.errors import UsageError
from kitting.benchmark import RATE, TASKS, BenchmarkTask, Split
from kitting.clone.network import Array, Network
from kitting.clone.samples import HORIZON, Observed
from kitting.inside import cell_of

FOLDER: Final = "KITTING_CLONE"
"""Environment variable with the folder of the networks; without it they are those of the published scores."""
PUBLISHED: Final = Path(__file__).parent / "networks"
PLAYED: Final = 4
"""Number of actions of a chunk that are played before the next one."""
DIGITS: Final = 6
"""Digits of a target behind the point: another processor's last bits have no effect."""


class Clone:
    """Agent that answers what it observes with the chunks of a network; it uses the privileged state."""

    def run(self, client: Client) -> None:
        """Work until the competition is over.

        Raises:
            UsageError: the cell is in another process, or its task has no trained network.
        """
        cell = cell_of(client)
        observed, workplace = Observed(cell), CellWorkplace(client)
        network = Network.load(network_file(task_of(cell.trial.name)))
        period = NANOSECONDS // RATE
        workplace.start()
        commander = workplace.commander(period, workplace.names.space.names)
        commander.begin(observed.read()[: observed.channels])
        begin, number = client.transport.now(), 0
        while not workplace.is_over():
            for targets in chunk(network, np.array(observed.read()), observed.channels)[:PLAYED]:
                commander.send(workplace.names.space.targets(targets.tolist()))
                number += 1
                client.sleep((begin + number * period - client.transport.now()) / NANOSECONDS)


def chunk(network: Network, observation: Array, channels: int) -> Array:
    """Return the targets of a chunk, shape (`HORIZON`, C): the network answers with distances from the present."""
    distances = network.answer(observation[np.newaxis])[0].reshape(HORIZON, channels)
    found: Array = np.round(observation[:channels] + distances, DIGITS)
    return found


def task_of(trial: str) -> BenchmarkTask:
    """Return the task of a trial.

    Raises:
        UsageError: it is no trial of the benchmark.
    """
    for task in TASKS:
        if trial in (task.file(Split.TEST).stem, task.file(Split.TRAIN).stem):
            return task
    raise UsageError(f"{trial}: is no task of the benchmark; see python -m kitting tasks")


def network_file(task: BenchmarkTask, folder: Path | None = None) -> Path:
    """Return the file of the network for a task, in a folder; by default that of the environment variable."""
    chosen = Path(os.environ.get(FOLDER, "") or PUBLISHED) if folder is None else folder
    return chosen / f"{task.name}.npz"
