"""Expressions: equal to Python's own arithmetic, and safe for all texts."""

import contextlib
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.parsing.expressions import evaluate, expression_value
from cellwright.config.parsing.tree import Leaf, Place
from cellwright.util.errors import ExpressionError

MATH = {name: getattr(math, name) for name in vars(math) if not name.startswith("_")}

numbers = st.one_of(
    st.integers(0, 1000).map(str),
    st.floats(0, 1e6, allow_nan=False).map(repr),
    st.sampled_from(["pi", "e", "tau", ".5", "1e3", "2.", "0x10"]),
)


def combined(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    binary = st.tuples(inner, st.sampled_from(["+", "-", "*", "/", "**", " + "]), inner).map("".join)
    call = st.tuples(st.sampled_from(["sin", "sqrt", "radians", "degrees", "floor", "fabs", "exp", "log"]), inner)
    return st.one_of(
        binary,
        inner.map(lambda text: f"({text})"),
        inner.map(lambda text: f"-{text}"),
        inner.map(lambda text: f"+{text}"),
        call.map(lambda pair: f"{pair[0]}({pair[1]})"),
        st.tuples(inner, inner).map(lambda pair: f"atan2({pair[0]}, {pair[1]})"),
    )


arithmetic = st.recursive(numbers, combined, max_leaves=8)


def outcome(text: str) -> tuple[float | None, bool]:
    """Return the value, None if there is none, and whether it was refused for its size."""
    try:
        return evaluate(text), False
    except ExpressionError as error:
        return None, "too large" in str(error) or "at most" in str(error)


def python_value(text: str) -> float | None:
    """Return Python's own value, None if it is not finite."""
    try:
        number = float(eval(text, {}, MATH))
    except (ArithmeticError, ValueError, TypeError):
        return None
    return number if math.isfinite(number) else None


@given(arithmetic)
def test_expression_equals_python_eval(text: str) -> None:
    value, is_large = outcome(text)
    # Python's own evaluator would take too long for excessive ones.
    assert is_large or value == python_value(text)


@given(st.one_of(st.text(max_size=300), st.text("0123456789.+-*/()e pi_[]'\"=:,lambdxsqrt\n\t\\#", max_size=80)))
def test_any_text_is_finite_number_or_expression_error(text: str) -> None:
    with contextlib.suppress(ExpressionError):
        assert math.isfinite(evaluate(text))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("pi/2", math.pi / 2),
        ("-pi", -math.pi),
        ("-pi/1.5", -math.pi / 1.5),
        ("sqrt(2)/2", math.sqrt(2) / 2),
        ("radians(30)", math.radians(30)),
        ("  2**-1  # a half", 0.5),
        ("2**3**2", 512.0),
        ("-2**2", -4.0),
        ("1/2", 0.5),
        ("factorial(5)", 120.0),
        ("9**9", 387420489.0),
    ],
)
def test_common_expression_has_exact_value(text: str, value: float) -> None:
    assert evaluate(text) == value


@pytest.mark.parametrize(
    ("text", "value"),
    [("1/2", 0.0), ("-7/2", -4.0), ("1.0/2", 0.5), ("pi/2", math.pi / 2), ("floor(7)/2", 3.5), ("3*(5/2)", 6.0)],
)
def test_whole_division_rounds_down_as_in_python_2(text: str, value: float) -> None:
    assert evaluate(text, whole_division=True) == value


@pytest.mark.parametrize(
    "text",
    [
        "",
        "pie",
        "sin",
        "pi()",
        "1j",
        "True",
        "'1'",
        "[1]",
        "1, 2",
        "1 if 1 else 2",
        "1 < 2",
        "5 % 2",
        "5 // 2",
        "1 << 3",
        "~1",
        "(lambda: 1)()",
        "__import__('os')",
        "().__class__",
        "math.pi",
        "open('x')",
        "abs(-1)",
        "log(10, base=2)",
        "hypot(*[3, 4])",
        "frexp(1)",
        "fsum(1)",
        "(-8)**0.5",
        "1/0",
        "sqrt(-1)",
        "inf",
        "nan",
        "1e999",
        "1e308*10",
        "10**400",
        "9**9**9",
        "9**9**9**9",
        "(10**1000)**10**9",
        "factorial(10**9)",
        "factorial(1000)",
        "factorial(-1)",
        "comb(10**9, 5*10**8)",
        "perm(10**8, 10**7)",
        "exp(1000)",
        "ldexp(1, 10**9)",
        "1" * 199 + "0**9",
        "(" * 100 + "1" + ")" * 99,
        "(" * 250 + "1" + ")" * 250,
        "1\0",
        "\ud800",
        "−pi/2",
        "x := 1",
        "-" * 201,
        "1 +",
    ],
)
def test_invalid_expression_is_refused(text: str) -> None:
    with pytest.raises(ExpressionError) as caught:
        evaluate(text)
    assert str(caught.value)


def test_refused_expression_has_remedy() -> None:
    with pytest.raises(ExpressionError, match="did you mean radians"):
        evaluate("radian(30)")
    with pytest.raises(ExpressionError, match="write the minus sign as -"):
        evaluate("−pi")


def test_whole_number_beyond_floats_is_too_large() -> None:
    with pytest.raises(ExpressionError, match=r"^179769.*… is too large$"):
        expression_value(Leaf(2**1024 - 1, Place(0, "a.yaml", 1), "xyz[0]"))
