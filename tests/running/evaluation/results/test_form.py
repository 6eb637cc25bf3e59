"""Tests of the forms of JSON values: the first misfit is named by its place."""

from typing import Any

import pytest

from cellwright.running.evaluation.results.form import Each, Maybe, find_misfit

FORM: dict[str, Any] = {"name": str, "sizes": [float], "by": Each(int), "end": Maybe(float)}
FIT: dict[str, Any] = {"name": "a", "sizes": [1, 2.5], "by": {"x": 1}, "end": None, "more": ...}


@pytest.mark.parametrize(
    ("changes", "misfit"),
    [
        ({}, ""),
        ({"end": {}}, ""),
        ({"end": "x"}, "end must be a finite number"),
        ({"sizes": [1.0, float("inf")]}, "sizes[1] must be a finite number"),
        ({"sizes": {}}, "sizes must be a list"),
        ({"by": {"x": True}}, "by.x must be a whole number"),
        ({"name": 1, "by": 2}, "name must be a string"),
    ],
)
def test_first_misfit_is_named(changes: dict[str, Any], misfit: str) -> None:
    assert find_misfit(FIT | changes, FORM) == misfit


def test_missing_entry_is_named_with_what_is_around_it() -> None:
    assert find_misfit({"a": {}}, {"a": {"b": str}}) == "a.b is missing"
