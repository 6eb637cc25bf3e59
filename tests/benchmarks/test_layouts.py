"""Growth of a step's cost with the numbers of bins, belts and AGVs."""

import numpy as np
import pytest

from benchmarks import layouts
from benchmarks.benchmarks import Curve
from benchmarks.growth import run
from benchmarks.layouts import LARGE, Size, cell_of, layout, measure, parts
from cellwright.config.layout.gear2017 import gear2017
from cellwright.running.run.collisions import CollisionWatch


def test_layout_of_usual_size_has_places_of_2017() -> None:
    found = layout(Size())
    assert (found.belts, found.carriers) == (gear2017().belts, gear2017().carriers)
    assert [each.centre[1] for each in found.bins] == [each.centre[1] for each in gear2017().bins]


def test_large_layout_has_names_and_parts_of_its_own() -> None:
    found = layout(LARGE)
    names = [each.name for some in (found.bins, found.belts, found.carriers) for each in some]
    assert len(set(names)) == len(names) == 24 + 3 + 4
    assert [each.direction for each in found.belts] == [(0.0, -1.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)]
    assert len(parts(found)) == 24 * 16 + 3 * 8


@pytest.mark.slow
def test_parts_of_large_cell_sleep_in_bins_and_ride_on_belts() -> None:
    cell = cell_of(LARGE, 6)
    run(cell, 1500)
    assert (cell.parts.positions()[:, 2] > 0.72).all()
    before = cell.parts.positions()
    run(cell, 250)
    moved = cell.parts.positions() - before
    assert np.abs(moved[: 24 * 16]).max() < 1e-9
    assert np.allclose(moved[24 * 16 :, 1].reshape(3, 8), [[-0.1], [0.1], [-0.1]], atol=1e-3)


@pytest.mark.slow
def test_quick_run_yields_curves_and_large_cell(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("BINS", "BELTS", "CARRIERS"):
        monkeypatch.setattr(layouts, name, (0, 1, 2))
    monkeypatch.setattr(layouts, "LARGE", Size(2, 2, 2))
    found = list(measure(print, quick=True))
    curves = [each for each in found if isinstance(each, Curve)]
    assert [curve.size for curve in curves] == ["bin", "belt", "AGV"]
    assert [each.maximum for each in found if not isinstance(each, Curve) and each.maximum] == [1.2, 1.2, 1.2, 1.6]


def test_two_arms_swing_apart_from_each_other() -> None:
    cell = cell_of(Size(arms=2), 4)
    watch = CollisionWatch(cell)
    run(cell, 1500)
    assert watch.end() == []
    assert watch.nearest is not None
    assert watch.nearest.distance > 0.1
