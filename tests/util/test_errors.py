"""Texts of errors."""

from hypothesis import given
from hypothesis import strategies as st

from cellwright.util.errors import did_you_mean, one_line, printable

ANYTHING = st.text(st.characters(exclude_categories=()))


@given(ANYTHING, st.integers(10, 50))
def test_printable_text_is_encodable_and_short(text: str, max_length: int) -> None:
    shown = printable(text, max_length)
    shown.encode()
    assert all(sign.isprintable() or sign in "\n\t" for sign in shown)
    assert len(shown) <= 10 * (max_length + 3)  # a character that cannot be printed takes up to ten


@given(st.text(st.characters(categories=["L", "N", "P"]), max_size=100))
def test_printable_keeps_ordinary_text(text: str) -> None:
    assert printable(text, 100) == text


def test_printable_keeps_both_ends_of_long_text() -> None:
    assert printable("begin" + 1000 * "-" + "end!!", 10) == "begin … end!!"


@given(ANYTHING)
def test_one_line_is_always_one_line(text: str) -> None:
    line = one_line(ValueError(text))
    assert line.startswith("ValueError")
    assert line.isprintable()


def test_one_line_has_type_and_reason() -> None:
    assert one_line(ValueError("no\n  part")) == "ValueError: no part"
    assert one_line(KeyError()) == "KeyError"
    assert one_line(SyntaxError("wrong", ("file.py", 1, 2, "text"))) == "SyntaxError: wrong"
    assert one_line(SyntaxError()) == "SyntaxError"


def test_did_you_mean_prefers_name_with_same_number() -> None:
    names = ["final15", "final01", "final10"]
    assert did_you_mean("final1", names) == "; did you mean final01"
    assert did_you_mean("Final001", names) == "; did you mean final01"
    assert did_you_mean("final10x", names) == "; did you mean final10"
    assert did_you_mean("x", names) == ""
