"""Halton points."""

import numpy as np
import pytest

from cellwright.util.halton import halton


def test_coordinates_are_mirrored_digits() -> None:
    assert halton(5, 1).ravel().tolist() == [1 / 2, 1 / 4, 3 / 4, 1 / 8, 5 / 8]
    assert halton(4, 2)[:, 1] == pytest.approx([1 / 3, 2 / 3, 1 / 9, 4 / 9])


@pytest.mark.parametrize("dimensions", [1, 7, 20])
def test_points_fill_the_cube_evenly(dimensions: int) -> None:
    points = halton(2000, dimensions)
    assert points.min() > 0.0
    assert points.max() < 1.0
    # as many in each half as in the other, within what the largest base allows
    assert np.abs((points < 0.5).mean(axis=0) - 0.5).max() < 0.02


def test_more_dimensions_than_primes_are_refused() -> None:
    with pytest.raises(ValueError, match="zip"):
        halton(1, 21)
