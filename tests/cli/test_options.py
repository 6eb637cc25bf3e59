"""Tests of checks on command line values."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from fractions import Fraction

import pytest

from cellwright.cli.options import ABOVE_0, FINITE, camera, check_views, errors_of, in_range, one_of
from cellwright.config.trial.trial import Trial
from cellwright.util.errors import UnknownNameError, UsageError
from tests.support.places import LAYOUT


@pytest.mark.parametrize("value", [None, 1, 3, 2.5, Fraction(3, 2)])
def test_in_range_returns_allowed_value(value: float | None) -> None:
    assert in_range("--n", value, 1, 3, "a number") is value


@pytest.mark.parametrize("value", [0, 4, 0.999, math.nan, math.inf])
def test_in_range_refuses_other_values(value: float) -> None:
    with pytest.raises(UsageError, match=re.escape(f"--n {value}: give a number from 1 to 3")):
        in_range("--n", value, 1, 3, "a number from 1 to 3")


def test_in_range_error_shows_integers_and_text_unchanged() -> None:
    with pytest.raises(UsageError, match="--n 12345678: give"):
        in_range("--n", 12345678, 0, 1, "less")
    with pytest.raises(UsageError, match=r"--n 1\.50: give"):
        in_range("--n", 1.5, 0, 1, "less", "1.50")
    with pytest.raises(UsageError, match="--n : give"):
        in_range("--n", math.nan, 0, 1, "less", "")


@pytest.mark.parametrize(("value", "is_allowed"), [(0.0, False), (5e-324, True), (1.7e308, True), (math.inf, False)])
def test_bounds_exclude_0_and_infinity(value: float, *, is_allowed: bool) -> None:
    assert (ABOVE_0 <= value <= FINITE) == is_allowed


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (UsageError("x: give y"), "--o x: give y"),
        (UnknownNameError("view", "tp", ["top"]), "--o: unknown view 'tp'; did you mean top (known: top)"),
    ],
)
def test_errors_of_prefixes_option(error: Exception, text: str) -> None:
    with pytest.raises(UsageError) as raised, errors_of("--o"):
        raise error
    assert str(raised.value) == text


def test_errors_of_passes_other_errors_through() -> None:
    with pytest.raises(ZeroDivisionError), errors_of("--o"):
        raise ZeroDivisionError


def test_one_of_returns_name_or_lists_known_ones() -> None:
    assert one_of("--o", "view", "top", ("side", "top")) == "top"
    with pytest.raises(UsageError, match=r"--o: unknown view 'below' \(known: side, top\)"):
        one_of("--o", "view", "below", ("side", "top"))


def test_view_of_another_cell_is_refused() -> None:
    own = Trial("own", layout=replace(LAYOUT, carriers=LAYOUT.carriers[:1], views=()))
    check_views(own, {"--camera": camera("agv1"), "--video-camera": None})
    with pytest.raises(UsageError, match=re.escape("--video-camera: unknown view 'agv2'; did you mean agv1")):
        check_views(own, {"--camera": camera("0,0,3:1,0,0"), "--video-camera": "agv2"})
