"""Readers of quantities: bounds, expressions, lists."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.parsing.quantities import quantities, quantity, read_quantity
from cellwright.config.parsing.reader import Read, Reader
from cellwright.config.parsing.schema import schema_of
from cellwright.config.parsing.tree import Items, Leaf, Place, Problems, Scalar

PLACE = Place(0, "cell.yaml", 3)


def read(reader: Read, value: Scalar | list[Scalar]) -> tuple[object, list[str]]:
    """Return what a reader returns, and its errors."""
    problems = Problems()
    leaves = [Leaf(each, PLACE, f"a[{n}]") for n, each in enumerate(value)] if isinstance(value, list) else []
    node = Items(tuple(leaves), PLACE, "a") if isinstance(value, list) else Leaf(value, PLACE, "a")
    return reader(Reader(problems), node), [str(problem) for problem in problems.errors]


LENGTH = quantity(0.0, 2.0, "m")


@given(st.floats(-10.0, 10.0))
def test_number_is_read_within_its_bounds_alone(value: float) -> None:
    found, errors = read(LENGTH, value)
    assert (found == value) == (0.0 <= value <= 2.0)
    assert bool(errors) == (found is None)


@given(st.text(max_size=20))
def test_any_text_is_a_number_or_refused_with_its_place(text: str) -> None:
    found, errors = read(LENGTH, text)
    assert isinstance(found, float) or errors[0].startswith("cell.yaml:3: a: ")


def test_expression_is_evaluated() -> None:
    assert read(read_quantity, "pi/2") == (math.pi / 2, [])
    assert read(read_quantity, "1/2") == (0.5, [])
    assert read(read_quantity, 1) == (1.0, [])


@pytest.mark.parametrize(("value", "reason"), [([1.0], "must be [x, y] (got a list of 1)"), (3, "got the number 3")])
def test_list_of_another_length_is_refused(value: Scalar | list[Scalar], reason: str) -> None:
    found, errors = read(quantities((2,), LENGTH, "[x, y]"), value)
    assert found is None
    assert reason in errors[0]


def test_readers_have_schemas() -> None:
    schema = schema_of(quantities((2, 3), LENGTH, "[x, y]"))
    assert schema["items"] == {"type": ["number", "string"], "minimum": 0.0, "maximum": 2.0}
    assert (schema["minItems"], schema["maxItems"]) == (2, 3)
