"""Submissions: made, checked, and made again."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from cellwright.util.errors import UsageError
from kitting import submission
from kitting.benchmark import VERSION
from kitting.evaluate import RunRecord, Runs
from kitting.submission import OUTCOMES, Entrant, as_text, differences, make_submission, read_submission, schema, verify
from tests.kitting.runs import record

RUNS = [record("slow_belt", 100001, success=True), record("slow_belt", 100002), record("fine_place", 100001)]
RUNS += [record("fine_place", 100002, success=True)]
WORDS = ["--agent", "mine.py:Mine"]


@pytest.fixture
def made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A submission in a folder, with a program in the working folder."""
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text("class Mine: ...\n", encoding="utf-8")
    entrant = Entrant(
        name="mine",
        authors=["A. Person"],
        contact="a.person@example.org",
        licence="MIT",
        files=["mine.py"],
        sees="logical cameras",
        learned_from="nothing",
    )
    found, outcomes = make_submission(entrant, WORDS, RUNS)
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / OUTCOMES).write_text(outcomes, encoding="utf-8")
    (folder / "submission.json").write_text(as_text(found), encoding="utf-8")
    return folder / "submission.json"


def changed(path: Path, **values: Any) -> None:
    """Change entries of a submission."""
    path.write_text(json.dumps({**json.loads(path.read_text(encoding="utf-8")), **values}), encoding="utf-8")


def test_submission_fits_its_schema_and_has_its_scores(made: Path) -> None:
    document = json.loads(made.read_text(encoding="utf-8"))
    jsonschema.validate(document, schema())
    assert document["scores"]["slow_belt"] == {"successes": 1, "runs": 2, "low": 0.094531, "high": 0.905469}
    found = read_submission(made)
    assert (found.version, found.seeds, found.program) == (VERSION, 2, WORDS)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"version": "9.0.0"}, r"is of cellwright-kitting 9.0.0 \(this is cellwright-kitting 1"),
        ({"digests": {"train.txt": "0" * 64}}, "was made with another changed_order.yaml; check out the version"),
        ({"program": [*WORDS, "--out", "elsewhere"]}, "its program must have a value for some of --agent, --policy, "),
        (
            {"program": ["--agent", "kitter", "--agent"]},
            "its program must have a value for some of --agent, --policy, ",
        ),
        ({"seeds": 1}, "its scores are not those of its outcomes.csv"),
        ({"name": "yours"}, "must have the first seeds of the test split"),
        ({"surplus": 1}, r"is no submission: .*surplus.*; see kitting/submission.schema.json"),
        ({"authors": []}, r"is no submission: .*authors"),
        ({"files": {"mine.py": "0" * 64}}, "its file mine.py is missing or was changed"),
        ({"outcomes": "0" * 64}, "its outcomes.csv is missing or was changed"),
    ],
)
def test_changed_submission_is_refused(values: dict[str, Any], message: str, made: Path) -> None:
    changed(made, **values)
    with pytest.raises(UsageError, match=message):
        read_submission(made)


def test_better_score_than_the_outcomes_say_is_refused(made: Path) -> None:
    scores = json.loads(made.read_text(encoding="utf-8"))["scores"]
    scores["fine_place"]["successes"] = 2
    changed(made, scores=scores)
    with pytest.raises(UsageError, match=r"its scores are not those of its outcomes.csv"):
        read_submission(made)


@pytest.mark.parametrize("runs", [[], RUNS[:-1], [*RUNS[:3], record("fine_place", 100009)]])
def test_runs_on_other_seeds_than_the_first_are_refused(runs: list[RunRecord], made: Path) -> None:
    entrant = Entrant(name="x", authors=["A"], contact="a", licence="MIT", sees="all", learned_from="nothing")
    with pytest.raises(UsageError, match="must have the first seeds of the test split in each task"):
        make_submission(entrant, WORDS, runs)


def test_differences_name_each_run_but_not_its_wall_time() -> None:
    again = [replace(RUNS[0], wall=9.0), replace(RUNS[1], state_hash="f" * 64), replace(RUNS[2], success=True)]
    found = list(differences(RUNS, [*again, record("slow_belt", 5)]))
    none, other = f"state {'0' * 12}", f"state {'f' * 12}"
    failed = f"no success at 20 s (time_limit, {none})"
    assert found == [
        f"slow_belt seed 100002: {failed}, and now no success at 20 s (time_limit, {other})",
        f"fine_place seed 100001: {failed}, and now success at 20 s (time_limit, {none})",
        "fine_place seed 100002: was not run again",
        "slow_belt seed 5: is not in the outcomes",
    ]


def test_verification_runs_the_program_on_the_same_tasks_and_seeds(
    made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[list[str], int | None, Sequence[str], bool]] = []

    def evaluate(runs: Runs, words: Sequence[str], folder: Path) -> list[RunRecord]:
        asked.append(([task.name for task in runs.tasks], runs.count, words, runs.fresh))
        return [replace(RUNS[0], success=False), *RUNS[1:]]

    monkeypatch.setattr(submission, "evaluate", evaluate)
    assert len(verify(made, tmp_path / "again")) == 1
    assert asked == [(["slow_belt", "fine_place"], 2, WORDS, True)]
