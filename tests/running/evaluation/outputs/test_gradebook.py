"""Tests of the gradebook of a class."""

from __future__ import annotations

import csv
import io

from cellwright.running.evaluation.outputs.gradebook import csv_sheet, equal_runs, page, rows
from cellwright.running.evaluation.plan.roster import Student
from tests.running.evaluation.made_results import result

ANNA, BEN = Student("anna", "s/anna.py:Mine"), Student("ben", "s/ben.py:Mine")


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
