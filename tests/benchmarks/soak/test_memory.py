from __future__ import annotations

import math
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.soak.memory import STEADY, Sample, growth, resident


@pytest.mark.skipif(sys.platform != "linux", reason="not reported by this system")
def test_resident_memory_grows_with_allocation() -> None:
    before = resident()
    block = bytearray(b"x") * (64 << 20)
    assert 60 < resident() - before < 80
    assert len(block) == 64 << 20


@pytest.mark.slow
@given(st.floats(-3.0, 3.0), st.integers(20, 300))
def test_growth_of_straight_line_has_its_slope(slope: float, count: int) -> None:
    found = growth([Sample(number / 10, 100.0 + slope * number / 10) for number in range(count)])
    assert found.slope == pytest.approx(slope * 1024, abs=0.01)
    assert (found.end - found.start) * slope >= 0
    assert found.is_steady == (found.end - found.start <= STEADY)


def test_growth_ignores_loading_at_start() -> None:
    samples = [Sample(number / 10, 40.0 if number < 8 else 100.0) for number in range(100)]
    assert growth(samples).slope == pytest.approx(0.0, abs=0.01)
    assert growth(samples).is_steady


def test_growth_of_leak_is_not_steady() -> None:
    assert not growth([Sample(number / 100, 80 + number / 100) for number in range(1000)]).is_steady


def test_growth_of_too_few_samples_is_nan() -> None:
    found = growth([Sample(0.1, 80.0)] * 19)
    assert all(map(math.isnan, (found.start, found.end, found.slope)))
    assert not found.is_steady


def test_growth_without_memory_figures_is_nan() -> None:
    assert math.isnan(growth([Sample(each / 10, math.nan) for each in range(30)]).end)
