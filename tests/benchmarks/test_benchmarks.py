import pytest

from benchmarks.benchmarks import BENCHMARKS, Benchmark, Figure, find_benchmark
from cellwright.util.errors import UnknownNameError


@pytest.mark.parametrize("benchmark", BENCHMARKS, ids=lambda each: each.name)
def test_each_benchmark_has_its_module(benchmark: Benchmark) -> None:
    assert find_benchmark(benchmark.name) is benchmark
    assert callable(benchmark.measure())
    assert all(benchmark.about())


def test_an_unknown_benchmark() -> None:
    with pytest.raises(UnknownNameError, match="did you mean step"):
        find_benchmark("steps")


@pytest.mark.parametrize(
    ("value", "held"), [(1.0, False), (2.0, True), (2.5, True), (3.0, True), (3.1, False), (float("nan"), False)]
)
def test_bounds(value: float, held: bool) -> None:
    assert Figure("a", value, maximum=3.0, minimum=2.0).is_held is held
    assert Figure("a", value).is_held
