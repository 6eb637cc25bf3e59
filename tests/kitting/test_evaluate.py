"""Runs of the benchmark by `cellwright eval`."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from cellwright.running.evaluation.results.results_file import ResultsFile
from cellwright.util.errors import UsageError
from kitting.benchmark import Split, find_tasks, seeds
from kitting.evaluate import Runs, evaluate, recordings, records

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


@pytest.mark.slow
def test_evaluation_leaves_records_and_recordings_and_is_not_repeated(tmp_path: Path) -> None:
    folder = tmp_path / "runs"
    runs = Runs([TASK], Split.TRAIN, count=2, jobs=2, record=True)
    found = evaluate(runs, ["--agent", "kitting.demonstrator:Demonstrator"], folder)
    assert [(each.task, each.seed, each.success, each.outcome) for each in found] == [
        ("pick_from_bin", 1, True, "done"),
        ("pick_from_bin", 2, True, "done"),
    ]
    assert found[0].state_hash != found[1].state_hash
    files = recordings(folder, TASK, Split.TRAIN)
    assert [file.name.split("-")[1] for file in files] == ["1", "2"]
    with ResultsFile(folder) as store:  # of other sources, later
        result = next(each for each in store.results.values() if each.seed == found[1].seed)
        later = replace(result, key="0" * len(result.key))
        copied = (folder / "recordings" / later.log_name).with_suffix(".mcap")
        shutil.copy(files[1], copied)
        store.append(later)
    assert recordings(folder, TASK, Split.TRAIN) == [files[0], copied]
    shutil.rmtree(folder / "recordings")
    assert evaluate(runs, ["--agent", "kitting.demonstrator:Demonstrator"], folder) == found
    assert not (folder / "recordings").exists() or not [*(folder / "recordings").iterdir()]


@pytest.mark.slow
def test_program_that_does_not_exist_is_reported_with_the_folder(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="the evaluation ended with status 2; see above, and run the command again"):
        evaluate(Runs([TASK], count=1), ["--agent", "kitting.nothing:Missing"], tmp_path / "runs")
