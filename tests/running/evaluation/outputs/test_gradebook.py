"""Tests of the roster and the gradebook of a class."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import pytest

from cellwright.running.evaluation.outputs.gradebook import csv_sheet, equal_runs, page, rows
from cellwright.running.evaluation.plan.roster import Student, find_students
from cellwright.util.errors import UsageError
from tests.running.evaluation.made_results import result

ANNA, BEN = Student("anna", "s/anna.py:Mine"), Student("ben", "s/ben.py:Mine")


def write(*files: str) -> None:
    for file in files:
        Path(file).parent.mkdir(parents=True, exist_ok=True)
        Path(file).touch()


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_students_are_named_after_their_files() -> None:
    write("s/ben.py", "s/anna.py", "s/notes.txt")
    assert find_students(["s/*:Mine", "s/anna.py:Mine"]) == [ANNA, BEN]


def test_files_of_one_name_are_named_after_their_folders() -> None:
    write("s/anna/robot.py", "s/ben/robot.py", "s/other.py")
    assert [each.name for each in find_students(["s/**/*.py:Mine"])] == ["anna/robot", "ben/robot", "other"]
    assert find_students(["s/anna/robot.py:One", "s/anna/robot.py:Two"])[0].name == "robot:One"


def test_students_that_would_share_a_file_of_feedback_are_refused() -> None:
    write("s/a b.py", "s/a_b.py")
    with pytest.raises(UsageError, match="would share a file of feedback"):
        find_students(["s/*.py:Mine"])


def test_several_equal_end_states_with_points_are_a_hint() -> None:
    def runs(*hashes: str, points: float = 3.0) -> list:  # type: ignore[type-arg]
        return [result(points, seed=seed, state_hash=each) for seed, each in enumerate(hashes, 1)]

    assert equal_runs({"a": runs("1", "2", "3"), "b": runs("1", "2", "4")}) == {"a": {"b": 2}, "b": {"a": 2}}
    assert equal_runs({"a": runs("1", "2"), "b": runs("1", "3")}) == {}
    assert equal_runs({"a": runs("1", "1"), "b": runs("1", "1")}) == {}
    assert equal_runs({"a": runs("1", "2", points=0.0), "b": runs("1", "2", points=0.0)}) == {}


def test_sheet_has_a_row_for_each_program_and_no_formula() -> None:
    lost = result(0.0, outcome="refused", reason='=HYPERLINK("http://x")', state_hash="")
    found = rows([ANNA, BEN], {ANNA.agent: [result(6.0), result(3.0, seed=2)], BEN.agent: [lost]}, None)
    first, second = csv.DictReader(io.StringIO(csv_sheet(found)))
    assert (first["name"], first["share, %"], first["passed"], first["points: tiny"]) == ("anna", "37.5", "2", "4.5")
    assert (second["name"], second["share, %"], second["endings"]) == ("ben", "0.0", "1 refused")
    assert second["reason"] == '\'=HYPERLINK("http://x")'
    assert found[1].is_refused


def test_page_escapes_what_programs_say() -> None:
    lost = result(0.0, outcome="crashed", reason="<script>alert(1)</script>")
    text = page(rows([ANNA], {ANNA.agent: [lost]}, None), None)
    assert "<script>" not in text
    assert "&lt;script&gt;" in text
