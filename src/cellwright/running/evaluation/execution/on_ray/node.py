"""The part of an evaluation that runs on a node: one run in a process of its own, from the node's copy of the files."""

from __future__ import annotations

import os
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from cellwright.config.parsing.overrides import Override
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.running.evaluation.execution.local import LocalRunner
from cellwright.running.evaluation.execution.runner import RunnerOptions
from cellwright.running.evaluation.plan.job import (
    EvaluatedTrial,
    RunLimits,
    agent_digest,
    key_facts,
    make_jobs,
    models_digest,
    repeated,
)
from cellwright.running.evaluation.results.merge import run_files
from cellwright.running.evaluation.results.result import Lost
from cellwright.running.evaluation.results.results_file import ResultsFile
from cellwright.util.errors import CellwrightError, one_line
from cellwright.util.files import open_below

_WATCH_PERIOD = 1.0  # [s]


class MachineFaultError(Exception):
    """The machine has ended a run, or has prevented it."""


class OtherNodeError(Exception):
    """A run would not be the same on this node; the text says why."""


def check(agent: str, program: str, trials: Sequence[Mapping[str, Any]], limits: Mapping[str, Any]) -> dict[str, Any]:
    """Return `checked`: why an agent or a trial cannot be used on this node, in words; empty if they can.

    Args:
        agent: the agent of all jobs, whose digest the trials have.
        program: that of one job, as for `find_agent`: a policy's has its latency and seed.
        trials: of `RayRunner`, each with its facts.
        limits: fields of `RunLimits`.

    Raises:
        MachineFaultError: the machine has prevented the check.
    """
    try:
        for described in trials:
            _trial(described, agent)
    except OtherNodeError as error:
        return {"checked": str(error)}
    with _evaluation(limits) as (evaluation, _):
        problem = evaluation.check_agent(program)
        _raise_fault(evaluation)
    return {"checked": problem}


def work(order: Mapping[str, Any]) -> dict[str, Any]:
    """Do one run.

    Args:
        order: of `RayRunner`.

    Returns:
        The `result` as JSON values, and the `files` beside it by their path; or the `failure`: why this node cannot do
        the run.

    Raises:
        MachineFaultError: the machine has ended the run.
    """
    _end_with_node()
    agent = order["agent"]
    try:
        trial = _trial(order["trial"], agent)
    except OtherNodeError as error:
        return {"failure": str(error)}
    more = {"vary": order["vary"], "over": order["over"], "verify": order["verify"], "latencies": [order["latency"]]}
    (job,) = make_jobs([trial], agent, [order["seed"]], **more)
    job = replace(job, trial=trial)  # a compared latency is in its name already
    # An order may be that of a repetition, which differs by its key alone.
    if job.key != order["key"]:
        job = repeated(job)
    if job.key != order["key"]:
        return {"failure": "trial or program have changed since the evaluation began; repeat the command"}
    with _evaluation(order["limits"], records=order["records"]) as (evaluation, store):
        evaluation.run([job])
        _raise_fault(evaluation)
        result, folder = store.results[job.key], store.path.parent
        files = {
            path.relative_to(folder).as_posix(): _content(folder, path) for path in run_files(folder, job.log_name)
        }
        if result.outcome in (Lost.DIED, Lost.REFUSED) and (problem := evaluation.check_agent(job.program)):
            # this node lacks a package that another one has
            return {"failure": problem}
    return {"result": result.as_json(), "files": files}


def _content(folder: Path, path: Path) -> bytes:
    with open_below(folder, path.relative_to(folder)) as file:
        return file.read()


@cache
def _end_with_node() -> None:
    """End this process, and with it the run, when its parent does: without its raylet, Ray would let it work on."""
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_WATCH_PERIOD)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def _evaluation(limits: Mapping[str, Any], *, records: bool = False) -> Iterator[tuple[LocalRunner, ResultsFile]]:
    """Return an evaluation of one start in a temporary folder, and its results."""
    # Ray adds the working folder, in which no file must hide a module that Cellwright needs
    listed = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    os.environ["PYTHONPATH"] = os.pathsep.join(each for each in listed if Path(each).resolve() != Path.cwd().resolve())
    with tempfile.TemporaryDirectory(prefix="cellwright-") as folder, ResultsFile(Path(folder)) as store:
        yield LocalRunner(store, RunnerOptions(RunLimits(**limits), records), starts=1), store


def _raise_fault(evaluation: LocalRunner) -> None:
    if fault := evaluation.failure or next(iter(evaluation.faults.values()), ""):
        raise MachineFaultError(fault)


def _trial(described: Mapping[str, Any], agent: str) -> EvaluatedTrial:
    """Return a trial with this node's files.

    Raises:
        OtherNodeError: a file is missing, or trial, agent or versions differ.
    """
    overrides = tuple(map(Override.read, described["overrides"]))
    content = {**described, "given": tuple(described["given"]), "overrides": overrides}
    wanted = content.pop("facts")
    try:
        files = tuple(find_trial(name).resolve() for name in described["given"])
        loaded = load_trial(list(files), overrides=overrides).trial
        trial = EvaluatedTrial(**content, files=files, models=models_digest(loaded))
        own = key_facts(trial, agent_digest(agent))
    except (CellwrightError, OSError) as error:
        reason = one_line(error)
        raise OtherNodeError(
            f"trial {described['name']}: {reason}; put all of its files below the current folder, and ignore none"
        ) from error
    if reason := _difference(described["name"], agent, own, wanted):
        raise OtherNodeError(reason)
    return trial


def _difference(trial: str, agent: str, own: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    """Return the difference between the facts of this node and those of the evaluation; empty if there is none."""
    for kind, version in wanted["versions"].items():
        if version != own["versions"][kind]:
            return f"{kind} {own['versions'][kind]}, but {version} here; install the same version on all nodes"
    if own["source"] != wanted["source"]:
        return "other sources of Cellwright; install the same Cellwright on all nodes"
    if own["trial"] != wanted["trial"]:
        return f"trial {trial}: other files; install the same plugins on all nodes"
    if own["agent"] != wanted["agent"]:
        return f"agent {agent}: another program; put it below the current folder, or install the same on all nodes"
    return ""
