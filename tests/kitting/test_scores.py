"""Scores, their table and their file."""

from pathlib import Path

import pytest

from cellwright.util.errors import UsageError
from kitting.evaluate import RunRecord
from kitting.scores import Score, outcomes_text, read_outcomes, scores_of, table
from tests.kitting.runs import record

RUNS = {
    "mine": [record("slow_belt", 100001, success=True), record("slow_belt", 100002), record("pick_from_bin", 100001)],
    "other": [record("slow_belt", 100001)],
}


def test_scores_are_in_the_order_of_tasks_with_wilsons_interval() -> None:
    assert scores_of(RUNS["mine"]) == {"pick_from_bin": Score(0, 1), "slow_belt": Score(1, 2)}
    low, high = Score(0, 20).interval
    assert (low, round(high, 3)) == (0.0, 0.161)  # of the textbook's formula


def test_table_has_a_row_for_each_task_that_was_run() -> None:
    assert table(RUNS).splitlines() == [
        "| task | mine | other |",
        "| --- | --- | --- |",
        "| `pick_from_bin` | 0 of 1, 0 to 79 % | not run |",
        "| `slow_belt` | 1 of 2, 9 to 91 % | 0 of 1, 0 to 79 % |",
    ]


def test_outcomes_are_read_as_they_were_written(tmp_path: Path) -> None:
    (tmp_path / "outcomes.csv").write_text(outcomes_text(RUNS), encoding="utf-8")
    assert read_outcomes(tmp_path / "outcomes.csv") == RUNS


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("program,task", "task,program", ":1: must have the columns program, task, seed"),
        ("True", "yes", r":2: is no run: success must be True or False \(got yes\)"),
        ("100002", "many", ":3: is no run: "),
        (",done", "", ":2: is no run: "),
    ],
)
def test_file_with_a_fault_is_refused_with_its_line(before: str, after: str, message: str, tmp_path: Path) -> None:
    text = outcomes_text(RUNS)
    assert before in text
    (tmp_path / "outcomes.csv").write_text(text.replace(before, after, 1), encoding="utf-8")
    with pytest.raises(UsageError, match=message):
        read_outcomes(tmp_path / "outcomes.csv")


def test_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="cannot be read"):
        read_outcomes(tmp_path / "none.csv")


def test_record_of_a_run_says_what_ended_it() -> None:
    found: RunRecord = record("slow_belt", 7)
    assert (found.outcome, found.error_class) == ("time_limit", "policy")
