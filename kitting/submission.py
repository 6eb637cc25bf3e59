"""Submissions: the scores of a program, with all that is needed to make them again, and the check that does so."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import msgspec

from cellwright.running.run import versions
from cellwright.util.errors import UsageError
from kitting.benchmark import NAME, VERSION, Split, digests, find_tasks, seeds
from kitting.evaluate import RunRecord, Runs, evaluate
from kitting.scores import outcomes_text, read_outcomes, scores_of

OUTCOMES = "outcomes.csv"
"""File beside a submission with all its runs."""
PROGRAM_OPTIONS = ("--agent", "--policy", "--policy-map", "--latency")
"""Options that name a program; a submission has no others, such as a folder to write to."""
SCHEMA_TITLE = "Submission to the kitting benchmark of Cellwright"

_Text = Annotated[str, msgspec.Meta(min_length=1, max_length=2000)]
_Sha256 = Annotated[str, msgspec.Meta(pattern="^[0-9a-f]{64}$")]
_Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
_Count = Annotated[int, msgspec.Meta(ge=0)]


class Claim(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Score of a task: its successes, all runs, and the ends of the 95 % interval of the rate."""

    successes: _Count
    runs: Annotated[int, msgspec.Meta(ge=1)]
    low: _Share
    high: _Share


class Submission(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A submission.

    Attributes:
        benchmark: name of the benchmark.
        version: its version; scores are compared within one major version.
        name: name of the program.
        authors: its authors.
        contact: address for questions.
        licence: licence of the program, as SPDX says it.
        program: options of `cellwright eval` that name it.
        files: SHA-256 of its files, by their paths from the folder that commands run in.
        sees: its observations; privileged state is named here.
        learned_from: its training data, with the number of demonstrations; "nothing" for a scripted program.
        seeds: number of seeds of each task, the first of the test split.
        digests: SHA-256 of the files of the benchmark.
        versions: versions of Cellwright and of what it computes with, and the platform.
        outcomes: SHA-256 of the file with all runs.
        scores: score of each task.
    """

    benchmark: _Text
    version: _Text
    name: _Text
    authors: Annotated[list[_Text], msgspec.Meta(min_length=1)]
    contact: _Text
    licence: _Text
    program: Annotated[list[_Text], msgspec.Meta(min_length=2)]
    files: dict[str, _Sha256]
    sees: _Text
    learned_from: _Text
    seeds: Annotated[int, msgspec.Meta(ge=1)]
    digests: dict[str, _Sha256]
    versions: dict[str, str]
    outcomes: _Sha256
    scores: Annotated[dict[str, Claim], msgspec.Meta(min_length=1)]


class Entrant(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Part of a submission that only its authors know; attributes as in `Submission`."""

    name: _Text
    authors: Annotated[list[_Text], msgspec.Meta(min_length=1)]
    contact: _Text
    licence: _Text
    files: list[_Text] = []
    sees: _Text
    learned_from: _Text


def schema() -> dict[str, Any]:
    """Return the JSON Schema of submissions."""
    return {**msgspec.json.schema(Submission), "title": SCHEMA_TITLE}


def make_submission(entrant: Entrant, words: Sequence[str], records: Sequence[RunRecord]) -> tuple[Submission, str]:
    """Return the submission of runs, and the text of its file of outcomes.

    Raises:
        UsageError: there are no runs, or not the first seeds of the test split in each task, or a file is missing.
    """
    count = _count_of(records)
    text = outcomes_text({entrant.name: records})
    found = Submission(
        benchmark=NAME,
        version=VERSION,
        name=entrant.name,
        authors=entrant.authors,
        contact=entrant.contact,
        licence=entrant.licence,
        program=list(words),
        files={each: _digest_of(Path(each)) for each in entrant.files},
        sees=entrant.sees,
        learned_from=entrant.learned_from,
        seeds=count,
        digests=dict(digests()),
        versions=dict(versions()),
        outcomes=hashlib.sha256(text.encode()).hexdigest(),
        scores=_claims(records),
    )
    return found, text


def read_submission(path: Path) -> Submission:
    """Read a submission, and check all that can be checked without a run.

    Raises:
        UsageError: it cannot be read, does not fit the schema, is of another version, or contradicts its outcomes.
    """
    try:
        found = msgspec.json.decode(path.read_bytes(), type=Submission)
    except OSError as error:
        raise UsageError(f"{path}: cannot be read: {error.strerror or error}") from None
    except msgspec.MsgspecError as error:
        raise UsageError(f"{path}: is no submission: {error}; see kitting/submission.schema.json") from None
    if problem := next(_problems(found, path.parent), ""):
        raise UsageError(f"{path}: {problem}")
    return found


def verify(path: Path, folder: Path, jobs: int | None = None) -> list[str]:
    """Run everything of a submission again; return a line for each difference, none if every number came again.

    Args:
        path: the submission.
        folder: folder for the new runs.
        jobs: runs at a time; None for the number of processors.

    Raises:
        UsageError: the submission is none, see `read_submission`, or the evaluation did not end.
    """
    claimed = read_submission(path)
    runs = Runs(find_tasks(list(claimed.scores)), count=claimed.seeds, jobs=jobs, fresh=True)
    again = evaluate(runs, claimed.program, folder)
    before = read_outcomes(path.parent / OUTCOMES)[claimed.name]
    return list(differences(before, again))


def differences(before: Sequence[RunRecord], again: Sequence[RunRecord]) -> Iterator[str]:
    """Yield a line for each run whose record differs in more than its wall time."""
    known = {(each.task, each.seed): each for each in again}
    for each in before:
        other = known.pop((each.task, each.seed), None)
        name = f"{each.task} seed {each.seed}"
        if other is None:
            yield f"{name}: was not run again"
        elif replace(other, wall=each.wall) != each:
            yield f"{name}: {_state_of(each)}, and now {_state_of(other)}"
    yield from (f"{task} seed {seed}: is not in the outcomes" for task, seed in known)


def _state_of(record: RunRecord) -> str:
    verdict = "success" if record.success else "no success"
    return f"{verdict} at {record.time:g} s ({record.outcome}, state {record.state_hash[:12]})"


def _problems(found: Submission, folder: Path) -> Iterator[str]:
    """Yield what is wrong with a submission, the first first."""
    if (found.benchmark, found.version) != (NAME, VERSION):
        yield f"is of {found.benchmark} {found.version} (this is {NAME} {VERSION}); check out that version"
        return
    ours = digests()
    if changed := sorted(name for name in {*ours, *found.digests} if ours.get(name) != found.digests.get(name)):
        yield f"was made with another {changed[0]}; check out the version of the benchmark that it names"
        return
    names = found.program[::2]
    if len(names) != len({*names}) or len(found.program) % 2 or not {*names} <= {*PROGRAM_OPTIONS}:
        known, got = ", ".join(PROGRAM_OPTIONS), " ".join(found.program)
        yield f"its program must have a value for some of {known} (got {got:.80})"
        return
    outcomes = folder / OUTCOMES
    if not outcomes.is_file() or _digest_of(outcomes) != found.outcomes:
        yield f"its {OUTCOMES} is missing or was changed; put the one of the submission beside it"
        return
    records = read_outcomes(outcomes).get(found.name, [])
    if _count_of(records) != found.seeds or _claims(records) != found.scores:
        yield f"its scores are not those of its {OUTCOMES}; write both with python -m kitting submit"
    for name, digest in found.files.items():
        if not Path(name).is_file() or _digest_of(Path(name)) != digest:
            yield f"its file {name} is missing or was changed; take the one of the submission"


def _count_of(records: Sequence[RunRecord]) -> int:
    """Return the number of seeds of runs; a UsageError if those of a task are not the first of the test split."""
    by_task: dict[str, list[int]] = {}
    for each in records:
        by_task.setdefault(each.task, []).append(each.seed)
    counts = {len(numbers) for numbers in by_task.values()}
    first = list(seeds(Split.TEST)[: max(counts, default=0)])
    if len(counts) != 1 or any(sorted(numbers) != sorted(first) for numbers in by_task.values()):
        raise UsageError(
            "outcomes: must have the first seeds of the test split in each task; run python -m kitting score"
        )
    return counts.pop()


def _claims(records: Sequence[RunRecord]) -> dict[str, Claim]:
    return {
        name: Claim(score.successes, score.runs, round(score.interval[0], 6), round(score.interval[1], 6))
        for name, score in scores_of(records).items()
    }


def _digest_of(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise UsageError(f"{path}: cannot be read: {error.strerror or error}") from None


def as_text(submission: Submission | Mapping[str, Any]) -> str:
    """Return a submission, or its schema, as the text of a file."""
    return msgspec.json.format(msgspec.json.encode(submission), indent=2).decode() + "\n"
