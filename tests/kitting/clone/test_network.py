"""Network of the clone: its gradients, its training, its file."""

from pathlib import Path

import numpy as np
import pytest

from cellwright.util.errors import UsageError
from kitting.clone.network import Network, train

CHANCE = np.random.default_rng(3)
INPUTS = CHANCE.standard_normal((40, 3)) * [1.0, 5.0, 0.1] + [0.0, 2.0, 9.0]
OUTPUTS = np.stack([INPUTS[:, 0] * INPUTS[:, 1], np.sin(INPUTS[:, 0]) + 100.0], axis=1)


def test_gradients_are_the_slopes_of_the_error() -> None:
    network = Network.begin(INPUTS, OUTPUTS, seed=1, width=5)
    inputs, outputs = CHANCE.standard_normal((7, 3)), CHANCE.standard_normal((7, 2))
    _, gradients = network.gradients(inputs, outputs)
    for weight, gradient in zip(network.weights, gradients, strict=True):
        assert weight.shape == gradient.shape
        for place in [*np.ndindex(weight.shape)][:6]:
            kept, step = weight[place], 1e-6
            weight[place] = kept + step
            above = network.gradients(inputs, outputs)[0]
            weight[place] = kept - step
            below = network.gradients(inputs, outputs)[0]
            weight[place] = kept
            assert gradient[place] == pytest.approx((above - below) / (2.0 * step), abs=1e-7)


def test_training_brings_answers_in_their_own_units_near_to_what_was_asked() -> None:
    network = Network.begin(INPUTS, OUTPUTS, seed=1, width=32)
    errors = train(network, INPUTS, OUTPUTS, 1500, seed=2)
    assert np.mean(errors[-50:]) < 0.1 * np.mean(errors[:5])
    spread = np.abs(OUTPUTS - OUTPUTS.mean(axis=0)).mean()
    assert np.abs(network.answer(INPUTS) - OUTPUTS).mean() < 0.3 * spread


def test_equal_seeds_train_equal_networks() -> None:
    networks = [Network.begin(INPUTS, OUTPUTS, seed=1, width=8) for _ in range(2)]
    for network in networks:
        train(network, INPUTS, OUTPUTS, 20, seed=2)
    assert all(np.array_equal(a, b) for a, b in zip(networks[0].weights, networks[1].weights, strict=True))


def test_network_is_read_as_it_was_written_with_equal_bytes(tmp_path: Path) -> None:
    network = Network.begin(INPUTS, OUTPUTS, seed=1, width=8)
    for name in ("a.npz", "b.npz"):
        network.save(tmp_path / "new" / name)
    assert (tmp_path / "new" / "a.npz").read_bytes() == (tmp_path / "new" / "b.npz").read_bytes()
    again = Network.load(tmp_path / "new" / "a.npz")
    assert np.allclose(again.answer(INPUTS), network.answer(INPUTS), rtol=1e-5, atol=1e-4)
    again.save(tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == (tmp_path / "new" / "a.npz").read_bytes()


@pytest.mark.parametrize("content", [b"", b"PK no", b"\x93NUMPY"])
def test_file_that_is_no_network_is_refused(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "x.npz").write_bytes(content)
    with pytest.raises(UsageError, match=r"x.npz: is no trained network .*; run python -m kitting train"):
        Network.load(tmp_path / "x.npz")


def test_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="run python -m kitting train"):
        Network.load(tmp_path / "none.npz")
