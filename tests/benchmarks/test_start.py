"""A cold start, once."""

import math

import pytest

from benchmarks.start import STEPS, measure, ran
from cellwright.util.errors import UsageError


@pytest.mark.slow
def test_its_shares_make_the_whole() -> None:
    told: list[str] = []
    figures = {figure.what: figure for figure in measure(told.append, quick=True)}
    assert told == ["1 programs", "1 commands"]
    shares = [figures[f"of that: {what}"].value for what in STEPS]
    assert sum(shares) / 1e3 == pytest.approx(figures["process until its first step"].value)
    assert min(shares) >= 0.0
    memory = figures["resident memory after it"]
    assert math.isnan(memory.value) or (memory.value > 20.0 and memory.most == 200.0)


def test_a_process_that_fails_says_why() -> None:
    with pytest.raises(UsageError, match="no luck"):
        ran("-c", "raise SystemExit('no luck')")
