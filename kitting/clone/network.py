"""Network with two hidden layers in NumPy, from an observation to a chunk of actions, and its training by Adam."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from cellwright.util.errors import UsageError

Array = NDArray[np.float64]

WIDTH: Final = 128
"""Number of units in each hidden layer."""
BATCH: Final = 256
"""Samples of a step of training."""
RATE: Final = 1e-3
"""First rate of learning; it falls to 0 along a half period of a cosine."""
NOISE: Final = 0.02
"""Standard deviation of the noise on observations in training, in their own standard deviations."""
_DECAYS: Final = 0.9, 0.999
_SMALL: Final = 1e-8
_LEAST_SCALE: Final = 1e-3  # of a number that hardly varies: a change that was never seen would have a huge effect


@dataclass
class Network:
    """Network with its scales: it takes and returns values in their own units.

    Attributes:
        weights: matrices and offsets of the three layers.
        inputs: mean and scale of each input, shape (2, D).
        outputs: mean and scale of each output, shape (2, E).
    """

    weights: list[Array]
    inputs: Array
    outputs: Array

    @classmethod
    def begin(cls, inputs: Array, outputs: Array, seed: int, width: int = WIDTH) -> Self:
        """Return an untrained network with the scales of samples.

        Args:
            inputs: samples, shape (N, D).
            outputs: the answers to learn, shape (N, E).
            seed: seed of the first weights.
            width: number of units in each hidden layer.
        """
        chance = np.random.default_rng(seed)
        sizes = [inputs.shape[1], width, width, outputs.shape[1]]
        weights: list[Array] = []
        for before, after in pairwise(sizes):
            weights += [chance.standard_normal((before, after)) / np.sqrt(before), np.zeros(after)]
        return cls(weights, _scales(inputs), _scales(outputs))

    def answer(self, observations: Array) -> Array:
        """Return the answers to observations, shape (N, E)."""
        scaled = self._layers((observations - self.inputs[0]) / self.inputs[1])[-1]
        found: Array = scaled * self.outputs[1] + self.outputs[0]
        return found

    def gradients(self, inputs: Array, outputs: Array) -> tuple[float, list[Array]]:
        """Return the mean squared error of scaled samples, and its gradient by each of the weights."""
        layers = self._layers(inputs)
        error = layers[-1] - outputs
        found: list[Array] = []
        flow = 2.0 * error / error.size
        for number in (4, 2, 0):
            below = layers[number // 2]
            found = [below.T @ flow, flow.sum(axis=0), *found]
            flow = (flow @ self.weights[number].T) * (1.0 - below**2)  # of the hyperbolic tangent; unused at the input
        return float(np.mean(error**2)), found

    def save(self, path: Path) -> None:
        """Write it to a file, in numbers of 32 bits; equal networks give equal bytes."""
        path.parent.mkdir(parents=True, exist_ok=True)
        arrays = {f"weights{number}": each for number, each in enumerate(self.weights)}
        arrays |= {"inputs": self.inputs, "outputs": self.outputs}
        np.savez(path, **{name: each.astype(np.float32) for name, each in arrays.items()})  # type: ignore[arg-type] # names of arrays

    @classmethod
    def load(cls, path: Path) -> Self:
        """Read a file of `save`.

        Raises:
            UsageError: it cannot be read, or is none.
        """
        try:
            with np.load(path, allow_pickle=False) as found:
                weights = [found[f"weights{number}"].astype(float) for number in range(6)]
                return cls(weights, found["inputs"].astype(float), found["outputs"].astype(float))
        except (OSError, ValueError, KeyError, EOFError) as error:
            raise UsageError(f"{path}: is no trained network ({error}); run python -m kitting train") from None

    def _layers(self, inputs: Array) -> list[Array]:
        """Return the scaled inputs and the values of each layer."""
        first, first_offset, second, second_offset, third, third_offset = self.weights
        one = np.tanh(inputs @ first + first_offset)
        two = np.tanh(one @ second + second_offset)
        return [inputs, one, two, two @ third + third_offset]


def train(
    network: Network,
    inputs: Array,
    outputs: Array,
    steps: int,
    seed: int,
    on_progress: Callable[[int], None] = lambda _step: None,
) -> list[float]:
    """Train a network; equal arguments give equal weights on one machine.

    Args:
        network: the network; it is changed.
        inputs: samples, shape (N, D).
        outputs: the answers to learn, shape (N, E).
        steps: number of steps.
        seed: seed of the batches and of the noise.
        on_progress: takes the number of each step, from 1.

    Returns:
        The mean squared error of each step, in the scale of the outputs.
    """
    chance = np.random.default_rng(seed)
    scaled = (inputs - network.inputs[0]) / network.inputs[1]
    wanted = (outputs - network.outputs[0]) / network.outputs[1]
    means = [np.zeros_like(each) for each in network.weights]
    squares = [np.zeros_like(each) for each in network.weights]
    errors: list[float] = []
    for step in range(1, steps + 1):
        chosen = chance.integers(len(scaled), size=min(BATCH, len(scaled)))
        noisy = scaled[chosen] + NOISE * chance.standard_normal((len(chosen), scaled.shape[1]))
        error, gradients = network.gradients(noisy, wanted[chosen])
        errors.append(error)
        on_progress(step)
        rate = RATE * 0.5 * (1.0 + np.cos(np.pi * step / steps))
        for weight, mean, square, gradient in zip(network.weights, means, squares, gradients, strict=True):
            mean += (1.0 - _DECAYS[0]) * (gradient - mean)
            square += (1.0 - _DECAYS[1]) * (gradient**2 - square)
            unbiased = mean / (1.0 - _DECAYS[0] ** step)
            weight -= rate * unbiased / (np.sqrt(square / (1.0 - _DECAYS[1] ** step)) + _SMALL)
    return errors


def _scales(samples: Array) -> Array:
    return np.stack([samples.mean(axis=0), np.maximum(samples.std(axis=0), _LEAST_SCALE)])
