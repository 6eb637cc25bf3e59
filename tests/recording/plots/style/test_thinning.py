"""A thinned curve looks the same: it keeps its ends, its peaks and its gaps."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cellwright.recording.plots.style import thinned


@given(st.integers(1, 4000), st.integers(1, 50), st.integers(0, 2**32 - 1), st.booleans())
def test_thinned_curve_keeps_extremes_of_each_slice(count: int, slices: int, seed: int, has_gaps: bool) -> None:
    chance = np.random.default_rng(seed)
    times = np.cumsum(chance.uniform(0.0, 1.0, count))
    values = chance.normal(size=count)
    if has_gaps:
        values[chance.random(count) < 0.2] = np.nan
    at, kept = thinned(times, values, slices)
    assert at[0] == times[0]
    assert at[-1] == times[-1]
    assert (np.diff(at) >= 0).all()
    if not np.isnan(values).all():
        assert (np.nanmin(kept), np.nanmax(kept)) == (np.nanmin(values), np.nanmax(values))
    assert np.isnan(kept).any() == np.isnan(values).any()
    assert set(zip(at, np.nan_to_num(kept, nan=9e9), strict=True)) <= set(
        zip(times, np.nan_to_num(values, nan=9e9), strict=True)
    )


def test_long_curve_is_thinned_and_short_one_kept() -> None:
    times = np.arange(100_000.0)
    at, _ = thinned(times, np.sin(times), 1000)
    assert 1000 <= len(at) <= 2002
    assert len(thinned(times[:4000], times[:4000], 1000)[0]) == 4000


def test_thinned_curve_keeps_single_spike() -> None:
    values = np.zeros(50_000)
    values[31_415] = 7.0
    at, kept = thinned(np.arange(50_000.0), values, 100)
    assert at[kept == 7.0].tolist() == [31_415.0]
