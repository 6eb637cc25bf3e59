"""Runs of the benchmark by `cellwright eval`."""

from pathlib import Path

import pytest

from cellwright.util.errors import UsageError
from kitting.benchmark import Split, find_tasks, seeds
from kitting.evaluate import Runs, recordings, records

TASK = find_tasks(["pick_from_bin"])[0]


def test_runs_have_the_first_seeds_of_their_split() -> None:
    assert list(Runs([TASK]).seeds) == list(seeds(Split.TEST))
    assert list(Runs([TASK], Split.TRAIN, 3).seeds) == list(seeds(Split.TRAIN))[:3]


@pytest.mark.parametrize("count", [0, 201])
def test_more_seeds_than_there_are_are_refused(count: int) -> None:
    with pytest.raises(UsageError, match=f"--seeds {count}: give a number from 1 to 200, as many as test has"):
        _ = Runs([TASK], count=count).seeds


def test_folder_without_an_evaluation_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="plan"):
        records(tmp_path)
    with pytest.raises(UsageError, match="has no recording of pick_from_bin; run python -m kitting demonstrate"):
        recordings(tmp_path, TASK, Split.TRAIN)
