"""Samples that the clone learns from."""

from pathlib import Path

import numpy as np
import pytest

import cellwright
from cellwright.cell.cell import Cell
from cellwright.config.trial.trial import Trial
from cellwright.envs import CellEnv
from cellwright.util.errors import UsageError
from kitting.benchmark import Split, find_tasks
from kitting.clone.samples import HORIZON, Demonstration, Observed, chunks_of, moving, names_of, read_demonstration


def demonstration(positions: list[float], targets: list[float], *, is_success: bool = True) -> Demonstration:
    """Return one of a single channel, with a number beside it that stands still."""
    observations = np.array([[position, 7.0] for position in positions])
    return Demonstration(observations, np.array(targets)[:, np.newaxis], is_success)


def test_periods_in_which_nothing_changes_are_left_out() -> None:
    waits_first = demonstration([0.0, 0.0, 0.0, 0.1, 0.2, 0.2, 0.2], [0.0, 0.0, 0.1, 0.2, 0.2, 0.2, 0.2])
    assert moving(waits_first).tolist() == [0, 2, 3, 4]


def test_periods_with_the_suction_on_are_kept() -> None:
    grips = demonstration([0.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 1.0, 0.0])
    assert moving(grips).tolist() == [0, 2, 3, 4]


def test_chunks_go_on_with_what_followed_and_repeat_the_last_target() -> None:
    inputs, chunks = chunks_of([demonstration([0.0, 1.0, 2.0], [1.0, 2.0, 3.0])])
    assert inputs.tolist() == [[0.0, 7.0], [1.0, 7.0], [2.0, 7.0]]
    assert chunks.shape == (3, HORIZON, 1)
    assert chunks[0, :, 0].tolist() == [1.0, 2.0, *[3.0] * (HORIZON - 2)]


def test_failures_are_not_learned_from() -> None:
    good, bad = demonstration([0.0], [1.0]), demonstration([5.0], [6.0], is_success=False)
    assert chunks_of([bad, good])[0].tolist() == [[0.0, 7.0]]
    with pytest.raises(UsageError, match="none has succeeded; record others"):
        chunks_of([bad])


def test_trial_without_a_task_is_refused() -> None:
    with pytest.raises(UsageError, match="there is no task"):
        Observed(Cell(Trial("one arm", has_arm=True)))


@pytest.mark.slow
def test_demonstration_has_what_an_environment_observes_and_what_was_executed(tmp_path: Path) -> None:
    file, path = find_tasks(["pick_from_bin"])[0].file(Split.TRAIN), tmp_path / "run.mcap"
    cellwright.run_trial(file, "kitter", seed=4, record=path)
    found = read_demonstration(path)
    assert found.is_success
    episode = cellwright.recorded_episode(path)
    state, action = (each.values for each in episode.columns[:2])
    assert np.array_equal(found.observations[:, :8].astype(np.float32), state)
    assert np.array_equal(found.targets.astype(np.float32), action)
    env = CellEnv(file, variation=False)
    observation, _ = env.reset(seed=4)
    env.close()
    assert names_of(cellwright.load_trial(file)) == (*env.agent_pos_names, *env.environment_state_names)
    begun = np.concatenate([observation["agent_pos"], observation["environment_state"]])
    assert np.array_equal(found.observations[0].astype(np.float32), begun)


@pytest.mark.slow
def test_recording_of_no_task_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    cellwright.run_trial("lesson", None, record=str(path), options=cellwright.RunOptions(until=0.2))
    with pytest.raises(UsageError, match="there is no task"):
        read_demonstration(path)
