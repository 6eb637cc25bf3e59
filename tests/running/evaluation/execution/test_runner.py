"""Tests of what all runners share: settled jobs, their order, and faults of the machine."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, replace
from pathlib import Path

from cellwright.running.evaluation.execution.runner import Runner, RunnerOptions
from cellwright.running.evaluation.plan.job import EvaluatedTrial, Job, RunLimits
from cellwright.running.evaluation.results.results_file import ResultsFile
from tests.running.evaluation.made_results import LOST, result


class Idle(Runner):
    def check_agent(self, agent: str) -> str:
        return agent

    def run(self, jobs: Iterable[Job]) -> bool:
        return not self.unsettled(jobs)


def job(key: str, time_limit: float | None = 60.0) -> Job:
    return Job(EvaluatedTrial("tiny", (), 6.0, 6.0, time_limit), "a.py:A", 1, False, key)


def test_lost_run_is_settled_under_its_own_limits_alone(tmp_path: Path) -> None:
    done, lost = result(key="done"), replace(LOST, key="lost", limits=asdict(RunLimits()))
    with ResultsFile(tmp_path) as store:
        store.append(done, lost)
        assert Idle(store, RunnerOptions()).run([job("done"), job("lost")])
        other = Idle(store, RunnerOptions(RunLimits(wall=5.0)))
        assert (other.is_settled(job("done")), other.is_settled(job("lost"))) == (True, False)


def test_runs_of_long_trials_come_first(tmp_path: Path) -> None:
    jobs = [job("short", 10.0), job("endless", None), job("long", 90.0)]
    with ResultsFile(tmp_path) as store:
        assert [each.key for each in Idle(store, RunnerOptions()).unsettled(jobs)] == ["endless", "long", "short"]


def test_runs_that_the_machine_ended_are_named(tmp_path: Path) -> None:
    with ResultsFile(tmp_path) as store:
        runner = Idle(store, RunnerOptions())
    runner.faults[job("a")] = "killed by SIGKILL from outside"
    assert [each.line for each in runner.lost] == [
        "tiny seed 1: killed by SIGKILL from outside; no result after 3 starts"
    ]
