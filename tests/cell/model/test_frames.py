"""Frames of the named places."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.model.frames import (
    AGV_HOMES,
    AGV_T_TRAY,
    BELT_SURFACE,
    SHELF_PITCH,
    SHELF_SURFACE,
    SPAWN_FRAME,
    TRAY_IDS,
    load_point,
    shelf_slot,
)
from cellwright.cell.model.parts import PART_TYPES, part_type
from cellwright.config.layout import REFERENCE_FRAMES, TRAY_FRAMES


def test_trays_are_at_described_frames() -> None:
    for agv, tray in TRAY_IDS.items():
        world_T_tray = AGV_HOMES[agv] @ AGV_T_TRAY
        assert world_T_tray.position == pytest.approx(TRAY_FRAMES[tray].position, abs=1e-6)
        assert world_T_tray.yaw == pytest.approx(TRAY_FRAMES[tray].yaw)


def test_bins_are_turned_by_90_deg() -> None:
    assert REFERENCE_FRAMES["bin7::link"].position == (-0.3, 0.23, 0.0)
    assert REFERENCE_FRAMES["bin7::link"].yaw == pytest.approx(math.pi / 2, abs=1e-5)


def test_load_points_are_at_original_positions() -> None:
    assert load_point("agv1").position == pytest.approx((0.3, 3.3, 0.75))
    assert load_point("agv2").position == pytest.approx((0.3, -3.3, 0.75))


def test_spawn_frame_is_just_above_belt() -> None:
    x, y, z = SPAWN_FRAME.transform((0.0, 0.0, 0.1))
    assert (x, y) == pytest.approx((1.21, 5.0))
    assert z - BELT_SURFACE == pytest.approx(0.0057, abs=1e-4)
    assert SPAWN_FRAME.rotate((1.0, 0.0, 0.0)) == pytest.approx((0.0, -1.0, 0.0), abs=1e-5)


@pytest.mark.slow
@given(st.integers(1, 400), st.data())
def test_shelf_slots_are_at_least_pitch_apart(count: int, data: st.DataObject) -> None:
    first = data.draw(st.integers(0, count - 1))
    second = data.draw(st.integers(0, count - 1).filter(lambda other: other != first) if count > 1 else st.just(first))
    here, there = shelf_slot(first, count, 0.0), shelf_slot(second, count, 0.0)
    assert here.position[2] == SHELF_SURFACE
    if first != second:
        assert math.dist(here.position, there.position) >= SHELF_PITCH - 1e-9


def test_shelf_pitch_exceeds_size_of_each_part() -> None:
    for kind in PART_TYPES:
        (x0, y0, _), (x1, y1, _) = part_type(kind).box
        assert 2 * math.hypot(max(-x0, x1), max(-y0, y1)) < SHELF_PITCH
