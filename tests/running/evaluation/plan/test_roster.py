"""Tests of the roster of a class: which programs patterns select, and their names."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.running.evaluation.plan.roster import Student, find_students
from cellwright.util.errors import UsageError

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
