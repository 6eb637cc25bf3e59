"""Tests of jobs in real processes: good ones, and bad ones, which affect no other job."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from cellwright.running.evaluation.execution.local import LocalRunner
from cellwright.running.evaluation.execution.memory import MEMORY_IS_LIMITED
from cellwright.running.evaluation.execution.runner import RunnerOptions, Running
from cellwright.running.evaluation.plan.job import EvaluatedTrial, RunLimits, make_jobs
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.results_file import ResultsFile
from cellwright.util.errors import UsageError
from cellwright.util.files import read_json_lines
from tests.running.evaluation.conftest import Judge, tiny_jobs
from tests.support.processes import is_running
from tests.support.quick_children import QUICK_WORKERS
from tests.support.waiting import wait_until

POSIX = pytest.mark.skipif(sys.platform == "win32", reason="no such signals there")
LINUX = pytest.mark.skipif(not MEMORY_IS_LIMITED, reason="memory is not limited there")


RODS = """
options: {insert_models_over_bins: true}
models_over_bins:
  bin7:
    models:
      piston_rod_part:
        {xyz_start: [0.1, 0.1, 0.0], xyz_end: [0.5, 0.5, 0.0], rpy: [0, 0, 0], num_models_x: 2, num_models_y: 2}
"""


@pytest.mark.slow
def test_completed_run_has_points_and_timeline(judge: Judge, folder: Path) -> None:
    (result,) = judge("Deliver")
    assert (result.outcome, result.points, result.best, result.reason, result.log) == ("done", 6.0, 6.0, "", ())
    assert (result.trial, result.agent, result.seed, result.vary) == ("tiny", "programs.py:Deliver", 1, False)
    assert result.simulated == pytest.approx(1.852)
    assert result.wall > 0.0
    assert len(result.state_hash) == 64
    assert result.score["orders"][0]["kits"][0]["parts"][0]["verdict"] == "placed"
    assert [kit["points"] for kit in result.timeline["kits"]] == [6.0]
    referee, printed = sorted((folder / "out" / "logs").iterdir())
    assert printed.name.startswith("tiny-1-")
    assert printed.read_text().splitlines() == ["stdin: ", "sending the kit"]
    assert read_json_lines(referee)[-1]["state_hash"] == result.state_hash
    assert result.command.startswith("cellwright run ")
    assert result.command.endswith("tiny.yaml --agent programs.py:Deliver --seed 1")


@QUICK_WORKERS
@pytest.mark.slow
def test_varied_run_differs_by_seed(folder: Path) -> None:
    (folder / "rods.yaml").write_text(RODS)
    trial = EvaluatedTrial("rods", (folder / "rods.yaml",), 0.0, 0.0, 500.0)
    hashes: dict[bool, set[str]] = {}
    for vary in (False, True):
        with ResultsFile(folder / "out") as store:
            jobs = make_jobs([trial], "programs.py:GiveUp", [1, 2], vary=vary)
            LocalRunner(store).run(jobs)
            hashes[vary] = {store.results[job.key].state_hash for job in jobs}
            assert all(("--vary" in store.results[job.key].command) == vary for job in jobs)
    assert "" not in hashes[True] | hashes[False]
    assert len(hashes[True]) == 2
    assert not hashes[True] & hashes[False]


@pytest.mark.slow
def test_results_are_equal_for_any_number_of_workers(judge: Judge, folder: Path) -> None:
    alone = judge("Deliver", seeds=2)
    (folder / "out" / "results.jsonl").unlink()
    together = judge("Deliver", seeds=2, workers=2)

    def what_counts(results: list[Result]) -> Sequence[object]:
        return sorted((each.key, each.state_hash, each.points, str(each.timeline), str(each.score)) for each in results)

    assert what_counts(alone) == what_counts(together)


@QUICK_WORKERS
@pytest.mark.slow
def test_jobs_of_long_trials_run_first(folder: Path) -> None:
    trials = []
    for name, limit in {"ended": 0.0, "short": 60.0, "endless": None, "long": 500.0}.items():
        (folder / f"{name}.yaml").write_text(f"time_limit: {-1 if limit is None else limit}")
        trials.append(EvaluatedTrial(name, (folder / "tiny.yaml", folder / f"{name}.yaml"), 6.0, 6.0, limit))
    results: list[Result] = []
    with ResultsFile(folder / "out") as store:
        jobs = make_jobs(trials, "programs.py:GiveUp", [1], vary=False)
        assert LocalRunner(store, RunnerOptions(on_result=results.append)).run(jobs)
    assert [result.trial for result in results] == ["endless", "long", "short", "ended"]


@QUICK_WORKERS
@pytest.mark.slow
def test_settled_job_is_not_run_again(judge: Judge) -> None:
    first = judge("Noted")
    assert len(first) == 1
    assert judge("Noted") == []
    assert Path("notes.txt").read_text() == "run\n"


@QUICK_WORKERS
@pytest.mark.slow
@pytest.mark.parametrize(
    ("program", "outcome", "reason", "logged"),
    [
        ("GiveUp", "gave_up", "the agent ended before the orders were complete", ""),
        ("Crash", "crashed", "LookupError: the part <gone> & away \\x07", "in run"),
        ("Exit", "crashed", "the agent exited with 3", "the agent exited with 3"),
        ("Quit", "died", "the process ended without a result: exit status 0", "last words"),
        pytest.param("Kill", "died", "the process ended without a result: killed by SIGKILL", "", marks=POSIX),
    ],
)
def test_incomplete_run_has_outcome_and_reason(
    judge: Judge, program: str, outcome: str, reason: str, logged: str
) -> None:
    (result,) = judge(program)
    assert (result.outcome, result.reason, result.points, result.best) == (outcome, reason, 0.0, 6.0)
    assert result.is_lost == (outcome == "died")
    assert logged in "\n".join(result.log)


@QUICK_WORKERS
@pytest.mark.slow
def test_hanging_program_hits_wall_limit(judge: Judge) -> None:
    (result,) = judge("Hang", wall=2.0)
    assert (result.outcome, result.reason) == ("wall_limit", "still running after 2 s")
    assert result.is_lost
    assert any("programs.py" in line and "in run" in line for line in result.log)


@QUICK_WORKERS
@pytest.mark.slow
@pytest.mark.parametrize(
    ("program", "limits", "outcome", "reason"),
    [
        (
            "Hang",
            {"wall": 1.0},
            "wall_limit",
            "not run, since 1 runs before were over a limit: still running after 1 s",
        ),
        (
            "NeverStarts",
            {"start": 1.0},
            "start_limit",
            "not run, since 1 runs before were over a limit: the competition",
        ),
        ("Unmade", {}, "refused", "programs.py:Unmade: "),
    ],
)
def test_program_that_is_lost_alike_is_not_run_again(
    folder: Path, program: str, limits: dict[str, float], outcome: str, reason: str
) -> None:
    results: list[Result] = []
    with ResultsFile(folder / "out") as store:
        limited = RunLimits(**limits)  # type: ignore[arg-type]
        evaluation = LocalRunner(store, RunnerOptions(limited, on_result=results.append), stop_after=1)
        evaluation.run([*tiny_jobs(folder, program, 3), *tiny_jobs(folder, "Deliver")])
    outcomes = [each.outcome for each in results]
    assert (outcomes[0], outcomes[-1]) == (outcome, "done")
    assert set(outcomes[1:-1]) in ({"not_run"}, {outcome, "not_run"})  # the next may begin before one is judged
    assert all(each.reason.startswith(reason) for each in results if each.outcome == "not_run")


@QUICK_WORKERS
@pytest.mark.slow
@LINUX
def test_program_over_memory_limit_is_ended(judge: Judge) -> None:
    (result,) = judge("Eat", memory=400 << 20)
    assert (result.outcome, result.reason) == ("memory_limit", "needed more than 400 MiB of memory: MemoryError")


@QUICK_WORKERS
@pytest.mark.slow
@LINUX
def test_memory_of_child_processes_counts(judge: Judge) -> None:
    (result,) = judge("EatInChildren", memory=500 << 20)
    assert (result.outcome, result.reason) == ("memory_limit", "needed more than 500 MiB of memory")
    assert result.simulated == 0.0


@QUICK_WORKERS
@pytest.mark.slow
def test_program_over_log_limit_is_ended(judge: Judge) -> None:
    (result,) = judge("Chatter", log=1 << 20)
    assert (result.outcome, result.reason) == ("log_limit", "wrote more than 1 MiB to its log")
    assert result.log


@pytest.mark.slow
@LINUX
def test_leftover_processes_of_program_are_ended(judge: Judge) -> None:
    (result,) = judge("LeaveBehind")
    assert result.outcome == "done"
    left = [int(number) for number in Path("left.txt").read_text().split()]
    assert len(left) == 2
    wait_until(lambda: not any(map(is_running, left)), "end of what the program left behind")


@QUICK_WORKERS
@pytest.mark.slow
@POSIX
def test_forked_child_with_open_pipes_does_not_delay_end(judge: Judge) -> None:
    (result,) = judge("ForkAndDie")
    assert result.reason == "the process ended without a result: exit status 7"


@QUICK_WORKERS
@pytest.mark.slow
def test_lost_run_is_repeated_under_other_limits(judge: Judge) -> None:
    assert [each.outcome for each in judge("Quit")] == ["died"]
    assert judge("Quit") == []
    assert [each.outcome for each in judge("Quit", wall=300.0)] == ["died"]
    assert [each.outcome for each in judge("GiveUp")] == ["gave_up"]
    assert judge("GiveUp", wall=300.0) == []


@pytest.mark.slow
def test_interrupted_evaluation_keeps_results_and_leaves_no_process(folder: Path) -> None:
    results: list[Result] = []
    seen: list[Running] = []

    def interrupt_later(running: object) -> None:
        assert isinstance(running, list)
        seen.extend(running)
        if results and running:
            raise KeyboardInterrupt

    jobs = tiny_jobs(folder, "Deliver") + tiny_jobs(folder, "Hang")
    with ResultsFile(folder / "out") as store:
        evaluation = LocalRunner(store, RunnerOptions(on_result=results.append, on_progress=interrupt_later))
        with pytest.raises(KeyboardInterrupt):
            evaluation.run(jobs)
        assert [each.outcome for each in store.results.values()] == ["done"]
        assert evaluation.is_settled(jobs[0])
        assert not evaluation.is_settled(jobs[1])
    assert seen[-1].job == jobs[1]
    assert seen[-1].wall > 0.0


@QUICK_WORKERS
@pytest.mark.slow
@pytest.mark.parametrize(
    ("program", "problem"),
    [
        ("programs.py:Deliver", ""),
        ("programs.py:Delivers", "did you mean Deliver"),
        ("programs.py:CannotBeMade", "cannot be made: OSError: no map found"),
        ("programs.py:DiesWhenMade", "the process that creates it ended early (exit status 9)"),
        ("missing", "unknown agent 'missing'"),
    ],
)
def test_check_agent_returns_problem_of_agent(folder: Path, program: str, problem: str) -> None:
    with ResultsFile(folder / "out") as store:
        reason_given = LocalRunner(store).check_agent(program)
    assert problem in reason_given
    assert bool(reason_given) == bool(problem)


@QUICK_WORKERS
@pytest.mark.slow
def test_missing_trial_loses_only_its_own_run(folder: Path) -> None:
    jobs = tiny_jobs(folder, "Deliver")
    (folder / "tiny.yaml").unlink()
    with ResultsFile(folder / "out") as store:
        LocalRunner(store).run(jobs)
        (result,) = store.results.values()
    assert result.outcome == "died"
    assert "tiny.yaml" in "\n".join(result.log)


@QUICK_WORKERS
@pytest.mark.slow
def test_stopped_evaluation_reports_unfinished_jobs(folder: Path) -> None:
    jobs = tiny_jobs(folder, "Deliver", seeds=2)
    with ResultsFile(folder / "out") as store:
        evaluation = LocalRunner(store, RunnerOptions(on_result=lambda _: evaluation.stop()))
        assert not evaluation.run(jobs)
        assert [evaluation.is_settled(job) for job in jobs] == [True, False]
        assert LocalRunner(store).run(jobs)


def test_zero_workers_are_refused(folder: Path) -> None:
    with ResultsFile(folder / "out") as store, pytest.raises(UsageError, match="workers must be at least 1"):
        LocalRunner(store, workers=0)


def test_evaluation_without_jobs_has_no_results(folder: Path) -> None:
    with ResultsFile(folder / "out") as store:
        LocalRunner(store).run(make_jobs([], "lesson", [1], vary=False))
        assert not store.results


@QUICK_WORKERS
@pytest.mark.slow
def test_full_disk_ends_evaluation_and_keeps_results(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    results: list[Result] = []

    def full(_number: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with ResultsFile(folder / "out") as store:
        monkeypatch.setattr("cellwright.running.evaluation.results.results_file.os.fsync", full)
        evaluation = LocalRunner(store, RunnerOptions(on_result=results.append))
        assert not evaluation.run(tiny_jobs(folder, "Deliver", 3))
        assert evaluation.failure == f"{store.path}: No space left on device"
        assert [result.points for result in results] == [6.0]
        assert list(store.results.values()) == results


@QUICK_WORKERS
@pytest.mark.slow
def test_unwritable_log_does_not_lose_run(judge: Judge, folder: Path) -> None:
    (job,) = tiny_jobs(folder, "Deliver")
    blocked = folder / "out" / "logs" / job.log_name
    blocked.with_suffix(".jsonl").mkdir(parents=True)
    (result,) = judge("Deliver")
    assert (result.outcome, result.points) == ("done", 6.0)
    assert "cannot be written" in blocked.read_text()


def test_log_folder_that_is_a_file_is_reported(folder: Path) -> None:
    (folder / "out").mkdir()
    (folder / "out" / "logs").write_text("")
    with ResultsFile(folder / "out") as store:
        evaluation = LocalRunner(store)
        assert not evaluation.run(tiny_jobs(folder, "Deliver"))
        assert str(folder / "out" / "logs") in evaluation.failure
