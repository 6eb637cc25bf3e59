"""Growth of cost and memory with the number of parts."""

from collections import Counter

import numpy as np
import pytest

from benchmarks import growth
from benchmarks.benchmarks import Curve
from benchmarks.growth import grown_cell, measure, resting_parts


@pytest.mark.parametrize("count", [50, 400])
def test_resting_parts_lie_apart_in_equal_shares(count: int) -> None:
    parts = resting_parts(count)
    assert len({part.name for part in parts}) == count
    assert max(Counter(part.type for part in parts).values()) <= count / 4 + 1
    places = np.array([part.pose.position[:2] for part in parts])
    distances = np.linalg.norm(places[:, None] - places[None], axis=2)
    assert distances[~np.eye(count, dtype=bool)].min() > 0.129
    assert (places[:, 0] < -1.5).mean() == pytest.approx(280 / 408, abs=0.05)  # the share of the tables


@pytest.mark.slow
def test_grown_cell_parts_sleep_and_ride() -> None:
    cell = grown_cell(400, 16, 5)
    growth.run(cell, 1000)
    places = cell.parts.positions()
    assert (places[:400, 2] > 0.72).all()
    assert sum(cell.simulation.data.tree_asleep < 0) <= 17  # the arm, and what rides
    growth.run(cell, 250)
    moved = cell.parts.positions() - places
    assert np.abs(moved[:400]).max() < 1e-9
    assert np.allclose(moved[400:, 1], -0.5 * cell.conveyors["belt"].speed, atol=1e-3)


@pytest.mark.slow
def test_growth_quick_run_yields_bounded_figures_and_curves(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("RESTING", "RIDING"):
        monkeypatch.setattr(growth, name, (0, 1, 2, 3, 4))
    found = list(measure(print, quick=True))
    curves = [each for each in found if isinstance(each, Curve)]
    figures = [each for each in found if not isinstance(each, Curve)]
    assert [curve.title for curve in curves] == ["step, parts at rest", "step, parts on the belt", "resident memory"]
    assert [figure.maximum for figure in figures if figure.maximum is not None] == [1.2, 2.0, 1.2, 1.2, 1.2]
    # a slope and a bend compare two short timings: on a busy machine they can have any sign
    compared = [figure for figure in figures if "one more" in figure.label or "straight line" in figure.label]
    assert all(figure.value > 0.0 for figure in figures if figure not in compared)
