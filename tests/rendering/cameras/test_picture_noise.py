"""Noise of pictures: of the requested strength, and the same for the same sample."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.sensors import PictureNoise
from cellwright.engine.random_streams import SampleNoise
from cellwright.rendering.cameras.picture_camera import blur_colour, blur_depth

GREY = np.full((60, 80, 3), 128, np.uint8)
FLAT = np.full((120, 160), 2.0, np.float32)


@pytest.mark.parametrize("share", [0.01, 0.05])
def test_colour_noise_has_configured_deviation(share: float) -> None:
    blurred = blur_colour(GREY, PictureNoise(colour=share), SampleNoise(0, "eye"), 3)
    assert np.std(blurred.astype(float)) == pytest.approx(255 * share, rel=0.05)
    assert np.mean(blurred) == pytest.approx(128, abs=0.5)


@pytest.mark.parametrize(
    ("depth", "growth", "deviation"), [(0.01, 0.0, 0.01), (0.0, 0.002, 0.008), (0.01, 0.002, 0.018)]
)
def test_depth_noise_has_configured_deviation(depth: float, growth: float, deviation: float) -> None:
    noise = PictureNoise(depth=depth, depth_growth=growth)
    blurred = blur_depth(FLAT, noise, SampleNoise(0, "eye"), 3)
    assert np.std(blurred) == pytest.approx(deviation, rel=0.05)
    assert np.mean(blurred) == pytest.approx(2.0, abs=0.001)


def test_zero_noise_returns_same_picture() -> None:
    none, chance = PictureNoise(0.0, 0.0, 0.0), SampleNoise(0, "eye")
    assert blur_colour(GREY, none, chance, 1) is GREY
    assert blur_depth(FLAT, none, chance, 1) is FLAT
    assert blur_colour(GREY, PictureNoise(), chance, 1, factor=0.0) is GREY
    assert blur_depth(FLAT, PictureNoise(), chance, 1, factor=0.0) is FLAT


def test_noise_keeps_missing_depths_and_does_not_wrap_colours() -> None:
    chance = SampleNoise(0, "eye")
    depth = np.array([[np.nan, 1.0, np.inf]], np.float32)
    assert np.isfinite(blur_depth(depth, PictureNoise(), chance, 1)).tolist() == [[False, True, False]]
    ends = np.repeat(np.array([0, 255], np.uint8), 500)
    blurred = blur_colour(ends, PictureNoise(colour=0.1), chance, 1)
    assert blurred[:500].max() < 128 < blurred[500:].min()


@given(sample=st.integers(0, 2**40), others=st.lists(st.integers(0, 100), max_size=3))
def test_noise_is_function_of_sample(sample: int, others: list[int]) -> None:
    chance, noise = SampleNoise(5, "eye"), PictureNoise(0.02, 0.01, 0.0)
    small, flat = GREY[:4, :4], FLAT[:4, :4]
    first = blur_colour(small, noise, chance, sample), blur_depth(flat, noise, chance, sample)
    for other in others:
        chance.normal(other, 3)
        blur_colour(small, noise, chance, other)
    again = blur_colour(small, noise, chance, sample), blur_depth(flat, noise, chance, sample)
    np.testing.assert_array_equal(first[0], again[0])
    np.testing.assert_array_equal(first[1], again[1])
    assert (blur_colour(GREY, noise, chance, sample + 1) != blur_colour(GREY, noise, chance, sample)).any()
    assert (blur_colour(GREY, noise, SampleNoise(6, "eye"), sample) != blur_colour(GREY, noise, chance, sample)).any()
