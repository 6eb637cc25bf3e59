"""Tests of merged results: which of several counts, and whose they are. The command's tests merge whole folders."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from cellwright.running.evaluation.plan.job import EvaluatedTrial, Job, RunLimits
from cellwright.running.evaluation.results.folder import PLAN_NAME, plan_of, plan_text
from cellwright.running.evaluation.results.merge import merge, run_files
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.results_file import ResultsFile, read_results
from cellwright.util.errors import UsageError
from tests.running.evaluation.made_results import result

TRIAL = EvaluatedTrial("tiny", (), 12.0, 15.0, 500.0)
JOBS = [Job(TRIAL, "my.py:Mine", seed, False, f"tiny-{seed}") for seed in (1, 2)]


def shard(folder: Path, *results: Result) -> Path:
    with ResultsFile(folder) as store:
        store.append(*results)
    (folder / PLAN_NAME).write_text(plan_text(plan_of(JOBS, RunLimits())), encoding="utf-8")
    return folder


def test_first_of_two_results_counts_and_runs_without_one_are_named(tmp_path: Path) -> None:
    one, other = shard(tmp_path / "1", result(3.0)), shard(tmp_path / "2", result(4.0))
    merged = merge([one, other], tmp_path / "all")
    assert list(merged.results) == [result(3.0)]
    assert (merged.missing, merged.differing) == (["tiny seed 2"], ["tiny seed 1"])
    assert read_results(tmp_path / "all") == {"tiny-1": result(3.0)}


def test_result_under_the_key_of_another_run_is_refused(tmp_path: Path) -> None:
    folder = shard(tmp_path / "1", replace(result(), seed=2))
    with pytest.raises(UsageError, match=r"the plan's run of this key is tiny seed 1 of my\.py:Mine"):
        merge([folder], tmp_path / "all")


def test_files_of_a_run_are_those_of_its_name(tmp_path: Path) -> None:
    for name in ("logs/a.log", "logs/a.jsonl", "logs/b.log", "recordings/a.mcap"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    found = [path.relative_to(tmp_path).as_posix() for path in run_files(tmp_path, "a.log")]
    assert found == ["logs/a.log", "logs/a.jsonl", "recordings/a.mcap"]
