import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cellwright.engine.random_streams import SampleNoise, generator, key


def test_generator_depends_on_seed_and_name() -> None:
    assert generator(1, "belt").normal() == generator(1, "belt").normal()
    assert generator(1, "belt").normal() != generator(1, "arm").normal()
    assert generator(1, "belt").normal() != generator(2, "belt").normal()


@given(st.integers(0, 2**40), st.integers(1, 50))
def test_sample_noise_depends_on_sample_number_only(sample: int, size: int) -> None:
    noise = SampleNoise(7, "camera")
    first = noise.normal(sample, size)
    noise.normal(sample + 1, 3)
    assert np.array_equal(first, SampleNoise(7, "camera").normal(sample, size))
    assert np.array_equal(first[:1], noise.normal(sample, 1))


@given(st.integers(0, 2**40), st.integers(1, 50), st.integers(0, 50))
def test_sample_noise_of_smaller_size_is_a_prefix(sample: int, size: int, more: int) -> None:
    noise = SampleNoise(7, "camera")
    assert np.array_equal(noise.normal(sample, size), noise.normal(sample, size + more)[:size])


@given(st.integers(-1, 2**70), st.integers(0, 2**64))
def test_sample_noise_equals_draws_of_own_generator(sample: int, seed: int) -> None:
    counter = np.array([0, 0, 0, sample % 2**64], dtype=np.uint64)
    plain = np.random.Generator(np.random.Philox(key=key(seed, "laser"), counter=counter))
    assert np.array_equal(SampleNoise(seed, "laser").normal(sample, 7), plain.standard_normal(7))


def test_neighbouring_noise_samples_are_independent() -> None:
    noise = SampleNoise(0, "laser")
    draws = np.array([noise.normal(n, 400) for n in range(500)])
    assert abs(draws.mean()) < 4 / np.sqrt(draws.size)
    assert abs(draws.std() - 1) < 0.01
    neighbours = np.corrcoef(draws[:-1].ravel(), draws[1:].ravel())[0, 1]
    assert abs(neighbours) < 4 / np.sqrt(draws.size)
