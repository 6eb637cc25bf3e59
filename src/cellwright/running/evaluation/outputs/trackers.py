"""Program that logs an evaluation to a tracker: MLflow or Weights & Biases, each in a process of its own.

It reads messages as JSON lines from stdin and answers each with one on stdout. The package of the tracker may print,
wait or hang here without harm to the evaluation. If stdin ends before the last message, the run is marked as
interrupted.
"""

from __future__ import annotations

import io
import os
import re
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, Literal, Protocol, TypeAlias

from cellwright.util.errors import printable
from cellwright.util.process import json_lines, send_json, take_over_standard_streams

Status: TypeAlias = Literal["finished", "failed", "interrupted"]
"""Status of an evaluation: all runs have a result, the machine failed, or a signal ended it."""

NAMES = (MLFLOW, WANDB) = ("mlflow", "wandb")
"""Values of `--log`: MLflow is for those with a server, W&B for those who train policies."""

_MAX_ERROR = 400  # characters


@dataclass(frozen=True, slots=True)
class RunOrder:
    """Order for a run of a tracker.

    Attributes:
        name: name for people.
        group: digest of the parameters, which runs of one evaluation share.
        parameters: parameters of the evaluation.
        run: id of the run to continue; empty for a new one.
    """

    name: str
    group: str
    parameters: Mapping[str, str]
    run: str = ""


class Tracker(Protocol):
    """One run of a tracker. Each method may raise any error of the tracker's package."""

    def begin(self, order: RunOrder) -> str:
        """Begin a run, or continue it if the tracker can; return its id."""

    def log(self, metrics: Mapping[str, float], step: int) -> None:
        """Log metrics; `step` is the number of runs that are done."""

    def end(self, metrics: Mapping[str, float], step: int, files: Sequence[Path], status: Status) -> None:
        """Log the last metrics and the files, and end the run."""


class MlflowTracker:
    """A run of MLflow, in the store and experiment of its environment variables."""

    _STATUS: Mapping[str, str] = {"finished": "FINISHED", "failed": "FAILED", "interrupted": "KILLED"}
    _MAX_METRICS, _MAX_PARAMETERS = 1000, 100  # of one request
    _BEGIN_TIMEOUT = "10"  # [s] of a request; MLflow's default is 120 s

    def __init__(self) -> None:
        has_timeout = "MLFLOW_HTTP_REQUEST_TIMEOUT" in os.environ
        if not has_timeout:
            os.environ["MLFLOW_HTTP_REQUEST_TIMEOUT"] = self._BEGIN_TIMEOUT
        from mlflow import MlflowClient

        self._has_timeout = has_timeout
        self._client = MlflowClient()
        self._run = ""

    def begin(self, order: RunOrder) -> str:
        """Begin or continue a run."""
        self._run = self._known(order.run) or self._new(order)
        # a file takes longer than a question
        if not self._has_timeout:
            del os.environ["MLFLOW_HTTP_REQUEST_TIMEOUT"]
        return self._run

    def log(self, metrics: Mapping[str, float], step: int) -> None:
        """Log metrics."""
        from mlflow.entities import Metric

        now = int(time.time() * 1000)
        entries = iter([Metric(name, value, now, step) for name, value in metrics.items()])
        while batch := list(islice(entries, self._MAX_METRICS)):
            self._client.log_batch(self._run, metrics=batch)

    def end(self, metrics: Mapping[str, float], step: int, files: Sequence[Path], status: Status) -> None:
        """Log the last metrics and the files, and end the run; that is tried even if the rest fails."""
        try:
            self.log(metrics, step)
            for file in files:
                self._client.log_artifact(self._run, str(file))
        finally:
            self._client.set_terminated(self._run, self._STATUS[status])

    def _known(self, run: str) -> str:
        """Continue a run; return an empty id if the store does not have it."""
        from mlflow.exceptions import MlflowException

        if not run:
            return ""
        try:
            if self._client.get_run(run).info.lifecycle_stage == "active":
                self._client.update_run(run, status="RUNNING")
                return run
        except MlflowException as error:
            if error.error_code != "RESOURCE_DOES_NOT_EXIST":
                raise
        return ""

    def _new(self, order: RunOrder) -> str:
        from mlflow.entities import Param

        run: str = self._client.create_run(self._experiment(), run_name=order.name).info.run_id
        entries = iter([Param(name, value) for name, value in order.parameters.items()])
        while batch := list(islice(entries, self._MAX_PARAMETERS)):
            self._client.log_batch(run, params=batch)
        return run

    def _experiment(self) -> str:
        if number := os.environ.get("MLFLOW_EXPERIMENT_ID"):
            return number
        name = os.environ.get("MLFLOW_EXPERIMENT_NAME", "Default")
        found = self._client.get_experiment_by_name(name)
        known: str = self._client.create_experiment(name) if found is None else found.experiment_id
        return known


class WandbTracker:
    """A run of Weights & Biases, in the project and mode of its environment variables.

    A run online is continued. A run offline cannot be: a new one in the same group takes its place.
    """

    _EXIT_CODE: Mapping[str, int] = {"finished": 0, "failed": 1, "interrupted": 255}
    _STEP = "progress/done"

    def __init__(self) -> None:
        import wandb

        self._wandb: Any = wandb
        self._run: Any = None
        self._group = ""

    def begin(self, order: RunOrder) -> str:
        """Begin or continue a run."""
        is_continued = order.run and self._wandb.setup().settings.mode == "online"
        quiet = {"silent": True, "console": "off"}
        # an evaluation logs its own figures, not the machine, its packages and its repository
        private = {"disable_git": True, "save_code": False, "host": ""}
        private |= {f"x_disable_{each}": True for each in ("meta", "stats", "machine_info")}
        settings = self._wandb.Settings(**quiet, **private, x_save_requirements=False, **self._timeouts())
        self._run = self._wandb.init(
            id=order.run if is_continued else None,
            resume="allow" if is_continued else None,
            name=order.name,
            group=order.group,
            job_type="evaluation",
            config=dict(order.parameters),
            settings=settings,
        )
        self._run.define_metric("*", step_metric=self._STEP)
        self._group = order.group
        known: str = self._run.id
        return known

    def log(self, metrics: Mapping[str, float], step: int) -> None:
        """Log metrics."""
        self._run.log({**metrics, self._STEP: step})

    def end(self, metrics: Mapping[str, float], step: int, files: Sequence[Path], status: Status) -> None:
        """Log the last metrics and the files, and end the run."""
        if metrics:
            self.log(metrics, step)
        if files:
            artifact = self._wandb.Artifact(f"evaluation-{self._group}", "evaluation")
            for file in files:
                artifact.add_file(str(file))
            self._run.log_artifact(artifact)
        self._run.finish(exit_code=self._EXIT_CODE[status])

    @staticmethod
    def _timeouts() -> dict[str, Any]:
        """Return limits of waiting [s] where the environment sets none; W&B itself waits for the end without one."""
        own = {"init_timeout": 20.0, "finish_timeout": 120.0}
        return {name: value for name, value in own.items() if f"WANDB_{name.upper()}" not in os.environ} | {
            "finish_timeout_raises": True
        }


def serve(tracker_class: type[Tracker], messages: Any, answer: Any) -> None:
    """Pass messages on to a new tracker until the last one, and answer each with an error, empty for none.

    Args:
        tracker_class: makes the tracker.
        messages: iterates over the messages: first a `RunOrder` as JSON values, then `metrics`, `step` and, in the last
            one, `files` and `status`.
        answer: takes an answer: `begun` with the id of the run, then `done` with the error.
    """
    order = RunOrder(**next(messages))
    try:
        tracker = tracker_class()
        answer({"begun": tracker.begin(order), "error": ""})
    except Exception as error:
        answer({"begun": "", "error": _words(error)})
        return
    step = 0
    for message in messages:
        step = message["step"]
        try:
            if "status" not in message:
                tracker.log(message["metrics"], step)
                answer({"error": ""})
                continue
            tracker.end(message["metrics"], step, list(map(Path, message["files"])), message["status"])
            answer({"error": ""})
        except Exception as error:
            answer({"error": _words(error)})
        if "status" in message:
            return
    # the evaluation is gone, and has written no files
    tracker.end({}, step, (), "interrupted")


def _words(error: Exception) -> str:
    """Return an error in one line, without the password of an address such as `http://me:secret@host`."""
    text = " ".join(str(error).split()) or type(error).__name__
    return printable(re.sub(r"(?<=://)[^/@\s]+@", "", text), _MAX_ERROR)


def _class_of(name: str) -> type[Tracker]:
    return MlflowTracker if name == MLFLOW else WandbTracker


def main() -> None:
    """Serve the tracker that is named last on the command line. All that its package prints goes to stderr."""
    raw, channel = take_over_standard_streams()

    def answer(content: Mapping[str, str]) -> None:
        with suppress(OSError):  # the evaluation is gone
            send_json(channel, content)

    serve(_class_of(sys.argv[-1]), json_lines(io.BufferedReader(raw)), answer)  # type: ignore[type-var]  # a FileIO


if __name__ == "__main__":
    main()
