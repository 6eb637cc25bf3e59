"""Execution of many jobs in parallel: a process for each, within its limits, with its result on disk as it comes.

What the machine does to a run is no result of it. The run is repeated at once, up to `STARTS` starts.
"""

import errno
import time
from collections import Counter, deque
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from cellwright.running.evaluation.execution.channel import Report
from cellwright.running.evaluation.execution.memory import MEMORY_IS_LIMITED, OwnTime, Usage, usage_below
from cellwright.running.evaluation.execution.process import NO_MEMORY, JobOrder, WorkerProcess, worker_server
from cellwright.running.evaluation.execution.replayed import first_difference
from cellwright.running.evaluation.execution.runner import STARTS, Runner, RunnerOptions, Running
from cellwright.running.evaluation.plan.job import MEBIBYTE, Job
from cellwright.running.evaluation.results.folder import LOGS, RECORDINGS
from cellwright.running.evaluation.results.result import POINT_TOLERANCE, Lost, Result, ResultError
from cellwright.running.evaluation.results.results_file import ResultsFile
from cellwright.running.evaluation.results.state import LIVE_NAME, STATES, loses_points, state_file, write_state
from cellwright.running.remote.fork_server import ForkServer
from cellwright.running.run import Outcome
from cellwright.util.errors import UsageError, printable

_CHECK_PERIOD = 0.2  # [s] between two checks of the limits
_START_TIMEOUT = 60.0  # [s] that a process may take before it starts on its job
_END_TIMEOUT = 5.0  # [s] after which a worker is ended that should have ended by then
_CLOCK_TOLERANCE = 0.5  # [s] by which a worker's clock may be ahead of the start that is seen here
_MAX_DELAY = 10.0  # wall time over the limit, where a run's own time is known
_MAX_REASON = 1000  # characters
_NO_ROOM = (errno.EAGAIN, errno.ENOMEM)
"""Errors at the start of a process when the machine has no room for it."""
_SELF_ENDED = "exit status 1"  # of a worker that has seen its time run out


class LocalRunner(Runner):
    """Runs jobs in worker processes of this machine, up to `workers` at a time.

    Args:
        starts: of a run that the machine ends; then it is among `faults`.
        stop_after: runs of one program that may be lost by a limit of time before its others are not run, unless one of
            its runs came to its end; 0 runs all. A program that cannot be made is not run again either.
    """

    def __init__(
        self,
        store: ResultsFile,
        options: RunnerOptions | None = None,
        *,
        workers: int = 1,
        starts: int = STARTS,
        stop_after: int = 0,
    ) -> None:
        if workers < 1:
            raise UsageError(f"workers must be at least 1 (got {workers})")
        super().__init__(store, options or RunnerOptions())
        self._workers = workers
        self._max_starts = starts
        self._stop_after = stop_after
        self._timed_out: Counter[str] = Counter()
        self._hopeless: dict[str, str] = {}  # why an agent is not run again, by its name
        self._waiting: deque[Job] = deque()
        self._running: dict[WorkerProcess, Job] = {}
        self._claims: dict[Job, tuple[Result, Report]] = {}  # of runs that are verified now, or next
        self._starts: Counter[str] = Counter()
        self._failed_starts = 0
        self._live = ""
        self._wakes: SimpleQueue[Any] = SimpleQueue()
        self._server: ForkServer | None = None

    def check_agent(self, agent: str) -> str:
        """Return why an agent cannot be used; empty if it can. A process of its own makes the agent, within the limits.

        If the machine prevents that, `failure` says how.
        """
        try:
            for _ in range(self._max_starts):
                try:
                    worker = WorkerProcess(self._order(agent), self._beside(LOGS, "check.log"), self._running_server())
                except OSError as error:
                    self.failure = self._words_of(error)
                    return ""
                try:
                    worker.wait(_START_TIMEOUT + self._limits.wall)
                finally:
                    ending = worker.stop()
                self.failure = worker.machine_fault(ending)
                if not self.failure:
                    break
                self._options.on_fault(f"check of the agent: {self.failure}")
        finally:
            self._end_server()  # an evaluation may end with its check
        if self.failure:
            return ""
        if worker.refused:
            return worker.refused
        if not worker.made:
            last = "".join(f"\n{line}" for line in worker.last_lines())
            reason = (
                f"sent an invalid line: {worker.invalid}"
                if worker.invalid
                else f"ended early ({ending or 'timed out'})"
            )
            return f"{agent}: the process that creates it {reason}{last}"
        return ""

    def run(self, jobs: Iterable[Job]) -> bool:
        """Run all jobs that are not settled; no worker process outlives this call, however it ends.

        Returns:
            False if it was stopped or failed before all jobs had a result.
        """
        self._waiting = self.unsettled(jobs)
        checked = 0.0
        try:
            while (self._waiting or self._running or self._take_more()) and not self._stopped:
                over = [each for each in self._running if each.is_over]
                # the next ones first: ending a process takes 20 ms, in which its processor would have no work
                try:
                    while len(self._running) - len(over) < self._workers:
                        # further ones may depend on results that are not stored yet
                        has_next = bool(self._waiting) or (not over and self._take_more())
                        if not has_next or not self._begin_next():
                            break
                finally:
                    for worker in over:
                        self._finish(worker)
                with suppress(Empty):
                    self._wakes.get(timeout=0.0 if over else _CHECK_PERIOD)
                if time.monotonic() - checked >= _CHECK_PERIOD:
                    checked = time.monotonic()
                    self._enforce_limits()
                    for worker, job in list(self._running.items())[:1]:  # that which has run the longest
                        self._show_live(worker, job)
                    self._options.on_progress([self._progress_of(worker, job) for worker, job in self._running.items()])
        except OSError as error:
            self.failure = self._words_of(error)
        finally:
            unfinished = bool(self._waiting or self._running or self.faults)
            for worker in self._running:
                worker.stop()
            self._running.clear()
            self._end_server()
        return not unfinished

    def _take_more(self) -> bool:
        """Ask for more jobs when none waits; return whether there are any."""
        self._waiting = self.unsettled(self._options.more())
        return bool(self._waiting)

    def _begin_next(self) -> bool:
        """Start the next job; return False if the machine has no room for its process now.

        Then as many as run now are the most that run in parallel from here on.
        """
        if (reason := self._hopeless.get(self._waiting[0].agent)) and self._waiting[0] not in self._claims:
            job = self._waiting.popleft()
            outcome = Lost.NOT_RUN.value
            self._add(Result.of(job, self._limits, outcome=outcome, reason=reason, points=0.0, wall=0.0))
            return True
        try:
            self._begin(self._waiting[0])
        except OSError as error:
            # While others run, their end makes room. A machine that starts none at all fails for good.
            self._failed_starts += not self._running
            if error.errno not in _NO_ROOM or self._failed_starts >= self._max_starts:
                raise
            self._options.on_fault(f"{self._waiting[0].name}: no process could be started: {error.strerror}")
            self._workers = max(1, len(self._running))
            return False
        self._failed_starts = 0
        self._waiting.popleft()
        return True

    def _begin(self, job: Job) -> None:
        log = self._beside(LOGS, job.log_name)
        record = str(self._record_of(job)) if self._options.records or job.verify else ""
        order = replace(
            self._order(job.program),
            files=[str(file) for file in job.trial.files],
            seed=job.seed,
            vary=job.vary,
            run_log=str(log.with_suffix(".jsonl")),
            record=record,
            overrides=tuple(map(str, job.trial.overrides)),
            over=job.over,
        )
        if job in self._claims:
            log = _verification_log(log)
            order = replace(order, run_log="", record="", over="", replays=record, end=self._claims[job][1].simulated)
        worker = WorkerProcess(order, log, self._running_server(), self._wakes, job.trial.reachable)
        self._running[worker] = job

    def _running_server(self) -> ForkServer | None:
        if self._server is None or not self._server.is_running:
            self._server = worker_server()
        return self._server

    def _end_server(self) -> None:
        if self._server is not None:
            self._server.close()

    def _record_of(self, job: Job) -> Path:
        return self._beside(RECORDINGS, job.log_name).with_suffix(".mcap")

    def _order(self, agent: str) -> JobOrder:
        memory = self._limits.memory if MEMORY_IS_LIMITED else 0
        return JobOrder(agent, self._longest, memory, start=self._limits.start)

    def _beside(self, kind: str, name: str) -> Path:
        folder = self._store.path.parent / kind
        folder.mkdir(exist_ok=True)
        return folder / name

    def _progress_of(self, worker: WorkerProcess, job: Job) -> Running:
        progress = worker.progress
        return Running(job, time.monotonic() - worker.started, progress.time, progress.points)

    def _finish(self, worker: WorkerProcess, exceeded: tuple[Lost, str] | None = None) -> None:
        """Store the result of a job whose worker has ended or has exceeded a limit; or let it be verified first."""
        job = self._running.pop(worker)
        progress = self._progress_of(worker, job)
        ending = worker.stop()
        if exceeded is None and (fault := worker.machine_fault(ending)):
            self._repeat(job, fault)
            return
        result = self._result_of(job, worker, exceeded, ending, progress)
        if job in self._claims:
            result = self._verified(job, result, worker.result)
        elif job.verify and worker.result is not None and not result.is_lost:
            self._claims[job] = result, worker.result
            self._waiting.appendleft(job)
            return
        elif job.verify and not self._options.records:
            self._record_of(job).unlink(missing_ok=True)
        if loses_points(result):
            self._keep_state(worker, job)
        elif not self._live:
            self._show_live(worker, job)
        self._judge(result)
        self._add(result)

    def _judge(self, result: Result) -> None:
        """Decide whether the agent of a new result is run again."""
        agent, reason = result.agent, result.reason
        if not self._stop_after:
            return
        if result.outcome == Lost.REFUSED:
            self._hopeless[agent] = reason
        elif result.outcome in (Lost.WALL_LIMIT, Lost.START_LIMIT):
            self._timed_out[agent] += 1
            if self._timed_out[agent] >= self._stop_after:
                self._hopeless[agent] = f"not run, since {self._stop_after} runs before were over a limit: {reason}"
        elif not result.is_lost:
            del self._timed_out[agent]

    def _result_of(
        self, job: Job, worker: WorkerProcess, exceeded: tuple[Lost, str] | None, ending: str, progress: Running
    ) -> Result:
        """Return the result of a worker that has ended, by its report if that is valid."""
        if worker.invalid and exceeded is None:
            exceeded = Lost.INVALID, f"its process sent an invalid line: {worker.invalid}"
        if worker.result is not None and exceeded is None:
            try:
                result = self._reported(job, worker.result)
            except ResultError as error:
                exceeded = Lost.INVALID, f"its process sent an invalid result: {printable(str(error), _MAX_REASON)}"
            else:
                return result if result.is_done else replace(result, log=worker.last_lines())
        since = time.monotonic() - (worker.begun or worker.started)
        # A worker ends itself at its limit too, and may be a moment ahead of the check here.
        if exceeded is None and ending == _SELF_ENDED and since >= self._longest - _CLOCK_TOLERANCE:
            exceeded = Lost.WALL_LIMIT, f"still running after {self._limits.wall:g} s"
        refused = " ".join(worker.refused.split())
        otherwise = Lost.REFUSED if refused else Lost.DIED
        kind, reason = exceeded or (otherwise, refused or f"the process ended without a result: {ending}")
        figures = {"points": 0.0, "wall": progress.wall, "simulated": progress.simulated}
        log = worker.last_lines()
        return Result.of(job, self._limits, outcome=kind.value, reason=reason, log=log, **figures)

    def _verified(self, job: Job, played: Result, report: Report | None) -> Result:
        """Return the result of a run after its commands were played, and remove what only that needed."""
        claim, claimed = self._claims.pop(job)
        if report is None or played.is_lost:
            difference = f"its commands could not be played: {played.reason}"
        else:
            difference = first_difference(claimed, report)
        if difference:
            figures = {"points": 0.0, "wall": claim.wall, "simulated": claim.simulated}
            log = (*claim.log, *played.log)
            kind = Lost.NOT_REPRODUCED.value
            return Result.of(job, self._limits, outcome=kind, reason=difference, log=log, **figures)
        _verification_log(self._beside(LOGS, job.log_name)).unlink(missing_ok=True)
        if not self._options.records:
            self._record_of(job).unlink(missing_ok=True)
        return replace(claim, success=played.success, score=played.score, timeline=played.timeline, verified=True)

    def _keep_state(self, worker: WorkerProcess, job: Job) -> None:
        """Write the last state of a run; without one its result counts all the same."""
        try:
            write_state(state_file(self._store.path.parent, job.log_name), job.name, worker.scene, worker.frame)
        except OSError as error:
            self._options.on_fault(f"{job.name}: its last state cannot be written: {error.strerror or error}")

    def _show_live(self, worker: WorkerProcess, job: Job) -> None:
        """Write the state of a run in progress, for pages that show this folder."""
        if worker.frame != self._live:
            self._live = worker.frame
            with suppress(OSError):  # a page shows less
                write_state(self._store.path.parent / STATES / LIVE_NAME, job.name, worker.scene, worker.frame)

    def _repeat(self, job: Job, fault: str) -> None:
        """Let a job that the machine has ended run again, next, unless that was its last start."""
        self._starts[job.key] += 1
        if fault.endswith(NO_MEMORY):
            # The same number of runs would want the same memory again.
            self._workers = max(1, self._workers - 1)
        if self._starts[job.key] < self._max_starts:
            self._options.on_fault(f"{job.name}: {fault}; it starts again")
            self._waiting.appendleft(job)
        else:
            self.faults[job] = fault

    def _reported(self, job: Job, report: Report) -> Result:
        """Return the result of a report.

        Raises:
            ResultError: no run has such a result.
        """
        error = report.error.strip()
        last = printable(error.splitlines()[-1], _MAX_REASON) if error else ""
        names = ("outcome", "points", "wall", "simulated", "steps", "success", "state_hash", "score", "timeline")
        content = {name: getattr(report, name) for name in names}
        result = Result.of(job, self._limits, reason=last, **content)
        result.check()
        earned = sum(kit["total"] for order in result.score.get("orders", ()) for kit in order["kits"])
        # The sum and its parts come from one report, which the program may have forged.
        if not job.trial.has_task and abs(earned - result.points) > POINT_TOLERANCE:
            raise ResultError(f"points must be the {earned:g} of its kits (got {result.points:g})")
        if last.startswith(("MemoryError", "numpy._core._exceptions._ArrayMemoryError")):
            return replace(result, outcome=Lost.MEMORY_LIMIT.value, reason=f"{self._memory_words()}: {last}")
        if result.outcome == Outcome.UNTIL.name.lower() and job not in self._claims:  # no other limit ends it so
            reason = f"the competition was not started within {self._limits.start:g} s of simulation time"
            return replace(result, outcome=Lost.START_LIMIT.value, reason=reason)
        if not last and not result.is_done:
            return replace(result, reason=Outcome[result.outcome.upper()].value)
        return result

    def _enforce_limits(self) -> None:
        usages = usage_below([worker.number for worker in self._running])
        now = time.monotonic()
        for worker in list(self._running):
            begun = worker.started + _START_TIMEOUT if worker.begun is None else worker.begun + _END_TIMEOUT
            usage = usages.get(worker.number, Usage())
            if worker.begun is not None and worker.own_time is None:
                worker.own_time = OwnTime(now, usage)
            own = 0.0 if worker.own_time is None or not usages else worker.own_time.take(now, usage)
            if usage.memory > self._limits.memory:
                self._finish(worker, (Lost.MEMORY_LIMIT, self._memory_words()))
            elif worker.log_size() > self._limits.log:
                words = f"wrote more than {self._limits.log / MEBIBYTE:g} MiB to its log"
                self._finish(worker, (Lost.LOG_LIMIT, words))
            elif own > self._limits.wall or now > begun + self._longest:
                worker.write_stacks(usage.members)
                self._finish(worker, (Lost.WALL_LIMIT, f"still running after {self._limits.wall:g} s"))

    @property
    def _longest(self) -> float:
        """Wall time [s] after which a run ends even if the machine has kept it from working."""
        return self._limits.wall * (_MAX_DELAY if MEMORY_IS_LIMITED else 1.0)

    def _memory_words(self) -> str:
        return f"needed more than {self._limits.memory / MEBIBYTE:g} MiB of memory"


def _verification_log(log: Path) -> Path:
    """Return the log of the process that plays the commands of a run, by the run's own."""
    return log.with_suffix(".verification")
