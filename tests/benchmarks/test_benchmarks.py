import pytest

from benchmarks.benchmarks import BENCHMARKS, Benchmark, Curve, Figure, find_benchmark
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


SIZES = (0, 2, 4, 8, 16)


@pytest.mark.parametrize(("power", "bend"), [(0, 1.0), (0.5, (16 / 8) ** 0.5 / 2), (1, 1.0), (2, 2.0), (3, 4.0)])
def test_curve_bend_tells_power_of_growth(power: float, bend: float) -> None:
    curve = Curve("a", "part", "us", SIZES, tuple(3.0 if not power else float(size**power) for size in SIZES))
    assert curve.bend == pytest.approx(bend)


def test_curve_figures_are_costs_slope_and_bounded_bend() -> None:
    *costs, slope, bend = Curve("a", "part", "us", SIZES, tuple(10.0 + 3.0 * size for size in SIZES)).figures(1.2)
    assert [figure.value for figure in costs] == [10.0, 16.0, 22.0, 34.0, 58.0]
    assert [figure.label for figure in costs[:2]] == ["a: 0 parts", "a: 2 parts"]
    assert slope.value == pytest.approx(3.0)
    assert bend.value == pytest.approx(1.0)
    assert bend.maximum == 1.2
