"""Queue of the runs of an evaluation whose number follows from their results."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from itertools import chain

from cellwright.running.evaluation.plan.job import Job
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.width_rule import WidthRule


class SeedQueue:
    """The runs of each trial in the order of their seeds, until a rule is met.

    Args:
        jobs: all that may be run; those of a trial in the order of their seeds, as many as the rule's `most`.
        rule: the rule.
        find: returns the valid result of a run; None if there is none yet.
    """

    def __init__(self, jobs: Sequence[Job], rule: WidthRule, find: Callable[[Job], Result | None]) -> None:
        self._rule, self._find = rule, find
        self._trials: dict[str, list[Job]] = {}
        for job in jobs:
            self._trials.setdefault(job.trial.name, []).append(job)
        self._counted: dict[str, list[Result]] = {trial: [] for trial in self._trials}
        self._open = set(self._trials)
        self._begun: set[str] = set()

    def next_jobs(self, lost: Collection[Job] = ()) -> list[Job]:
        """Return runs to begin, now that a process has none; each is returned once.

        These are all that count in any case. If they have begun, one more of each trial comes, so that no process
        waits; whether it counts is known later. There are as many of these as runs in progress, or as the rule wants
        at least: a slow run keeps the others from counting. A trial ends at a run that is lost.

        Args:
            lost: runs without a result that are not repeated.
        """
        self._count()
        stuck = {job.trial.name for job in lost}
        in_progress = sum(job.key in self._begun and self._find(job) is None for job in chain(*self._trials.values()))
        certain, likely = [], []
        for trial in (name for name in self._trials if name in self._open and name not in stuck):
            jobs, end = self._trials[trial], self._rule.least_end(self._counted[trial])
            first, later = ([job for job in part if self._is_new(job)] for part in (jobs[:end], jobs[end:]))
            certain += first
            if len(jobs) - end - len(later) < max(self._rule.least, in_progress):
                likely += later[:1]
        chosen = certain or likely
        self._begun |= {job.key for job in chosen}
        return chosen

    def results(self) -> list[Result]:
        """Return the results that count: trial by trial, in the order of their seeds."""
        self._count()
        return [result for counted in self._counted.values() for result in counted]

    @property
    def left(self) -> int:
        """Number of runs that are missing in any case; 0 if the rule is met in each trial."""
        self._count()
        return sum(self._rule.least_end(self._counted[trial]) - len(self._counted[trial]) for trial in self._open)

    def sentences(self) -> list[str]:
        """Return for each trial how many seeds count, and how wide its interval is then."""
        found = []
        for trial, counted in self._counted.items():
            interval = self._rule.interval(counted)
            width = "no interval" if interval is None else f"interval {100.0 * (interval[1] - interval[0]):.3g} % wide"
            runs = f"{len(counted)} of at most {self._rule.most} seeds"
            wide = interval is not None and interval[1] - interval[0] > self._rule.width and trial not in self._open
            found.append(f"{trial}: {runs}, {width}{', more than was asked for' if wide else ''}")
        return found

    def _is_new(self, job: Job) -> bool:
        return job.key not in self._begun and self._find(job) is None

    def _count(self) -> None:
        """Count the runs of first seeds that have a result, up to where the rule is met."""
        for trial in tuple(self._open):
            jobs, counted = self._trials[trial], self._counted[trial]
            while not (is_met := self._rule.is_met(counted)):
                result = self._find(jobs[len(counted)])
                if result is None:
                    break
                counted.append(result)
            if is_met:
                self._open.remove(trial)
