"""Folder of an evaluation: the names in it, its plan, and files that are read only if they are regular ones."""

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

from cellwright.running.evaluation.plan.job import Job, RunLimits
from cellwright.running.evaluation.results.form import Each, find_misfit
from cellwright.running.evaluation.results.result import Result
from cellwright.running.run import versions
from cellwright.util.errors import UsageError
from cellwright.util.files import open_below

RESULTS_NAME = "results.jsonl"
PLAN_NAME = "plan.json"
LOGS, RECORDINGS = "logs", "recordings"
"""Folders beside the results."""
PLAN_FORM: Mapping[str, Any] = {
    "agent": str,
    "vary": bool,
    "limits": Each(float),
    "versions": Each(str),
    "runs": [{"key": str, "trial": str, "seed": int}],
}
"""Form of a plan."""


def plan_of(jobs: Sequence[Job], limits: RunLimits) -> dict[str, Any]:
    """Return the plan of an evaluation as JSON values: all its runs, in order. Each shard has the whole plan."""
    return {
        "agent": jobs[0].agent,
        "vary": jobs[0].vary,
        "limits": asdict(limits),
        "versions": versions(),
        "runs": [{"key": job.key, "trial": job.trial.name, "seed": job.seed} for job in jobs],
    }


def plan_text(plan: Mapping[str, Any]) -> str:
    """Return the text of a plan's file."""
    return json.dumps(plan, separators=(",", ":")) + "\n"


def read_plan(folder: Path) -> dict[str, Any]:
    """Read the plan in the folder of the results.

    Raises:
        UsageError: there is none.
        OSError: it cannot be read.
    """
    file = folder / PLAN_NAME
    try:
        plan = json.loads(read_regular(file))
    except FileNotFoundError:
        raise UsageError(f"{folder}: it has no {PLAN_NAME}; give the --out of `cellwright eval`") from None
    except (ValueError, RecursionError) as error:
        raise UsageError(f"{file}: not a plan ({error}); repeat that shard") from error
    if misfit := find_misfit(plan, PLAN_FORM):
        raise UsageError(f"{file}: not a plan ({misfit}); repeat that shard")
    return {name: plan[name] for name in PLAN_FORM}


def other_agents(folder: Path, results: Iterable[Result], agent: str) -> list[str]:
    """Return the programs other than `agent` that the evaluation in a folder is of, sorted.

    It is of the program of the folder's plan, or of all that have results if that one has none: a plan is written
    before its program is checked.
    """
    # A second program in a folder would mix its results with those of the first.
    known = {result.agent for result in results}
    # a class has no plan, and a damaged one is written again
    with suppress(UsageError, OSError):
        planned = str(read_plan(folder)["agent"])
        known = {planned} if planned in known else known
    return sorted(each for each in known if _program_of(each) != _program_of(agent))


def _program_of(agent: str) -> str:
    """Return an agent's name, with one path for a file that may be given by several."""
    file, colon, name = agent.rpartition(":")
    return f"{os.path.abspath(file)}:{name}" if colon and file.endswith(".py") else agent


def read_regular(path: Path) -> bytes:
    """Return the content of a file beside the results.

    Raises:
        UsageError: it is a link, or no regular file.
        OSError: it cannot be read.
    """
    refuse_device(path)
    try:
        with open_below(path.parent, path.name) as file:
            return file.read()
    except ValueError as error:
        raise UsageError(f"{path}: {error}; use another folder") from None


def refuse_device(path: Path) -> None:
    """Refuse a file that is a link or no regular file (`UsageError`); one that does not exist is none of both."""
    # the program of a run may have put it there
    if path.is_symlink():
        raise UsageError(f"{path}: it is a link, not a regular file; use another folder")
    # a device may be read without end
    if path.exists() and not path.is_file():
        raise UsageError(f"{path}: not a regular file; use another folder")
