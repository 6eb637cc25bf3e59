"""Tests of the queue of runs whose number follows from their results."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

from hypothesis import given
from hypothesis import strategies as st

from cellwright.running.evaluation.execution.seed_queue import SeedQueue
from cellwright.running.evaluation.plan.job import EvaluatedTrial, Job
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.summary import Threshold
from cellwright.running.evaluation.results.width_rule import WidthRule
from tests.running.evaluation.made_results import result

RULE = WidthRule(0.5, 3, 30, Threshold(1.0, is_share=True))


def jobs(trial: str = "tiny", count: int = RULE.most) -> list[Job]:
    made = EvaluatedTrial(trial, (), 12.0, 12.0, 60.0)
    return [Job(made, "a.py:A", seed, False, f"{trial}-{seed}") for seed in range(1, count + 1)]


class Evaluation:
    """Runs of two trials on several processes, each of which ends at a call; a seed has its own result."""

    def __init__(self, passed: Sequence[bool]) -> None:
        self._passed = passed
        self.known: dict[str, Result] = {}
        self.running: list[Job] = []
        self.lost: list[Job] = []
        self.queue = SeedQueue([*jobs(), *jobs("other")], RULE, lambda job: self.known.get(job.key))

    def begin(self, processes: int) -> None:
        while len(self.running) < processes and (more := self.queue.next_jobs(self.lost)):
            self.running += more

    def end(self, job: Job) -> None:
        self.running.remove(job)
        passed = self._passed[job.seed % len(self._passed)] if job.trial.name == "tiny" else True
        self.known[job.key] = result(12.0 if passed else 0.0, trial=job.trial.name, seed=job.seed, key=job.key)


def finished(passed: Sequence[bool], processes: int, order: Random) -> Evaluation:
    """Return an evaluation at its end; `order` draws which run in progress ends next."""
    found = Evaluation(passed)
    found.begin(processes)
    while found.running:
        found.end(order.choice(found.running))
        found.begin(processes)
    return found


@given(
    passed=st.lists(st.booleans(), min_size=1, max_size=12),
    processes=st.integers(1, 9),
    order=st.randoms(use_true_random=False),
)
def test_what_counts_does_not_depend_on_processes_or_on_which_run_ends_first(
    passed: list[bool], processes: int, order: Random
) -> None:
    alone, together = finished(passed, 1, Random(1)), finished(passed, processes, order)
    assert [each.key for each in together.queue.results()] == [each.key for each in alone.queue.results()]
    assert together.queue.left == alone.queue.left == 0
    counted = {each.key for each in alone.queue.results()}
    assert set(alone.known) == counted  # one process begins nothing that does not count
    assert len(set(together.known) - counted) <= 2 * max(RULE.least, processes)


def test_runs_that_count_in_any_case_come_first_and_then_one_of_each_trial() -> None:
    found = Evaluation([True])
    first = found.queue.next_jobs()
    # of runs that all pass the rule wants four, since 1.96 squared is 0.5 of itself and 3.84
    assert [job.key for job in first] == [f"{trial}-{seed}" for trial in ("tiny", "other") for seed in (1, 2, 3)]
    assert [job.key for job in found.queue.next_jobs()] == ["tiny-4", "other-4"]
    assert found.queue.left == 6


def test_known_results_are_not_run_again() -> None:
    found = Evaluation([True])
    found.running = jobs()[:2]
    for job in jobs()[:2]:
        found.end(job)
    assert [job.key for job in found.queue.next_jobs()][:2] == ["tiny-3", "tiny-4"]


def test_trial_ends_at_a_run_that_is_lost_and_says_what_is_left() -> None:
    found = Evaluation([True])
    found.begin(1)
    lost = next(job for job in found.running if job.key == "tiny-2")
    found.running.remove(lost)
    found.lost.append(lost)
    while found.running:
        found.end(found.running[0])
        found.begin(1)
    assert [each.key for each in found.queue.results()] == ["tiny-1", *(f"other-{seed}" for seed in range(1, 5))]
    assert found.queue.left == 3
    assert not any(key.startswith("tiny-4") for key in found.known)
    assert found.queue.sentences()[1] == "other: 4 of at most 30 seeds, interval 49 % wide"


def test_trial_that_stays_uncertain_says_so() -> None:
    rule = WidthRule(0.1, 2, 6, RULE.threshold)
    known = {job.key: result(12.0 * (job.seed % 2), seed=job.seed) for job in jobs(count=6)}
    queue = SeedQueue(jobs(count=6), rule, lambda job: known.get(job.key))
    assert (queue.next_jobs(), len(queue.results()), queue.left) == ([], 6, 0)
    assert queue.sentences() == ["tiny: 6 of at most 6 seeds, interval 62.5 % wide, more than was asked for"]
