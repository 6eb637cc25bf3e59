"""The clone at work: it sends what its network answers."""

from pathlib import Path
from typing import cast

import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.client import Client
from cellwright.running.run import RunOptions, run_cell
from cellwright.util.errors import UsageError
from kitting.benchmark import Split, find_tasks
from kitting.clone.agent import FOLDER, PUBLISHED, Clone, chunk, network_file, task_of
from kitting.clone.network import Network
from kitting.clone.samples import HORIZON, names_of

TASK = find_tasks(["pick_from_bin"])[0]
RAISED = 0.05
"""Distance [m] by which the network of the tests sends the rail on, from wherever it is."""


@pytest.fixture
def network() -> Network:
    """A network that always answers: the rail a little further, all else as it is."""
    width, channels = len(names_of(TASK.trial(Split.TEST))), 8
    outputs = np.zeros((2, HORIZON * channels))
    outputs[:, ::channels] = RAISED
    found = Network.begin(np.zeros((2, width)), outputs, seed=1, width=4)
    found.weights[4][:] = 0.0
    return found


def test_targets_are_distances_from_where_all_is(network: Network) -> None:
    observation = np.linspace(0.1, 0.9, len(names_of(TASK.trial(Split.TEST))))
    targets = chunk(network, observation, 8)
    assert targets.shape == (HORIZON, 8)
    assert np.allclose(targets[:, 0], observation[0] + RAISED)
    assert np.allclose(targets[:, 1:], observation[1:8], atol=1e-6)


def test_network_is_that_of_the_task_also_in_its_cell_for_training(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(FOLDER, raising=False)
    assert network_file(task_of("new_part_train")) == network_file(task_of("new_part")) == PUBLISHED / "new_part.npz"
    monkeypatch.setenv(FOLDER, "elsewhere")
    assert network_file(task_of("new_part")) == Path("elsewhere/new_part.npz")
    assert network_file(TASK, Path("given")) == Path("given/pick_from_bin.npz")


def test_trial_of_no_task_is_refused() -> None:
    with pytest.raises(UsageError, match="lesson: is no task of the benchmark; see python -m kitting tasks"):
        task_of("lesson")


def test_cell_in_another_process_is_refused() -> None:
    class Far:
        transport = object()

    with pytest.raises(UsageError, match="leave out --over"):
        Clone().run(cast("Client", Far()))


@pytest.mark.slow
def test_clone_sends_the_arm_where_its_network_says(
    network: Network, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    network.save(tmp_path / "pick_from_bin.npz")
    monkeypatch.setenv(FOLDER, str(tmp_path))
    cell = Cell(TASK.trial(Split.TEST), seed=1)
    before = cell.arms["arm"].read().positions
    result = run_cell(cell, Clone(), RunOptions(until=2.0))
    after = cell.arms["arm"].read().positions
    assert result.error == ""
    assert after[0] > before[0] + 0.5
    assert np.allclose(after[1:], before[1:], atol=0.05)


@pytest.mark.slow
def test_clone_without_a_trained_network_says_how_to_train_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(FOLDER, str(tmp_path))
    result = run_cell(Cell(TASK.trial(Split.TEST)), Clone(), RunOptions(until=0.1))
    assert "run python -m kitting train" in result.error
