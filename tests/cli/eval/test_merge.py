"""Tests of `cellwright eval --shard` and `cellwright eval merge`: together they equal one machine."""

from __future__ import annotations

import json
import random
import re
import shutil
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import pytest

from cellwright.cli.eval.arguments import evaluated_trials
from cellwright.running.evaluation.plan.job import Job, RunLimits, make_jobs
from cellwright.running.evaluation.plan.shard import Shard
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.results_file import ResultsFile
from tests.cli.conftest import CommandLine, Ran
from tests.running.evaluation.made_results import SCORE, TIMELINE
from tests.support.quick_children import QUICK_WORKERS

AGENT = "programs.py:Deliver"
WORK = ("eval", "tiny.yaml", "other.yaml", "--agent", AGENT, "--jobs", "2")
FILES = ("plan.json", "summary.json", "junit.xml", "report.html")
"""Files that do not depend on the order in which runs end."""


def made_up(jobs: Iterable[Job], chance: random.Random) -> list[Result]:
    """Return results of all sorts, in the order in which runs could have ended."""
    results = []
    for job in jobs:
        points = chance.choice([0.0, 1.5, 6.0])
        lost = chance.random() < 0.1
        results.append(
            Result.of(
                job,
                RunLimits(),
                outcome=chance.choice(["wall_limit", "died"]) if lost else "done",
                points=0.0 if lost else points,
                wall=chance.uniform(0.5, 90.0),
                simulated=chance.uniform(1.0, 500.0),
                reason="still running after 600 s" if lost else "",
                state_hash=f"{chance.getrandbits(256):064x}",
                score={} if lost else SCORE,
                timeline={} if lost else TIMELINE,
            )
        )
    chance.shuffle(results)
    return results


def jobs_of(seeds: int) -> list[Job]:
    return make_jobs(evaluated_trials(["tiny.yaml", "other.yaml"], []), AGENT, range(1, seeds + 1), vary=False)


def store(folder: str, results: Iterable[Result]) -> None:
    with ResultsFile(Path(folder)) as file:
        file.append(*results)


def contents(folder: str) -> dict[str, bytes]:
    return {name: Path(folder, name).read_bytes() for name in FILES}


def lines(folder: str) -> list[bytes]:
    return sorted(Path(folder, "results.jsonl").read_bytes().splitlines())


@pytest.mark.slow
def test_runs_of_16_shards_equal_those_of_one_machine(tiny: CommandLine) -> None:
    seeds, shards = 200, 16
    jobs = jobs_of(seeds)
    results = {each.key: each for each in made_up(jobs, random.Random(20))}
    assert len(results) == 400
    work = (*WORK, "--seeds", str(seeds), "--min-score", "25%")
    store("whole", results.values())
    one = tiny(*work, "--out", "whole")
    assert one.status == 1
    for number in range(1, shards + 1):
        own = {job.key for job in Shard(number, shards).select(jobs)}
        assert len(own) == 25
        store(f"shards/{number}", (each for each in results.values() if each.key in own))
        ran = tiny(*work, "--shard", f"{number}/{shards}", "--out", f"shards/{number}")
        assert ran.status == 1
        assert f"shard {number}/16 of 400 runs" in ran.out
        assert f"{len(own)} of them have a result already" in ran.out
    folders = [f"shards/{number}" for number in range(1, shards + 1)]
    shutil.copytree("shards/7", "twice")

    killed = Path("shards/11/results.jsonl")
    complete = killed.read_bytes()
    killed.write_bytes(complete[: len(complete) // 2])  # in the middle of a line, as a killed process leaves it
    left = 400 - sum(len(Path(each, "results.jsonl").read_bytes().split(b"\n")) - 1 for each in folders)
    merging = ("eval", "merge", *reversed(folders), "twice", "--out", "merged", "--min-score", "25%")
    early = tiny(*merging)
    assert early.status == 75
    (error,) = early.err.splitlines()
    assert re.fullmatch(
        r"error: no result of (\w+ seed \d+, ){9}\w+ seed \d+ and (\d+) more; repeat their shards", error
    )
    assert f"and {left - 10} more" in error
    assert json.loads(Path("merged", "summary.json").read_text())["runs"] == 400 - left

    killed.write_bytes(complete)
    late = tiny(*merging)
    assert late.status == 1
    assert late.err == ""
    assert late.out.replace("merged/", "whole/") in one.out
    assert contents("merged") == contents("whole")
    assert lines("merged") == lines("whole")

    again = tiny("eval", "merge", "merged", *folders, "--out", "third", "--min-score", "25%", "--json")
    assert again.out.encode() == Path("whole", "summary.json").read_bytes()
    assert contents("third") == contents("whole")
    in_order = [json.loads(line)["key"] for line in Path("third", "results.jsonl").read_text().splitlines()]
    assert in_order == [job.key for job in jobs]


@pytest.mark.slow
@pytest.mark.usefixtures(*QUICK_WORKERS.args)
def test_real_runs_of_two_shards_equal_those_of_one_machine(tiny: CommandLine) -> None:
    work = (*WORK, "--seeds", "2", "--record")
    for number in (1, 2):
        ran = tiny(*work, "--shard", f"{number}/2", "--out", f"shards/{number}")
        assert ran.status == 0, ran
        assert ran.out.count(" done, ") == 2
    assert tiny("eval", "merge", "shards/1", "shards/2", "--out", "merged").status == 0
    assert tiny(*work, "--out", "whole").status == 0

    def logs(folder: str) -> list[Path]:
        return sorted(each.relative_to(folder) for each in Path(folder).glob("[lr]*/*") if each.name != "check.log")

    assert logs("merged") == logs("whole")
    assert len(logs("whole")) == 4 * 3
    with ResultsFile(Path("merged")) as merged, ResultsFile(Path("whole")) as whole:
        walls = {key: each.wall for key, each in merged.results.items()}
        whole.append(*(replace(each, wall=walls[key]) for key, each in whole.results.items()))
    assert tiny(*work, "--out", "whole").status == 0
    assert contents("merged") == contents("whole")
    assert "4 of them have a result already" in tiny(*work, "--out", "merged").out


@pytest.mark.slow
@pytest.mark.usefixtures(*QUICK_WORKERS.args)
def test_merged_folder_takes_up_the_missing_runs(tiny: CommandLine) -> None:
    work = (*WORK, "--seeds", "1")
    assert tiny(*work, "--shard", "1/2", "--out", "shards/1").status == 0
    assert tiny("eval", "merge", "shards/1", "--out", "merged").status == 75
    ran = tiny(*work, "--out", "merged")
    assert ran.status == 0
    assert "[2/2] other seed 1: 6 of 6 points, done" in ran.out
    assert tiny("eval", "merge", "merged", "--out", "merged").status == 0


def shard(tiny: CommandLine, folder: str, *more: str, work: tuple[str, ...] = WORK) -> Ran:
    """Evaluate a shard whose results are there already."""
    results = made_up(jobs_of(2), random.Random(1))
    store(folder, (replace(each, outcome="done", reason="") for each in results))
    return tiny(*work, "--seeds", "2", "--shard", "1/2", "--out", folder, *more)


def test_first_of_two_results_counts_and_difference_is_reported(tiny: CommandLine) -> None:
    shard(tiny, "a")
    shard(tiny, "b")
    with ResultsFile(Path("b")) as file:
        first, second, *_ = file.results.values()
        file.append(replace(first, points=3.0), replace(second, wall=1.0))
    ran = tiny("eval", "merge", "a", "b", "--out", "ab", "--json")
    assert f"warning: {first.name}: its results differ, and the first counts" in ran.err
    assert second.name not in ran.err
    points = {each["key"]: each["points"] for each in json.loads(ran.out)["results"]}
    assert points[first.key] == first.points
    ran = tiny("eval", "merge", "b", "a", "--out", "ba", "--json")
    points = {each["key"]: each["points"] for each in json.loads(ran.out)["results"]}
    assert points[first.key] == 3.0


def test_lost_run_of_other_limits_does_not_count(tiny: CommandLine) -> None:
    shard(tiny, "a")
    with ResultsFile(Path("a")) as file:
        first = next(iter(file.results.values()))
        file.append(replace(first, outcome="died", limits={"wall": 1.0}, reason="died"))
    ran = tiny("eval", "merge", "a")
    assert (ran.status, ran.err) == (75, f"error: no result of {first.name}; repeat their shards\n")


def change(file: str, before: str, after: str) -> None:
    text = Path(file).read_text()
    assert before in text
    Path(file).write_text(text.replace(before, after, 1))


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (("--vary",), "b: does not belong to a: vary True, but False; merge shards of one evaluation"),
        (("--time-limit", "7"), "b: does not belong to a: limits wall 7.0, memory "),
        (("--with", "tiny.yaml"), "b: does not belong to a: other runs: trials, seeds, program or "),
    ],
)
def test_shards_of_other_evaluations_are_refused(tiny: CommandLine, other: tuple[str, ...], message: str) -> None:
    shard(tiny, "a")
    work = ["programs.py:Missing" if word == AGENT else word for word in WORK]
    tiny(*work, "--seeds", "2", "--out", "b", *other)
    shutil.copy("b/plan.json", "plan.json")
    change("b/plan.json", "programs.py:Missing", AGENT)
    for folders in (("a", "b"), ("a", "--out", "b")):
        ran = tiny("eval", "merge", *folders)
        assert ran.status == 2
        assert ran.err.startswith(f"error: {message}")
    assert not Path("b", "summary.json").exists()
    shutil.copy("plan.json", "b/plan.json")
    assert "b: does not belong to a: agent programs.py:Missing, but " in tiny("eval", "merge", "a", "b").err


def test_shard_of_other_versions_is_refused(tiny: CommandLine) -> None:
    shard(tiny, "a")
    change("a/plan.json", '"mujoco":"', '"mujoco":"0.')
    ran = tiny("eval", "merge", "a")
    assert ran.status == 2
    assert ran.err.startswith("error: a: does not belong to this installation: versions cellwright ")


@pytest.mark.parametrize("text", ["", "[]", "{}", "[" * 100_000, '{"agent": 1}', "\x00"])
def test_damaged_plan_is_refused_in_one_line(tiny: CommandLine, text: str) -> None:
    shard(tiny, "a")
    Path("a/plan.json").write_text(text)
    ran = tiny("eval", "merge", "a")
    assert ran.status == 2
    assert re.fullmatch(r"error: a/plan\.json: not a plan \(.*\); repeat that shard\n", ran.err)


def test_folders_without_an_evaluation_are_refused(tiny: CommandLine) -> None:
    Path("empty").mkdir()
    ran = tiny("eval", "merge", "empty")
    assert (ran.status, ran.err) == (2, "error: empty: it has no plan.json; give the --out of `cellwright eval`\n")
    shard(tiny, "a")
    Path("a/results.jsonl").unlink()
    ran = tiny("eval", "merge", "a")
    assert (ran.status, ran.err) == (2, "error: a/results.jsonl: No such file or directory\n")
    assert tiny("eval", "merge").status == 2


def test_more_shards_than_runs_are_refused(tiny: CommandLine) -> None:
    ran = tiny(*WORK, "--seeds", "2", "--shard", "5/5")
    message = "error: --shard 5/5: there are only 4 runs; give no more shards than runs\n"
    assert (ran.status, ran.err) == (2, message)
    ran = tiny(*WORK, "--shard", "auto/4")
    assert (ran.status, ran.err.partition(" is set")[0]) == (
        2,
        "error: --shard auto/4: none of SLURM_ARRAY_TASK_ID, JOB_COMPLETION_INDEX",
    )


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no such signal there")
@pytest.mark.usefixtures(*QUICK_WORKERS.args)
def test_machine_that_kills_a_run_has_exit_status_75(tiny: CommandLine) -> None:
    kill = "import os, subprocess\n" + "class Killed:\n    def run(self, client):\n"
    Path("killed.py").write_text(kill + "        subprocess.run(['kill', '-KILL', str(os.getpid())])\n")
    ran = tiny("eval", "tiny.yaml", "--agent", "killed.py:Killed", "--json")
    assert ran.status == 75
    assert "error: tiny seed 1: killed by SIGKILL from outside; no result after 3 starts" in ran.err
    document = json.loads(ran.out)
    assert (document["exit_status"], document["runs"]) == (75, 0)
    assert b"<testcase" not in Path("evaluation/junit.xml").read_bytes()


@pytest.mark.skipif(sys.platform != "linux", reason="it has no /dev/full")
def test_full_disk_is_no_bad_input(tiny: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    shard(tiny, "a")

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device", "b")

    monkeypatch.setattr(Path, "mkdir", full)
    ran = tiny(*WORK, "--out", "b")
    assert (ran.status, ran.err) == (75, "error: --out b: cannot be written: No space left on device\n")
    ran = tiny("eval", "merge", "a", "--out", "b")
    assert (ran.status, ran.err) == (75, "error: b: No space left on device\n")
