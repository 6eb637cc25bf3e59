"""Evaluation on a Ray cluster of this machine, by a runner that needs no Ray."""

from __future__ import annotations

import pytest

from benchmarks import evaluation, ray_cluster
from benchmarks.benchmarks import BenchmarkSkippedError
from cellwright.running.evaluation.execution.local import LocalRunner
from cellwright.running.evaluation.execution.runner import RunnerOptions
from cellwright.running.evaluation.plan.job import Job
from cellwright.running.evaluation.results.results_file import ResultsFile
from cellwright.util.errors import UsageError
from tests.support.quick_children import QUICK_WORKERS


class Local(LocalRunner):
    """The runner of this machine, with the arguments of that on Ray."""

    def __init__(self, store: ResultsFile, address: str, jobs: list[Job], options: RunnerOptions, *, most: int) -> None:
        assert address == "local"
        super().__init__(store, options, workers=most)


class Refused(Local):
    def check_agent(self, agent: str) -> str:
        return "--ray local: no"


@pytest.fixture(autouse=True)
def local_runner(monkeypatch: pytest.MonkeyPatch) -> None:
    """Use the local runner."""
    monkeypatch.setattr(ray_cluster, "RayRunner", Local)


@QUICK_WORKERS
@pytest.mark.slow
def test_ray_quick_run_yields_ratios() -> None:
    progress: list[str] = []
    one, two, plain, gain, cost, start = ray_cluster.measure(progress.append, quick=True)
    assert [line.rpartition(",")[0] for line in progress] == [
        "2 runs on Ray, 1 at a time",
        "2 runs on Ray, 2 at a time",
        "2 runs without Ray, 2 at a time",
    ]
    assert one.label == "2 runs of 0.2 s on Ray, 1 at a time"
    assert gain.value == pytest.approx(two.value / one.value)
    assert gain.minimum == 1.9
    assert cost.value == pytest.approx(plain.value / two.value)
    assert start.unit == "s"


def test_ray_runs_are_even_in_number() -> None:
    assert len(evaluation.finals("lesson", evaluation.FINALS)) % 2 == 0


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [("find_spec", lambda name: None, "requires ray"), ("usable_processors", lambda: 1, "requires two processors")],
)
def test_ray_benchmark_without_its_requirements_is_skipped(
    name: str, value: object, reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ray_cluster, name, value)
    with pytest.raises(BenchmarkSkippedError, match=reason):
        next(iter(ray_cluster.measure(print)))


def test_refused_cluster_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ray_cluster, "RayRunner", Refused)
    with pytest.raises(UsageError, match="--ray local: no"):
        next(iter(ray_cluster.measure(print, quick=True)))
