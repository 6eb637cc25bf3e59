"""Names of places in the cell."""

import pytest

from cellwright.cell.checks.difficulty import is_within_reach, place_of
from cellwright.cell.checks.reach import reaches
from cellwright.config.trial.trial import Trial
from tests.support.places import BIN_CENTRES, BIN_PART_HEIGHT, LAYOUT

ARMS = reaches(Trial("", has_arm=True))


@pytest.mark.parametrize(
    ("point", "place"),
    [
        ((0.3, 3.15, 0.8), "AGV 1"),
        ((0.5, -3.4, 0.8), "AGV 2"),
        ((0.56, -3.15, 0.8), "the floor"),
        ((-0.3, 0.23, 0.8), "bin 7"),
        ((-0.6, 1.295, 0.8), "bin 8"),
        ((1.21, 0.0, 1.0), "the belt"),
        ((0.7, 0.0, 1.0), "the floor"),
    ],
)
def test_place_of_point_names_surface_below(point: tuple[float, float, float], place: str) -> None:
    assert place_of(point, LAYOUT) == place


@pytest.mark.parametrize("name", ["bin5", "bin6", "bin7", "bin8"])
def test_near_bins_are_within_reach(name: str) -> None:
    assert is_within_reach((*BIN_CENTRES[name], BIN_PART_HEIGHT), LAYOUT, ARMS)


@pytest.mark.parametrize(
    ("point", "reached"),
    [
        ((0.3, 3.15, 0.755), True),  # the middle of a tray
        ((0.3, -3.3, 0.755), True),
        ((1.21, 0.0, 0.907), True),
        ((0.6, 3.1, 1.0), False),  # beside a tray, on the floor
        ((0.65, -3.2, 0.8), False),
        ((-1.0, 0.23, 0.75), False),  # the far row of bins
        ((0.8, 0.0, 0.0), True),  # straight down beside the rail
    ],
)
def test_points_within_arm_length_are_within_reach(point: tuple[float, float, float], reached: bool) -> None:
    assert is_within_reach(point, LAYOUT, ARMS) == reached
