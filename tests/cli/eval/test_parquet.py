"""Tests of `--parquet` of `cellwright eval` and `cellwright eval merge`."""

from __future__ import annotations

import random
import sys
from pathlib import Path

import pytest
from pyarrow import parquet

from cellwright.running.evaluation.plan.shard import Shard
from tests.cli.conftest import CommandLine
from tests.cli.eval.test_merge import WORK, jobs_of, made_up, store
from tests.support.quick_children import QUICK_WORKERS

TABLE = "results.parquet"


def test_merged_table_equals_that_of_one_machine(tiny: CommandLine) -> None:
    jobs = jobs_of(4)
    results = {each.key: each for each in made_up(jobs, random.Random(3))}
    work = (*WORK, "--seeds", "4", "--parquet")
    store("whole", results.values())
    tiny(*work, "--out", "whole")
    for number in (1, 2):
        own = {job.key for job in Shard(number, 2).select(jobs)}
        store(f"shards/{number}", (each for each in results.values() if each.key in own))
        tiny(*work, "--shard", f"{number}/2", "--out", f"shards/{number}")
    tiny("eval", "merge", "shards/2", "shards/1", "--out", "merged")
    assert not Path("merged", TABLE).exists()
    tiny("eval", "merge", "shards/2", "shards/1", "--out", "merged", "--parquet")
    assert Path("merged", TABLE).read_bytes() == Path("whole", TABLE).read_bytes()
    assert parquet.read_table("merged/results.parquet")["key"].to_pylist() == [job.key for job in jobs]


@QUICK_WORKERS
@pytest.mark.slow
def test_table_has_real_runs_and_repetitions(tiny: CommandLine) -> None:
    work = ("eval", "tiny.yaml", "--agent", "programs.py:Deliver", "--jobs", "2", "--repeat", "--parquet")
    assert tiny(*work).status == 0
    first, second = parquet.read_table("evaluation/results.parquet").to_pylist()
    assert [each["is_repetition"] for each in (first, second)] == [False, True]
    assert (first["points"], len(first["parts"]), first["kits"][0]["is_submitted"]) == (6.0, 2, True)
    assert (first["orders"][0]["is_complete"], first["orders"][0]["points"]) == (True, 6.0)
    assert first["orders"][0]["completed"] == first["submissions"][0]["time"] > 1.0
    assert first["parts"] == second["parts"]


@pytest.mark.parametrize("command", [WORK, ("eval", "merge", "a")])
def test_missing_package_is_refused_before_anything(
    command: tuple[str, ...], cellwright: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)  # as if it was not installed
    ran = cellwright(*command, "--parquet")
    message = "error: --parquet: needs the package pyarrow; pip install 'cellwright[parquet]'\n"
    assert (ran.status, ran.err) == (2, message)
    assert list(Path().iterdir()) == []


def test_table_that_cannot_be_written_leaves_other_files_whole(tiny: CommandLine) -> None:
    store("out", made_up(jobs_of(1), random.Random(1)))
    Path("out", TABLE).mkdir()
    ran = tiny(*WORK, "--out", "out", "--parquet")
    assert (ran.status, ran.err) == (75, f"error: out/{TABLE}: cannot be written: Is a directory\n")
    assert Path("out", "report.html").exists()
