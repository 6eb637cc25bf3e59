"""Figures as text."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks import report
from benchmarks.benchmarks import Figure


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.12345, "0.123"),
        (1.2345, "1.23"),
        (12.345, "12.3"),
        (123.45, "123"),
        (123456.7, "123457"),
        (3.0, "3.00"),
        (3, "3"),
        (1234567, "1234567"),
    ],
)
def test_number_text_has_three_digits(value: float, text: str) -> None:
    assert report.number_text(value) == text


@given(st.floats(min_value=0.01, max_value=1e9))
def test_number_text_is_accurate_to_half_a_digit(value: float) -> None:
    text = report.number_text(value)
    assert "e" not in text
    assert math.isclose(float(text), value, rel_tol=0.005, abs_tol=0.000501)  # half a digit, and rounding


def test_value_bound_and_verdict_texts_of_figures() -> None:
    assert report.value_text(Figure("a", 1.23456, "s")) == "1.23 s"
    assert report.value_text(Figure("a", math.nan, "s")) == "-"
    assert report.bound_text(Figure("a", 1.0)) == report.verdict_text(Figure("a", 1.0)) == ""
    assert report.bound_text(Figure("a", 1.0, maximum=1.15)) == "≤ 1.15"
    assert report.bound_text(Figure("a", 1.0, minimum=5.0, maximum=9.0)) == "≥ 5, ≤ 9"
    assert report.verdict_text(Figure("a", 1.0, minimum=5.0)) == "NOT HELD"
    assert report.verdict_text(Figure("a", 6.0, minimum=5.0)) == "held"
