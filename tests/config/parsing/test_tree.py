"""Tree of configuration values: problems in order, bounded, each with its place."""

from dataclasses import replace
from datetime import date

import pytest

from cellwright.config.parsing.tree import (
    MAX_PROBLEMS,
    Entry,
    Items,
    Leaf,
    Place,
    Problems,
    Scalar,
    Table,
    children,
    describe,
    shortened,
)


def leaf(line: int, key: str = "a", value: Scalar = 1) -> Leaf:
    return Leaf(value, Place(0, "trial.yaml", line), key)


def test_problems_are_listed_by_line_and_once() -> None:
    problems = Problems()
    for line in (3, 1, 3):
        problems.error(leaf(line), "is wrong")
    problems.warn(leaf(2), "is odd")
    assert list(map(str, problems.errors)) == ["trial.yaml:1: a: is wrong", "trial.yaml:3: a: is wrong"]
    assert list(map(str, problems.warnings)) == ["trial.yaml:2: a: is odd"]
    assert problems.error_count == 3


def test_problems_beyond_the_maximum_are_counted() -> None:
    problems = Problems()
    for line in range(1, MAX_PROBLEMS + 8):
        problems.error(leaf(line), "is wrong")
    assert len(problems.errors) == MAX_PROBLEMS + 1
    assert str(problems.errors[-1]).endswith("7 more errors are not listed")


def test_refused_warning_becomes_an_error() -> None:
    problems = Problems()
    problems.warn(leaf(2), "is odd")
    problems.warn(leaf(4), "is strange")
    problems.refuse(lambda problem: replace(problem, severity="error") if "odd" in problem.message else None)
    assert [each.message for each in problems.warnings] == ["is strange"]


def test_problem_is_one_printable_line() -> None:
    problems = Problems()
    problems.error(leaf(1, "a\nb"), "is \x1b wrong")
    assert str(problems.errors[0]).isprintable()


def test_children_are_items_or_values() -> None:
    place, one, two = Place(0, "", 1), leaf(1), leaf(2)
    table = Table(place, "", {"x": Entry("x", one, place, "x"), 3: Entry(3, two, place, "3")})
    assert children(table) == children(Items((one, two), place, "")) == (one, two)
    assert children(one) == ()
    assert ("x" in table, table.get("x"), table.get("y")) == (True, one, None)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (None, "an empty value"),
        (True, "the boolean true"),
        ("ab", "the text 'ab'"),
        (2.5, "the number 2.5"),
        (date(2017, 5, 1), "the value 2017-05-01"),
    ],
)
def test_values_are_described_for_messages(value: Scalar, words: str) -> None:
    assert describe(leaf(1, value=value)) == words


def test_long_text_is_shortened() -> None:
    assert shortened("x" * 61) == "x" * 59 + "…"
    assert shortened("x" * 60) == "x" * 60
