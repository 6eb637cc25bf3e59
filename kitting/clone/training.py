"""Training of a clone from the recordings of demonstrations."""

from __future__ import annotations

import signal
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Final

import numpy as np

from cellwright.running.evaluation.execution.process import usable_processors
from kitting.clone.network import Array, Network, train
from kitting.clone.samples import Demonstration, chunks_of, read_demonstration

STEPS: Final = 4000
"""Steps of training of a task."""
SEED: Final = 1
"""Seed of weights, batches and noise."""


@dataclass(frozen=True, slots=True)
class Trained:
    """Result of a training.

    Attributes:
        network: the network.
        demonstrations: number of demonstrations that succeeded, and that it learned from.
        samples: number of samples.
        error: mean squared error of the last steps, in the scale of the answers.
    """

    network: Network
    demonstrations: int
    samples: int
    error: float


def train_clone(
    recordings: Sequence[Path],
    steps: int = STEPS,
    seed: int = SEED,
    on_progress: Callable[[float, str], None] = lambda _share, _status: None,
) -> Trained:
    """Train the network of a task from recordings of its demonstrations.

    Args:
        recordings: files of `cellwright eval --record`.
        steps: steps of training.
        seed: seed of weights, batches and noise.
        on_progress: takes the finished share of the work, of which reading is a half, and where it is.

    Raises:
        RecordingError: a recording cannot be run again.
        UsageError: none has succeeded.
    """
    demonstrations = _read_all(recordings, on_progress)
    inputs, chunks = chunks_of(demonstrations)
    outputs = distances(inputs, chunks)
    network = Network.begin(inputs, outputs, seed)
    errors = train(
        network,
        inputs,
        outputs,
        steps,
        seed,
        lambda step: on_progress(0.5 + 0.5 * step / steps, f"step {step} of {steps}"),
    )
    used = sum(each.is_success for each in demonstrations)
    return Trained(network, used, len(inputs), float(np.mean(errors[-100:])))


def _read_all(recordings: Sequence[Path], on_progress: Callable[[float, str], None]) -> list[Demonstration]:
    """Return the demonstrations, read on all processors: each run is repeated."""
    workers = min(usable_processors(), len(recordings))
    found = []
    # Ctrl-C is for this process, which ends the others
    with ProcessPoolExecutor(workers, get_context("spawn"), signal.signal, (signal.SIGINT, signal.SIG_IGN)) as pool:
        for number, each in enumerate(pool.map(read_demonstration, recordings), 1):
            found.append(each)
            on_progress(0.5 * number / len(recordings), f"demonstration {number} of {len(recordings)}")
    return found


def distances(inputs: Array, chunks: Array) -> Array:
    """Return the answers to learn, shape (N, H · C): how far each target is from where its channel is observed."""
    count = chunks.shape[2]
    found: Array = (chunks - inputs[:, np.newaxis, :count]).reshape(len(inputs), -1)
    return found
