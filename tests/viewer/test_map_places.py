"""Places on maps of cells."""

import math

import pytest

from cellwright.util.pose import Pose
from cellwright.viewer.map_places import corners_of, edges, shared_area, span

SQUARE = ((0.0, 0.0), (2.0, 2.0))


def test_span_is_around_the_corners_of_a_turned_rectangle() -> None:
    turned = Pose.from_rpy((1.0, 2.0, 0.0), (0.0, 0.0, math.pi / 2))
    low, high = span(corners_of(turned, (4.0, 1.0)))
    assert low == pytest.approx((0.5, 0.0))
    assert high == pytest.approx((1.5, 4.0))


@pytest.mark.parametrize(
    ("other", "area"),
    [(SQUARE, 4.0), (((1.0, 1.5), (3.0, 3.0)), 0.5), (((2.0, 0.0), (3.0, 2.0)), 0.0), (((3.0, 3.0), (4.0, 4.0)), 0.0)],
)
def test_shared_area_of_two_rectangles(other: tuple[tuple[float, float], tuple[float, float]], area: float) -> None:
    assert shared_area(SQUARE, other) == shared_area(other, SQUARE) == pytest.approx(area)


def test_names_are_inside_an_edge_first_and_then_outside() -> None:
    assert edges(SQUARE) == [((2.0, 1.0), (-1, 0)), ((0.0, 1.0), (1, 0)), ((2.0, 1.0), (1, 0)), ((0.0, 1.0), (-1, 0))]
    assert edges(SQUARE, upper_first=False)[0] == ((0.0, 1.0), (1, 0))
