"""Execution of many jobs on a Ray cluster: a Ray task for each, with its result on disk here as it comes.

What a node does to a run is no result of it. Ray repeats the run, up to `STARTS` starts.
"""

import math
import os
import re
import signal
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import IO, Any

from cellwright._package import FOLDER
from cellwright.clients.policies.spec import PolicySpec, is_policy
from cellwright.running.evaluation.execution.runner import STARTS, Runner, RunnerOptions
from cellwright.running.evaluation.plan.job import EvaluatedTrial, Job, agent_digest, key_facts
from cellwright.running.evaluation.results.folder import LOGS
from cellwright.running.evaluation.results.result import Result, ResultError
from cellwright.running.evaluation.results.results_file import ResultsFile
from cellwright.running.evaluation.results.seal import KEY_VARIABLE
from cellwright.util.errors import UsageError
from cellwright.util.process import ChildProcess, json_lines, own_program

_CONNECT_TIMEOUT = 60.0  # [s] until the cluster has accepted the copy of the current folder
_PERIOD = 0.2  # [s] between two looks at `stop`
_IDLE_TIMEOUT = 30.0  # [s] without an answer, after which the user may want to know
_END_TIMEOUT = 20.0  # [s] that the driver may take to leave the cluster
_QUEUE = 2  # runs for each CPU of the cluster, so that none waits for this machine
_CHECK = "check"  # key of the order that checks the agent
_MAX_BEGINNINGS = 64  # workers of Ray that start at once


class RayRunner(Runner):
    """Runs jobs on a Ray cluster, whose nodes get a copy of the current folder.

    Args:
        address: of the cluster, as for `ray.init`.
        jobs: all that may be run, of one agent.
        most: runs at a time; None for as many as the cluster has CPUs, whose number may change.

    Raises:
        UsageError: Ray is not installed, or a file does not get to the nodes.
        OSError: a file of a trial cannot be read.
    """

    def __init__(
        self,
        store: ResultsFile,
        address: str,
        jobs: Sequence[Job],
        options: RunnerOptions | None = None,
        *,
        most: int | None = None,
    ) -> None:
        super().__init__(store, options or RunnerOptions())
        if find_spec("ray") is None:
            raise UsageError("--ray: needs the package ray; pip install 'cellwright[ray]'")
        agent = jobs[0].agent
        for program in {job.latency: job.program for job in jobs}.values():
            for name in _files_of(program):
                _refuse_elsewhere(name)
        self._address, self._agent = address, agent
        self._most = most
        program = agent_digest(agent)
        self._trials = {trial: _described(trial, program) for trial in {job.trial: None for job in jobs}}
        self._driver: _Driver | None = None
        self._cpus = 1

    def check_agent(self, agent: str) -> str:
        """Return why the agent or a trial cannot be used on the cluster; empty if they can. A node makes the agent.

        If the machines prevent that, `failure` says how.
        """
        problem = ""
        try:
            problem = self._connect()
            if not problem:
                trials = list(self._trials.values())
                given = {"agent": self._agent, "program": agent, "trials": trials, "limits": asdict(self._limits)}
                self._order({"key": _CHECK, "check": given})
                self._start_workers()
                ended = self._wait_for_check(_IDLE_TIMEOUT)
                problem = ended.get("checked", "")
                self.failure = self.failure or ended.get("failure", "") or ended.get("fault", "")
        except OSError as error:
            self.failure = self._words_of(error)
        except BaseException:
            self._leave()
            raise
        if problem or self.failure:
            self._leave()
        return f"--ray {self._address}: {problem}" if problem else ""

    def run(self, jobs: Iterable[Job]) -> bool:
        """Run all jobs that are not settled; the cluster has no task of them left after this call.

        Call `check_agent` first.

        Returns:
            False if it was stopped or failed before all jobs had a result.
        """
        waiting = self.unsettled(jobs)
        running: dict[str, Job] = {}
        try:
            while not self._stopped and not self.failure:
                while len(running) < self._most_orders():
                    waiting = waiting or self.unsettled(self._options.more())
                    if not waiting:
                        break
                    job = waiting.popleft()
                    running[job.key] = job
                    self._order(self._order_of(job))
                if not running:
                    break
                ended = self._receive(_PERIOD).get("ended", {})
                if (key := ended.get("key")) in running:
                    self._finish(running.pop(key), ended)
                self._options.on_progress(())
        except OSError as error:
            self.failure = self._words_of(error)
        finally:
            self._leave()
        return not (waiting or running or self.faults)

    def _most_orders(self) -> int:
        """Return how many runs Ray may have: it does one for each CPU, and has the next ones at hand."""
        cpus = max(1, self._cpus)
        return _QUEUE * cpus if self._most is None or self._most >= cpus else self._most

    def _start_workers(self) -> None:
        """Let Ray start its workers while one of them checks the agent: the first run of each would wait for it."""
        for number in range(1, min(self._most or self._cpus, self._cpus, _MAX_BEGINNINGS)):
            self._order({"key": f"worker {number}", "begins": True})

    def _connect(self) -> str:
        """Start the driver, and return why it cannot use the cluster."""
        folder = self._store.path.parent
        self._driver = _Driver(folder)
        self._order({"address": self._address, "folder": str(folder), "excluded": _excluded(folder), "starts": STARTS})
        end = time.monotonic() + _CONNECT_TIMEOUT
        while not (answer := self._receive(_PERIOD)) and not self.failure:
            if time.monotonic() > end:
                # it does not read its stdin yet
                self._driver.end(0.0)
                return f"no answer within {_CONNECT_TIMEOUT:g} s; see {self._driver.log}, and start Ray there"
        return str(answer.get("refused", ""))

    def _wait_for_check(self, patience: float) -> Mapping[str, Any]:
        """Return what has come of the check; tell the user once if that takes longer than `patience` [s]."""
        late = time.monotonic() + patience
        ended: Mapping[str, Any] = {}
        while ended.get("key") != _CHECK and not self.failure:
            ended = self._receive(_PERIOD).get("ended", {})
            if time.monotonic() > late:
                late = math.inf
                self._options.on_fault(f"the cluster has started nothing for {patience:g} s; it may have no free CPU")
        return ended

    def _finish(self, job: Job, ended: Mapping[str, Any]) -> None:
        if failure := ended.get("failure"):
            self.failure = f"{job.name}: {failure}"
        elif fault := ended.get("fault"):
            self.faults[job] = fault
        else:
            try:
                result = Result.from_json(ended["result"])
            except ResultError as error:
                self.faults[job] = f"its result is invalid: {error}"
            else:
                if result.key == job.key:
                    self._add(result)
                else:
                    self.faults[job] = f"its result is that of another run, {result.name}"

    def _order_of(self, job: Job) -> dict[str, Any]:
        return {
            "key": job.key,
            "agent": job.agent,
            "trial": self._trials[job.trial],
            "seed": job.seed,
            "vary": job.vary,
            "limits": asdict(self._limits),
            "records": self._options.records,
            "over": job.over,
            "verify": job.verify,
            "latency": job.latency,
        }

    def _order(self, content: Mapping[str, Any]) -> None:
        assert self._driver is not None
        self._driver.send(content)

    def _receive(self, timeout: float) -> Mapping[str, Any]:
        """Return the next message of the driver; empty if there is none within `timeout` [s], or if it has ended."""
        assert self._driver is not None
        try:
            message: Mapping[str, Any] | None = self._driver.messages.get(timeout=timeout)
        except Empty:
            return {}
        if message is None:
            self.failure = f"the connection to the cluster was lost; see {self._driver.log}"
            return {}
        self._cpus = message.get("cpus", self._cpus)
        return message

    def _leave(self) -> None:
        if self._driver is not None:
            self._driver.end(_END_TIMEOUT)
            self._driver = None


class _Driver(ChildProcess):
    """A process of `cellwright.running.evaluation.execution.on_ray.driver`.

    Args:
        folder: for the files of the runs, and the log of Ray itself.

    Raises:
        OSError: the log cannot be written, or the process cannot be started.
    """

    def __init__(self, folder: Path) -> None:
        (folder / LOGS).mkdir(exist_ok=True)
        self.log = folder / LOGS / "ray.log"
        self.messages: SimpleQueue[Any] = SimpleQueue()
        """Its messages; None when it has ended."""
        with self.log.open("wb") as stderr:
            command = own_program("cellwright.running.evaluation.execution.on_ray.driver")
            environment = {"RAY_USAGE_STATS_ENABLED": "0", **os.environ}
            environment.pop(KEY_VARIABLE, None)
            super().__init__(command, environment=environment, stderr=stderr, read=self._listen)

    def end(self, timeout: float) -> None:
        """End it, and with it the Ray that it has started, if it was `local`."""
        super().end(timeout)
        if os.name == "posix":
            # nothing is left; macOS raises the second
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, signal.SIGKILL)

    def _listen(self, output: IO[bytes]) -> None:
        for message in json_lines(output):
            self.messages.put(message)
        self.messages.put(None)


def _described(trial: EvaluatedTrial, program: str) -> dict[str, Any]:
    """Return a trial as JSON values for a node, which has its own files.

    Raises:
        UsageError: a file does not get to the nodes.
        OSError: a file cannot be read.
    """
    names = trial.given or tuple(map(str, trial.files))
    for name in names:
        if Path(name).is_file():  # others are bundled, or a plugin's
            _refuse_elsewhere(name)
    return {
        "name": trial.name,
        "given": names,
        "reachable": trial.reachable,
        "has_task": trial.has_task,
        "best": trial.best,
        "time_limit": trial.time_limit,
        "overrides": list(map(str, trial.overrides)),
        "facts": key_facts(trial, program),
    }


def _files_of(agent: str) -> list[str]:
    """Return the files that an agent names: its own, or those of a policy and its rules."""
    spec = PolicySpec.read(agent) if is_policy(agent) else None
    place = (agent if spec is None else spec.policy).rpartition(":")[0]
    more = () if spec is None else spec.files
    return [*([place] if place.endswith(".py") else []), *(str(file) for file in more if not _is_bundled(file))]


def _is_bundled(file: Path) -> bool:
    return file.resolve().is_relative_to(FOLDER)


def _refuse_elsewhere(name: str) -> None:
    """Refuse a file that a copy of the current folder does not have under the same name."""
    if Path(name).is_absolute() or not Path(os.path.abspath(name)).is_relative_to(Path.cwd()):
        raise UsageError(
            f"--ray: {name}: nodes get the current folder only; give a file below it, by its relative path"
        )


def _excluded(folder: Path) -> list[str]:
    """Return what the nodes need not get, as patterns of Git: the output folder, and recordings."""
    here = Path.cwd()
    if here == folder.resolve() or not folder.resolve().is_relative_to(here):
        return ["*.mcap"]
    path = folder.resolve().relative_to(here).as_posix()
    return ["*.mcap", "/" + re.sub(r"[\\*?\[\] ]", r"\\\g<0>", path)]
