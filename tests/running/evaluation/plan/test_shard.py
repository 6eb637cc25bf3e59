"""Tests of shards: their split of the runs, and their texts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.running.evaluation.plan.shard import Shard
from cellwright.util.errors import UsageError


@given(
    seeds=st.lists(st.integers(min_value=1, max_value=40), min_size=1, max_size=6),
    count=st.integers(min_value=1, max_value=50),
)
def test_shards_hold_each_run_once_and_equal_parts_of_each_trial(seeds: list[int], count: int) -> None:
    runs = [(trial, seed) for trial, last in enumerate(seeds) for seed in range(last)]
    shards = [Shard(number, count).select(runs) for number in range(1, count + 1)]
    assert sorted(run for shard in shards for run in shard) == runs
    assert all(list(shard) == sorted(shard) for shard in shards)
    sizes = list(map(len, shards))
    assert max(sizes) - min(sizes) <= 1
    for trial in range(len(seeds)):
        parts = [Counter(run[0] for run in shard)[trial] for shard in shards]
        assert max(parts) - min(parts) <= 1


SLURM = {"SLURM_ARRAY_TASK_ID": "3", "SLURM_ARRAY_TASK_MIN": "1", "SLURM_ARRAY_TASK_MAX": "8"}


@pytest.mark.parametrize(
    ("text", "variables", "shard"),
    [
        ("3/16", {}, Shard(3, 16)),
        ("1/1", {"SLURM_ARRAY_TASK_ID": "3"}, Shard(1, 1)),
        ("auto", {**SLURM, "SLURM_ARRAY_TASK_COUNT": "8"}, Shard(3, 8)),
        ("auto/16", {"SLURM_ARRAY_TASK_ID": "16", "SLURM_ARRAY_TASK_COUNT": "1"}, Shard(16, 16)),
        ("auto/16", {"JOB_COMPLETION_INDEX": "0"}, Shard(1, 16)),
        ("auto/16", {"JOB_COMPLETION_INDEX": "15"}, Shard(16, 16)),
    ],
)
def test_shard_is_read_from_text_and_variables(text: str, variables: Mapping[str, str], shard: Shard) -> None:
    assert Shard.read(text, variables) == shard
    assert Shard.read(str(shard), {}) == shard


@pytest.mark.parametrize(
    "text", ["", "3", "0/4", "5/4", "-1/4", "1/0", "a/b", "1/2/3", "1.0/2", "²/3", "1/" + "9" * 5000]
)
def test_invalid_shard_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="give K/N with K from 1 to N"):
        Shard.read(text, {})


@pytest.mark.parametrize(
    ("text", "variables", "message"),
    [
        ("auto/4", {}, "none of SLURM_ARRAY_TASK_ID, JOB_COMPLETION_INDEX is set; give K/N"),
        ("auto/4", {"SLURM_ARRAY_TASK_ID": "0"}, r"must be a number from 1 \(got 0\)"),
        ("auto/4", {"JOB_COMPLETION_INDEX": "first"}, r"must be a number from 0 \(got first\)"),
        ("auto/4", {"JOB_COMPLETION_INDEX": "4"}, r"K from 1 to N.* \(got 5/4\)"),
        ("auto/", {"JOB_COMPLETION_INDEX": "0"}, r"\(got 1/\)"),
        ("auto", {"JOB_COMPLETION_INDEX": "0"}, "the number of shards is unknown.*; give auto/N"),
        # a part of an array: its count is not that of the whole
        ("auto", {**SLURM, "SLURM_ARRAY_TASK_MIN": "3", "SLURM_ARRAY_TASK_COUNT": "2"}, "give auto/N"),
        ("auto", {**SLURM, "SLURM_ARRAY_TASK_COUNT": "2"}, "give auto/N"),
    ],
)
def test_variables_that_do_not_fit_are_refused(text: str, variables: Mapping[str, str], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        Shard.read(text, variables)
