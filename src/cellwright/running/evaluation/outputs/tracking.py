"""Log of an evaluation in trackers: its parameters, its progress, its figures and its files, as one run in each.

A tracker has a process of its own (`trackers`). One that fails, waits or prints does not touch the evaluation.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from queue import Empty, SimpleQueue
from statistics import fmean
from typing import IO, Any, Self

from cellwright.running.evaluation.outputs.trackers import NAMES, RunOrder, Status
from cellwright.running.evaluation.plan.shard import Shard
from cellwright.running.evaluation.results import summary
from cellwright.running.evaluation.results.folder import LOGS
from cellwright.running.evaluation.results.form import Each, find_misfit
from cellwright.running.evaluation.results.intervals import Interval
from cellwright.running.evaluation.results.result import Result
from cellwright.util.errors import UnknownNameError, UsageError
from cellwright.util.files import open_below, write_atomic
from cellwright.util.plugins import is_installed
from cellwright.util.process import ChildProcess, json_lines, own_program

TRACKING_NAME = "tracking.json"
"""File beside the results with the runs of the trackers, so that the same command continues them."""

_FORM: Mapping[str, Any] = {"parameters": str, "runs": Each(str)}

_DEFAULTS: Mapping[str, Mapping[str, str]] = {
    "mlflow": {
        "MLFLOW_HTTP_REQUEST_MAX_RETRIES": "2",  # MLflow's own seven take minutes
        "MLFLOW_HTTP_REQUEST_BACKOFF_FACTOR": "1",
        "MLFLOW_DISABLE_TELEMETRY": "true",
    },
    "wandb": {"WANDB_ERROR_REPORTING": "false"},
}
"""Variables of each tracker where the environment does not set them: nothing is sent to its makers."""

_REMEDIES = {
    "mlflow": "set MLFLOW_TRACKING_URI to a server that answers",
    "wandb": "check the network and `wandb login`, or set WANDB_MODE=offline",
}
_PERIOD = 1.0  # [s] between two updates
_WARNING_PERIOD = 60.0  # [s] between two warnings
_BEGIN_TIMEOUT = 120.0  # [s]; the trackers' own limits come first
_END_TIMEOUT = 600.0  # [s] to upload the files
_STOP_TIMEOUT = 10.0  # [s] to mark a run as interrupted
_RESERVED = ("overall", "progress")
_MAX_TITLE = 200  # characters of a run's name


def parameters_of(plan: Mapping[str, Any], shard: Shard | None, threshold: summary.Threshold | None) -> dict[str, str]:
    """Return the parameters of an evaluation. As long as they stay the same, it continues the same run."""
    seeds = [run["seed"] for run in plan["runs"]]
    return {
        "agent": plan["agent"],
        "trials": ", ".join(dict.fromkeys(run["trial"] for run in plan["runs"])),
        "seeds": f"{min(seeds)} to {max(seeds)}",
        "vary": str(plan["vary"]),
        **{f"limit_{name}": str(value) for name, value in plan["limits"].items()},
        **{f"version_{name}": value for name, value in plan["versions"].items()},
        "plan": _digest(plan),
        "shard": str(shard or "1/1"),
        "min_score": str(threshold or "none"),
    }


def final_metrics(
    results: Sequence[Result], threshold: summary.Threshold | None, repeats: Sequence[summary.Repeat], status: int
) -> dict[str, float]:
    """Return the figures of all runs, then those of each trial, under names that every tracker accepts.

    Names are `overall/share`, or the name of a trial and a figure, such as `lesson/points`; ends of 95 % intervals have
    `_low` and `_high` behind. Quantities are in points, s, m and rad, rates and shares from 0 to 1.
    """
    metrics: dict[str, float] = {"overall/runs": len(results), "overall/exit_status": status}
    if (share := summary.mean_share(results)) is not None:
        passed, count = summary.passed_count(results, threshold)
        metrics |= _with_ends("overall/share", share, summary.share_interval(results))
        metrics |= _with_ends("overall/passed", passed / count, summary.passed_interval(results, threshold))
    if repeats:
        metrics["overall/repeatable"] = fmean(not repeat.difference for repeat in repeats)
    trials = summary.summarize(results, threshold)
    for prefix, each in zip(_prefixes(each.trial for each in trials), trials, strict=True):
        metrics[f"{prefix}/runs"] = each.runs
        if each.share is None:
            continue
        metrics |= _with_ends(f"{prefix}/points", each.mean, each.mean_interval)
        metrics |= _with_ends(f"{prefix}/share", each.share, each.share_interval)
        metrics |= _with_ends(f"{prefix}/passed", each.passed / each.runs, each.passed_interval)
        for name, found in each.measures.items():
            metrics |= _with_ends(f"{prefix}/{name}", found.mean, found.interval)
    return metrics


def _with_ends(name: str, value: float, interval: Interval | None) -> dict[str, float]:
    ends = {} if interval is None else {f"{name}_low": interval[0], f"{name}_high": interval[1]}
    return {name: value, **ends}


def _prefixes(trials: Iterable[str]) -> list[str]:
    """Return a different prefix for each trial, of letters, digits and underscores."""
    # Both trackers sort metrics into groups by what stands before the slash.
    taken = list(_RESERVED)
    for trial in trials:
        letters = re.sub(r"\W", "_", trial, flags=re.ASCII)
        prefix = first = letters if letters[:1].isalpha() else f"_{letters}"
        number = 2
        while prefix in taken:
            prefix, number = f"{first}_{number}", number + 1
        taken.append(prefix)
    return taken[len(_RESERVED) :]


def _digest(value: object) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()[:16]


class Tracking:
    """The trackers of an evaluation; without names it does nothing.

    Args:
        names: names of trackers, such as `mlflow`.
        folder: folder of the results.
        parameters: parameters of the evaluation, as of `parameters_of`.
        threshold: score below which a run counts as failed.

    Raises:
        OSError: a process cannot be started.
    """

    def __init__(
        self,
        names: Iterable[str],
        folder: Path,
        parameters: Mapping[str, str],
        threshold: summary.Threshold | None = None,
    ) -> None:
        self.runs: dict[str, str] = {}
        """Ids of the runs by tracker."""
        self._folder = folder
        self._parameters = parameters
        self._is_new = False
        self._threshold = threshold
        self._done, self._failed, self._scored, self._shares = 0, 0, 0, 0.0
        self._warned = -_WARNING_PERIOD
        self._trackers: dict[str, TrackerProcess] = {}
        for name in dict.fromkeys(names):  # they load their packages meanwhile
            log = folder / LOGS / f"{name}.log"
            log.parent.mkdir(exist_ok=True)
            self._trackers[name] = TrackerProcess(name, log)

    @staticmethod
    def require(names: Iterable[str]) -> None:
        """Check that trackers of these names are known and installed.

        Raises:
            UnknownNameError: there is no such tracker.
            UsageError: its package is not installed.
        """
        for name in names:
            if name not in NAMES:
                raise UnknownNameError("tracker", name, NAMES)
            if not is_installed(name):
                raise UsageError(f"{name}: needs the package {name}; pip install 'cellwright[{name}]'")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """End the processes; a run that has begun and not ended is marked as interrupted."""
        for tracker in self._trackers.values():
            tracker.end(_STOP_TIMEOUT)

    def forget(self) -> None:
        """Begin new runs, whatever the runs of earlier times."""
        self._is_new = True

    def begin(self, known: Iterable[Result]) -> str:
        """Begin a run in each tracker, or continue the one with the same parameters; return a warning in one line.

        Args:
            known: results of earlier times.

        Raises:
            UsageError: a tracker cannot be reached.
        """
        if not self._trackers:
            return ""
        for result in known:
            self.take(result)
        group = _digest(self._parameters)
        stored = {} if self._is_new else self._stored(group)
        title = f"{self._parameters['agent']}: {self._parameters['trials']}"
        order = RunOrder(title[:_MAX_TITLE], group, self._parameters)
        for name, tracker in self._trackers.items():
            tracker.ask(asdict(replace(order, run=stored.get(name, ""))))
        for name, tracker in self._trackers.items():
            answer = tracker.answer(_BEGIN_TIMEOUT)
            if answer["error"]:
                raise UsageError(f"{name}: no run can be logged: {answer['error']}; {_REMEDIES[name]}")
            self.runs[name] = answer["begun"]
        file = self._folder / TRACKING_NAME
        try:
            write_atomic(file, json.dumps({"parameters": group, "runs": {**stored, **self.runs}}) + "\n")
        except OSError as error:
            return f"warning: {file}: cannot be written: {error.strerror}; the same command would log a new run"
        return ""

    def take(self, result: Result) -> None:
        """Count a new result; the next `update` logs it."""
        self._done += 1
        self._scored += result.is_scored
        self._shares += result.share
        self._failed += not result.is_unjudged and bool(summary.shortcoming(result, self._threshold))

    def update(self) -> str:
        """Log the progress if there is some, at most once a second; return a warning in one line, at most one a minute.

        Call it several times a second; it does not wait.
        """
        for tracker in self._trackers.values():
            tracker.update(self._progress(), self._done)
        failing = [f"{name}: {tracker.error}" for name, tracker in self._trackers.items() if tracker.error]
        now = time.monotonic()
        if not failing or now - self._warned < _WARNING_PERIOD:
            return ""
        self._warned = now
        return f"warning: not logged to {'; '.join(failing)}; the evaluation goes on"

    def finish(self, metrics: Mapping[str, float], step: int, files: Iterable[Path], status: Status) -> list[str]:
        """Log the last figures and the files, and end the runs; return what is missing in a tracker, a line each.

        Args:
            metrics: as of `final_metrics`.
            step: number of runs that are done.
            files: those that exist are logged.
            status: end of the evaluation.
        """
        paths = [str(file.resolve()) for file in files if file.is_file()]
        message = {"metrics": {**metrics, **self._progress()}, "step": step, "files": paths, "status": status}
        end = time.monotonic() + _END_TIMEOUT
        for tracker in self._trackers.values():
            tracker.finish(message, end)
        notes = []
        for name, tracker in self._trackers.items():
            if error := tracker.answer(max(0.0, end - time.monotonic()))["error"]:
                rest = "the last figures, files or status are missing there; the same command logs them"
                notes.append(f"not logged to {name}: {error}; {rest}")
            elif tracker.lost:
                notes.append(f"{tracker.lost} updates of the progress were not logged to {name}: {tracker.last_error}")
        return notes

    def _progress(self) -> dict[str, float]:
        if not self._done:
            return {}
        share = self._shares / max(1, self._scored)
        return {"progress/done": self._done, "progress/share": share, "progress/failed": self._failed}

    def _stored(self, group: str) -> dict[str, str]:
        """Return the runs of earlier times by tracker, if their parameters were the same."""
        try:
            with open_below(self._folder, TRACKING_NAME) as file:
                known = json.loads(file.read())
        except (OSError, ValueError, RecursionError):
            return {}
        is_same = not find_misfit(known, _FORM) and known["parameters"] == group
        return dict(known["runs"]) if is_same else {}


class TrackerProcess(ChildProcess):
    """A process of `trackers`, which gets one message at a time. What it prints goes to `log`."""

    def __init__(self, name: str, log: Path) -> None:
        self.error = ""
        """Error of the last update; empty if it was logged."""
        self.last_error = ""
        self.lost = 0
        """Updates that were not logged."""
        self._log_path = log
        self._ended = {"error": f"its process has ended (see {log})"}
        self._answers: SimpleQueue[dict[str, str]] = SimpleQueue()
        self._is_busy = False
        self._updated = 0.0  # [s]
        self._step = 0
        environment = {**_DEFAULTS[name], **os.environ}
        with log.open("wb") as stderr:
            command = own_program("cellwright.running.evaluation.outputs.trackers", name)
            super().__init__(command, environment=environment, stderr=stderr, read=self._listen)

    def ask(self, message: Mapping[str, Any]) -> None:
        """Send a message."""
        self._is_busy = True
        self.send(message)

    def answer(self, timeout: float) -> dict[str, str]:
        """Wait for the answer to the last message, at most `timeout` [s]."""
        try:
            found = self._answers.get(timeout=timeout)
        except Empty:
            return {"error": f"no answer in time (see {self._log_path})"}
        if found is self._ended:
            self._answers.put(found)  # the answer to all that follows
        self._is_busy = False
        return found

    def update(self, metrics: Mapping[str, float], step: int) -> None:
        """Send an update if its step is new, the last one has its answer, and that was sent a second ago."""
        self._note_answer(0.0)
        now = time.monotonic()
        if step != self._step and not self._is_busy and now - self._updated >= _PERIOD:
            self._updated, self._step = now, step
            self.ask({"metrics": metrics, "step": step})

    def finish(self, message: Mapping[str, Any], end: float) -> None:
        """Send the last message once the last update has its answer; not at all if the time `end` comes first."""
        self._note_answer(max(0.0, end - time.monotonic()))
        if not self._is_busy:
            self.ask(message)

    def _note_answer(self, timeout: float) -> None:
        """Take the answer to the last update, if there is one within `timeout` [s]."""
        if self._is_busy and (timeout > 0.0 or not self._answers.empty()):
            self.error = self.answer(timeout)["error"]
            self.lost += bool(self.error)
            self.last_error = self.error or self.last_error

    def _listen(self, output: IO[bytes]) -> None:
        for answer in json_lines(output):
            self._answers.put(answer)
        self._answers.put(self._ended)
