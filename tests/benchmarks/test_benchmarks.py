import pytest

from benchmarks.benchmarks import BENCHMARKS, Benchmark, Figure, find_benchmark
from cellwright.util.errors import UnknownNameError


@pytest.mark.parametrize("benchmark", BENCHMARKS, ids=lambda each: each.name)
def test_benchmark_finds_its_module_and_text(benchmark: Benchmark) -> None:
    assert find_benchmark(benchmark.name) is benchmark
    assert callable(benchmark.measure())
    assert all(benchmark.about())


def test_unknown_benchmark_is_refused_with_suggestion() -> None:
    with pytest.raises(UnknownNameError, match="did you mean step"):
        find_benchmark("steps")


@pytest.mark.parametrize(
    ("value", "held"), [(1.0, False), (2.0, True), (2.5, True), (3.0, True), (3.1, False), (float("nan"), False)]
)
def test_figure_is_held_within_bounds(value: float, held: bool) -> None:
    assert Figure("a", value, maximum=3.0, minimum=2.0).is_held is held
    assert Figure("a", value).is_held
