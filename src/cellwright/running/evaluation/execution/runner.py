"""Base of the runners of an evaluation: settled jobs, new results, and faults of machines."""

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field

from cellwright.running.evaluation.plan.job import Job, RunLimits
from cellwright.running.evaluation.results.infrastructure import InfrastructureLoss
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.results_file import ResultsFile

STARTS = 3
"""Starts of a run that the machine ends."""


@dataclass(frozen=True, slots=True)
class Running:
    """A job in progress: its start [s of wall time], its simulation time so far [s], and its points."""

    job: Job
    wall: float
    simulated: float
    points: float


@dataclass(frozen=True, slots=True)
class RunnerOptions:
    """Limits and recordings of the runs, and who hears of them.

    Attributes:
        limits: limits of each run.
        records: record the runs.
        on_result: called with each new result.
        on_progress: called several times a second, with the jobs in progress as far as something is known of them.
        on_fault: called with a line about the machine, such as when it has ended a run that starts again.
        more: called when a process has no run left; returns further ones, none if there are none now.
    """

    limits: RunLimits = field(default_factory=RunLimits)
    records: bool = False
    on_result: Callable[[Result], None] = lambda _result: None
    on_progress: Callable[[Sequence[Running]], None] = lambda _running: None
    on_fault: Callable[[str], None] = lambda _line: None
    more: Callable[[], Iterable[Job]] = lambda: ()


class Runner(ABC):
    """Base of what runs the jobs of an evaluation: on this machine, or on a cluster.

    Args:
        store: stores the results, and holds those of earlier evaluations.
        options: limits of the runs, and who hears of them.
    """

    def __init__(self, store: ResultsFile, options: RunnerOptions) -> None:
        self._store = store
        self._options = options
        self._limits = options.limits
        self._stopped = False
        self.failure = ""
        """Reason why the evaluation could not continue, in one line; empty if it could. Results up to then are kept."""
        self.faults: dict[Job, str] = {}
        """Runs that the machine ended at every start, and how. They have no result."""

    @abstractmethod
    def check_agent(self, agent: str) -> str:
        """Return why an agent cannot be used; empty if it can. If the machine prevents that, `failure` says how."""

    @abstractmethod
    def run(self, jobs: Iterable[Job]) -> bool:
        """Run all jobs that are not settled; return False if it was stopped or failed before all had a result."""

    @property
    def lost(self) -> list[InfrastructureLoss]:
        """`faults`, as reports have them."""
        return [
            InfrastructureLoss(job.trial.name, job.seed, f"{fault}; no result after {STARTS} starts")
            for job, fault in self.faults.items()
        ]

    def is_settled(self, job: Job) -> bool:
        """Return whether the job has a valid result."""
        return self.result_of(job) is not None

    def result_of(self, job: Job) -> Result | None:
        """Return the valid result of a job, if it has one. A lost run counts only under the limits that it had."""
        result = self._store.results.get(job.key)
        return result if result is not None and result.counts_under(asdict(self._limits)) else None

    def unsettled(self, jobs: Iterable[Job]) -> deque[Job]:
        """Return the jobs to run, those of long trials first: a long one at the end would run alone."""
        waiting = (job for job in jobs if not self.is_settled(job))
        return deque(sorted(waiting, key=_max_duration, reverse=True))

    def stop(self) -> None:
        """Make `run` return soon, with the results so far. A signal handler may call this."""
        self._stopped = True

    def _add(self, result: Result) -> None:
        """Store a new result.

        Raises:
            OSError: it could not be written; `on_result` has been called all the same.
        """
        try:
            self._store.append(result)
        finally:
            self._options.on_result(result)

    def _words_of(self, error: OSError) -> str:
        return f"{error.filename or self._store.path}: {error.strerror or error}"


def _max_duration(job: Job) -> float:
    """Return the simulation time [s] that a job lasts at most."""
    return math.inf if job.trial.time_limit is None else job.trial.time_limit
