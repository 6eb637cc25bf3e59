"""Overlaps and ways of AGVs."""

from dataclasses import replace
from math import pi

import pytest

from cellwright.cell.checks.obstacles import blocked_paths, obstacles, overlaps, world_path
from cellwright.config.trial.trial import Trial
from cellwright.util.pose import Pose
from tests.cell.checks.odd import EMPTY, SMALL, bin_at, post_at, trial_with
from tests.support.places import LAYOUT


def test_nothing_overlaps_in_the_cell_of_2017() -> None:
    found = obstacles(Trial(""))
    assert list(overlaps(found)) == []
    assert list(blocked_paths(Trial(""), found)) == []


@pytest.mark.parametrize(("distance", "depth"), [(0.5, 0.1), (0.59, 0.01), (0.598, None), (0.7, None)])
def test_bins_overlap_by_their_depth(distance: float, depth: float | None) -> None:
    layout = replace(EMPTY, bins=(bin_at("one", 0.0, 0.0), bin_at("two", distance, 0.2)))
    found = [round(each, 6) for _, _, each in overlaps(obstacles(trial_with(layout)))]
    assert found == ([] if depth is None else [depth])


def test_turned_bin_reaches_further_along_its_diagonal() -> None:
    square = replace(EMPTY, bins=(bin_at("one", 0.0, 0.0), bin_at("two", 0.65, 0.0)))
    turned = replace(EMPTY, bins=(bin_at("one", 0.0, 0.0), bin_at("two", 0.65, 0.0, yaw=pi / 4)))
    assert list(overlaps(obstacles(trial_with(square)))) == []
    assert len(list(overlaps(obstacles(trial_with(turned))))) == 1


def test_beam_over_a_bin_does_not_overlap_it() -> None:
    layout = replace(LAYOUT, bins=(bin_at("under", 1.21, 0.0),), belts=(), carriers=())
    assert list(overlaps(obstacles(trial_with(layout)))) == []


def test_post_in_the_way_of_an_agv_is_found_once() -> None:
    layout = replace(LAYOUT, structure=(post_at("post", -1.5, 3.3),))
    trial = trial_with(layout)
    ((carrier, other, (x, y)),) = blocked_paths(trial, obstacles(trial))
    assert (carrier.name, other.name) == ("agv1", "post")
    assert x == pytest.approx(-1.15, abs=0.1)
    assert y == pytest.approx(3.3)


def test_path_moves_with_the_cell() -> None:
    by = Pose.from_rpy((2.0, 1.0, 0.0), (0.0, 0.0, pi / 2))
    for one, other in zip(LAYOUT.carriers, LAYOUT.moved(by).carriers, strict=True):
        for way, moved in zip(world_path(one), world_path(other), strict=True):
            expected = [by.transform((x, y, 0.0))[:2] for x, y in way]
            assert [pytest.approx(point, abs=1e-9) for point in expected] == moved


def test_fixed_tray_is_an_obstacle() -> None:
    assert "cell.trays.table" in [each.key for each in obstacles(trial_with(SMALL))]
