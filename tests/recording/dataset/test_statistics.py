"""Tests of statistics: equal to those of numpy over all values at once."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.recording.dataset.layout import QUANTILES, STATISTICS
from cellwright.recording.dataset.statistics import PictureStatistics, column_statistics


@given(st.integers(1, 4), st.integers(1, 5), st.integers(0, 2**32), st.sampled_from([1, 3, 255]))
def test_statistics_of_pictures_are_those_of_all_pixels(pictures: int, size: int, seed: int, top: int) -> None:
    drawn = np.random.default_rng(seed).integers(0, top + 1, (pictures, size, size, 3)).astype(np.uint8)
    first, second = PictureStatistics(), PictureStatistics()
    first.add(drawn[0])
    for picture in drawn[1:]:
        second.add(picture)
    first.include(second)
    found = first.as_lists()
    pixels = drawn.reshape(-1, 3) / 255
    expected = {"min": pixels.min(0), "max": pixels.max(0), "mean": pixels.mean(0), "std": pixels.std(0)}
    expected |= {name: np.quantile(pixels, share, axis=0) for name, share in QUANTILES.items()}
    for name, values in expected.items():
        np.testing.assert_allclose(found[name], values.reshape(3, 1, 1), atol=1e-12)
    assert found["count"] == [pictures]
    assert {*found} == {*STATISTICS}


def test_statistics_of_column_have_a_figure_for_each_value() -> None:
    found = column_statistics(np.array([[0.0, 4.0], [1.0, 4.0], [2.0, 4.0]], np.float32))
    assert {*found} == {*STATISTICS}
    assert found["min"] == [0.0, 4.0]
    assert found["std"] == pytest.approx([np.sqrt(2 / 3), 0.0])
    assert found["q90"] == pytest.approx([1.8, 4.0])
    assert found["count"] == [3]


def test_statistics_of_truths_count_them_as_zero_and_one() -> None:
    found = column_statistics(np.array([False, True, True, True]))
    assert (found["mean"], found["q50"]) == ([0.75], [1.0])
