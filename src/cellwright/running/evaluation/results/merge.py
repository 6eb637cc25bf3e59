"""Plan of an evaluation, and the merge of the results that several machines have for one plan."""

import errno
import json
import os
import shutil
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from cellwright.running.evaluation.plan.job import Job, RunLimits, log_name
from cellwright.running.evaluation.results.result import (
    RESULTS_NAME,
    Each,
    Result,
    ResultsFile,
    find_misfit,
    read_regular,
    read_results,
)
from cellwright.running.evaluation.results.state import scene_file_of, state_file
from cellwright.running.run import versions
from cellwright.util.errors import UsageError
from cellwright.util.files import atomic_file, open_below, write_atomic

PLAN_NAME = "plan.json"
LOGS, RECORDINGS = "logs", "recordings"
"""Folders beside the results."""
_SUFFIXES = ((LOGS, ".log"), (LOGS, ".jsonl"), (RECORDINGS, ".mcap"))

_FORM: Mapping[str, Any] = {
    "agent": str,
    "vary": bool,
    "limits": Each(float),
    "versions": Each(str),
    "runs": [{"key": str, "trial": str, "seed": int}],
}


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
    if misfit := find_misfit(plan, _FORM):
        raise UsageError(f"{file}: not a plan ({misfit}); repeat that shard")
    return {name: plan[name] for name in _FORM}


def other_agents(folder: Path, results: Iterable[Result], agent: str) -> list[str]:
    """Return the programs other than `agent` that the evaluation in a folder is of, sorted.

    It is of the program of the folder's plan, or of all that have results if that one has none: a plan is written
    before its program is checked.
    """
    known = {result.agent for result in results}
    with suppress(UsageError, OSError):  # a class has no plan, and a damaged one is written again
        planned = str(read_plan(folder)["agent"])
        known = {planned} if planned in known else known
    return sorted(each for each in known if _program_of(each) != _program_of(agent))


def _program_of(agent: str) -> str:
    """Return an agent's name, with one path for a file that may be given by several."""
    file, colon, name = agent.rpartition(":")
    return f"{os.path.abspath(file)}:{name}" if colon and file.endswith(".py") else agent


@dataclass(frozen=True, slots=True)
class Merged:
    """Results of several folders.

    Attributes:
        results: those that are there, in the order of the plan.
        missing: names of the runs without a result.
        differing: names of the runs that have results with different contents, besides wall times.
        notices: what is wrong with the files of results, a line each.
    """

    results: Sequence[Result]
    missing: Sequence[str]
    differing: Sequence[str]
    notices: Sequence[str]


def merge(folders: Sequence[Path], out: Path) -> Merged:
    """Add the results of one plan, with logs and recordings, to the folder `out`, which becomes a whole evaluation.

    Of a run with several results the first counts: that in `out`, then in the order of the folders.

    Raises:
        UsageError: a folder has no results or those of another plan, or `out` is in use.
        OSError: a file cannot be read or written.
    """
    plan = read_plan(folders[0])
    _refuse_other(folders[0], plan["versions"], versions(), "this installation")
    for folder in [*folders[1:], *([out] if (out / PLAN_NAME).exists() else [])]:
        other = read_plan(folder)
        for name in _FORM:
            _refuse_other(folder, other[name], plan[name], str(folders[0]), name)
    found: dict[str, list[tuple[Path, Result]]] = {}
    notices: list[str] = []
    with ResultsFile(out) as store:
        notices += store.notices
        if (out / PLAN_NAME).is_symlink():
            raise UsageError(f"{out / PLAN_NAME}: it is a link, not a regular file; use another folder")
        write_atomic(out / PLAN_NAME, plan_text(plan))
        for folder, results in [(out, {**store.results}), *((each, read_results(each, notices)) for each in folders)]:
            refuse_forged(folder, results, plan)
            for key, result in results.items():
                if result.counts_under(plan["limits"]):
                    found.setdefault(key, []).append((folder, result))
        first = {run["key"]: found[run["key"]][0] for run in plan["runs"] if run["key"] in found}
        for folder, result in first.values():
            _copy_files(folder, out, log_name(result.trial, result.seed, result.key))
        store.append(*(result for folder, result in first.values() if store.results.get(result.key) != result))
    return Merged(
        [result for _, result in first.values()],
        [f"{run['trial']} seed {run['seed']}" for run in plan["runs"] if run["key"] not in first],
        [result.name for key, (_, result) in first.items() if _differ(each for _, each in found[key])],
        list(dict.fromkeys(notices)),
    )


def _differ(results: Any) -> bool:
    first, *others = (replace(each, wall=0.0) for each in results)
    return any(each != first for each in others)


def _refuse_other(folder: Path, own: Any, reference: Any, place: str, name: str = "versions") -> None:
    if own == reference:
        return
    if name == "runs":
        words = "other runs: trials, seeds, program or Cellwright's sources differ, or --over or --verify"
    else:
        words = f"{name} {_words(own)}, but {_words(reference)}"
    raise UsageError(f"{folder}: does not belong to {place}: {words}; merge shards of one evaluation")


def _words(value: Any) -> str:
    return ", ".join(f"{name} {each}" for name, each in value.items()) if isinstance(value, Mapping) else str(value)


def refuse_forged(folder: Path, results: Mapping[str, Result], plan: Mapping[str, Any]) -> None:
    """Refuse a result of a folder that is of another run than its key says.

    Raises:
        UsageError: there is one.
    """
    runs = {run["key"]: run for run in plan["runs"]}
    for key, result in results.items():
        run = runs.get(key)
        if run is None:
            continue
        planned = (run["trial"], run["seed"], plan["agent"], plan["vary"])
        if (result.trial, result.seed, result.agent, result.vary) != planned:
            raise UsageError(
                f"{folder / RESULTS_NAME}: {result.name}: the plan's run of this key is {run['trial']} seed "
                f"{run['seed']} of {plan['agent']}; repeat that shard"
            )


def run_files(folder: Path, name: str) -> list[Path]:
    """Return the files of a run in the folder of the results, by the name of its log: those that there are."""
    files = [(folder / kind / name).with_suffix(suffix) for kind, suffix in _SUFFIXES]
    state = state_file(folder, name)
    if state.is_symlink():
        files.append(state)  # readers refuse it
    elif state.is_file():
        with suppress(OSError, ValueError, UsageError):  # the run counts without its last state
            files += [scene_file_of(state), state]
    return [file for file in files if os.path.lexists(file)]


def _copy_files(source: Path, target: Path, name: str) -> None:
    for file in run_files(source, name):
        copy = target / file.parent.name / file.name
        if copy.is_symlink() or copy.parent.is_symlink():
            raise OSError(errno.ELOOP, "it is a link, not a regular file; use another folder", str(copy))
        if not copy.exists():
            copy.parent.mkdir(exist_ok=True)
            with open_below(source, file.relative_to(source)) as content, atomic_file(copy) as written:
                shutil.copyfileobj(content, written)
