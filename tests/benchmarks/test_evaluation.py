"""Evaluation by one worker and by two."""

import pytest

from benchmarks import evaluation
from benchmarks.benchmarks import BenchmarkSkippedError
from cellwright.util.errors import UsageError
from tests.support.quick_children import QUICK_WORKERS


@QUICK_WORKERS
@pytest.mark.slow
def test_evaluation_quick_run_yields_ratio_of_two_workers() -> None:
    progress: list[str] = []
    one, two, ratio = evaluation.measure(progress.append, quick=True)
    assert progress == ["2 runs, 1 at a time, repeat 1", "2 runs, 2 at a time, repeat 1"]
    assert one.label == "2 runs of 0.2 s, 1 at a time"
    assert ratio.value == pytest.approx(two.value / one.value)
    assert ratio.minimum == 1.9


def test_evaluation_jobs_are_even_in_number() -> None:
    jobs = evaluation.finals("benchmarks.evaluation:Mover", evaluation.FINALS)
    assert len(jobs) == 30
    assert {job.seed for job in jobs} == {1, 2}


def test_evaluation_on_one_processor_is_skipped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(evaluation, "usable_processors", lambda: 1)
    with pytest.raises(BenchmarkSkippedError, match="two processors"):
        next(evaluation.measure(print))


class Fails:
    """An agent that fails at once."""

    work = 0.0

    def run(self, client: object) -> None:
        raise ValueError("no idea")


@QUICK_WORKERS
@pytest.mark.slow
def test_unfinished_run_is_reported_by_name() -> None:
    jobs = evaluation.finals(f"{__name__}:Fails", ["final01"])[:1]
    with pytest.raises(UsageError, match="not done: final01"):
        evaluation.times(jobs, 1)
