"""Merge of the results that several machines have for one plan."""

import errno
import os
import shutil
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cellwright.running.evaluation.results.folder import (
    LOGS,
    PLAN_FORM,
    PLAN_NAME,
    RECORDINGS,
    RESULTS_NAME,
    plan_text,
    read_plan,
)
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.results_file import ResultsFile, read_results
from cellwright.running.evaluation.results.state import scene_file_of, state_file
from cellwright.running.run import versions
from cellwright.util.errors import UsageError
from cellwright.util.files import atomic_file, open_below, write_atomic

_SUFFIXES = ((LOGS, ".log"), (LOGS, ".jsonl"), (RECORDINGS, ".mcap"))


@dataclass(frozen=True, slots=True)
class Merged:
    """Results of several folders.

    Attributes:
        results: those that are there, in the order of the plan.
        missing: names of the runs without a result.
        differing: names of the runs that have results with different contents, besides wall times.
        notices: faults of the files of results, a line each.
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
        for name in PLAN_FORM:
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
        # In the order of the plan, so that merged results do not depend on which shard was first.
        first = {run["key"]: found[run["key"]][0] for run in plan["runs"] if run["key"] in found}
        for folder, result in first.values():
            _copy_files(folder, out, result.log_name)
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
        # the run counts without its last state
        with suppress(OSError, ValueError, UsageError):
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
