"""Layout as a value: moved as a whole, and asked for places."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.layout.layout import Layout, Tray, is_on_plate
from cellwright.util.errors import UnknownNameError
from cellwright.util.pose import Pose
from tests.support.places import LAYOUT

QUARTERS = st.sampled_from([math.pi / 2, math.pi, -math.pi / 2])
TRAY = Tray(3, "tray1", Pose.from_rpy((0.95, 0.3, 0.0), (0.0, 0.0, 0.4)), size=(0.4, 0.6), surface=0.8)
WITH_TRAY = replace(LAYOUT, trays=(TRAY,))
offsets = st.floats(-5.0, 5.0)


def test_moving_by_nothing_changes_nothing() -> None:
    assert LAYOUT.moved(Pose()) == LAYOUT
    guarded = replace(LAYOUT, arm_clearance=0.05)
    assert guarded.moved(Pose()) == guarded


@given(offsets, offsets, QUARTERS)
def test_directions_of_a_quarter_turn_are_exact(x: float, y: float, yaw: float) -> None:
    moved = LAYOUT.moved(Pose.from_rpy((x, y, 0.0), (0.0, 0.0, yaw)))
    for direction in (moved.belts[0].direction, *moved.carriers[0].axes):
        assert sorted(map(abs, direction)) == [0.0, 0.0, 1.0]
        assert not any(math.copysign(1.0, value) < 0 and value == 0 for value in direction)


def places(layout: Layout) -> dict[str, Pose]:
    """Return all frames and places of a layout."""
    return {
        **layout.reference_frames,
        **{each.name: each.corner for each in layout.bins},
        **{each.name: each.load_point for each in layout.carriers},
        **{each.name: each.pose for each in layout.arms},
        "shelf": layout.shelf,
    }


@given(offsets, offsets, st.floats(-3.0, 3.0))
def test_all_places_move_with_the_layout(x: float, y: float, yaw: float) -> None:
    by = Pose.from_rpy((x, y, 0.0), (0.0, 0.0, yaw))
    moved = places(WITH_TRAY.moved(by))
    for name, pose in places(WITH_TRAY).items():
        if name != "world":
            assert moved[name].position == pytest.approx((by @ pose).position, abs=1e-9)


@given(offsets, offsets, offsets, offsets, st.floats(-3.0, 3.0))
def test_what_covers_a_point_covers_it_when_both_are_moved(
    x: float, y: float, dx: float, dy: float, yaw: float
) -> None:
    by = Pose.from_rpy((dx, dy, 0.0), (0.0, 0.0, yaw))
    there = by.transform((x, y, 0.0))[:2]
    edges = [abs(abs(x - each.centre[0]) - 0.3) + abs(abs(y - each.centre[1]) - 0.3) for each in LAYOUT.bins]
    for before, after, edge in zip(LAYOUT.bins, LAYOUT.moved(by).bins, edges, strict=True):
        assert before.covers(x, y) == after.covers(*there) or edge < 1e-6


def test_point_on_tray_is_within_plate() -> None:
    assert is_on_plate(0.25, -0.35, (0.5, 0.7))
    assert not is_on_plate(0.26, 0.0, (0.5, 0.7))
    assert not is_on_plate(0.0, 0.36, (0.5, 0.7))


def test_fixed_tray_has_its_frame_just_below_its_surface() -> None:
    frame = WITH_TRAY.reference_frames["tray1::kit_tray_3::tray"]
    assert frame.position == pytest.approx((0.95, 0.3, 0.795))
    assert frame.yaw == pytest.approx(0.4)
    assert TRAY.tray_surface.position == pytest.approx((0.95, 0.3, 0.8))


@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_fixed_tray_covers_the_points_over_its_plate(x: float, y: float) -> None:
    there = TRAY.tray_frame.transform((x, y, 0.0))
    edge = min(abs(abs(x) - 0.2), abs(abs(y) - 0.3))
    assert TRAY.covers(*there[:2]) == (abs(x) <= 0.2 and abs(y) <= 0.3) or edge < 1e-6


def test_stations_are_the_agvs_and_then_the_fixed_trays() -> None:
    assert [each.number for each in WITH_TRAY.stations] == [1, 2, 3]


def test_unknown_name_is_refused_with_a_similar_one() -> None:
    with pytest.raises(UnknownNameError, match="bin7"):
        LAYOUT.bin("bin77")
    with pytest.raises(UnknownNameError, match="agv1"):
        LAYOUT.carrier("agv11")
    with pytest.raises(UnknownNameError, match="tray1"):
        WITH_TRAY.tray("tray11")
