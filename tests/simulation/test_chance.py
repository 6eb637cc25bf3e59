import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cellwright.simulation.chance import SampleNoise, generator


def test_one_name_one_stream() -> None:
    assert generator(1, "belt").normal() == generator(1, "belt").normal()
    assert generator(1, "belt").normal() != generator(1, "arm").normal()
    assert generator(1, "belt").normal() != generator(2, "belt").normal()


@given(st.integers(0, 2**40), st.integers(1, 50))
def test_noise_belongs_to_the_sample_number(sample: int, size: int) -> None:
    noise = SampleNoise(7, "camera")
    first = noise.normal(sample, size)
    noise.normal(sample + 1, 3)
    assert np.array_equal(first, SampleNoise(7, "camera").normal(sample, size))
    assert np.array_equal(first[:1], noise.normal(sample, 1))


def test_neighbouring_samples_are_independent() -> None:
    noise = SampleNoise(0, "laser")
    draws = np.array([noise.normal(n, 400) for n in range(500)])
    assert abs(draws.mean()) < 4 / np.sqrt(draws.size)
    assert abs(draws.std() - 1) < 0.01
    neighbours = np.corrcoef(draws[:-1].ravel(), draws[1:].ravel())[0, 1]
    assert abs(neighbours) < 4 / np.sqrt(draws.size)
