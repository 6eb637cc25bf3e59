"""Training of a clone."""

from collections.abc import Iterator
from multiprocessing import resource_tracker
from pathlib import Path

import numpy as np
import pytest

import cellwright
from cellwright.util.errors import RecordingError
from kitting.benchmark import Split, find_tasks
from kitting.clone.samples import HORIZON
from kitting.clone.training import distances, train_clone


def test_answers_are_distances_of_each_target_from_where_its_channel_is_observed() -> None:
    inputs = np.array([[1.0, 2.0, 9.0]])
    chunks = np.array([[[1.5, 2.0], [3.0, 1.0]]])
    assert distances(inputs, chunks).tolist() == [[0.5, 0.0, 2.0, -1.0]]


@pytest.fixture
def _tracker_ends() -> Iterator[None]:
    """Let the process that the library keeps for its pools end before the tests do."""
    yield
    resource_tracker._resource_tracker._stop()  # type: ignore[attr-defined] # at the end of a program it goes by itself


@pytest.mark.slow
@pytest.mark.usefixtures("_tracker_ends")
def test_network_learns_a_demonstration(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    cellwright.run_trial(find_tasks(["pick_from_bin"])[0].file(Split.TRAIN), "kitter", seed=1, record=path)
    other = tmp_path / "other.mcap"
    other.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(RecordingError, match=r"other\.mcap"):  # of another process
        train_clone([path, other], steps=1)
    shown: list[tuple[float, str]] = []
    trained = train_clone([path], steps=300, on_progress=lambda share, status: shown.append((share, status)))
    assert (shown[0], shown[-1], len(shown)) == ((0.5, "demonstration 1 of 1"), (1.0, "step 300 of 300"), 301)
    assert trained.demonstrations == 1
    assert trained.samples > 30
    assert trained.error < 0.3  # of the variance of the answers
    assert trained.network.outputs.shape == (2, 8 * HORIZON)
