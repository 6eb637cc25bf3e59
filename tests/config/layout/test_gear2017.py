"""Layout of 2017: its places are where the original had them."""

import json
import math
from dataclasses import asdict
from pathlib import Path

import pytest

from cellwright.config.layout.gear2017 import gear2017
from tests.support.places import BELT_SURFACE, LAYOUT, SPAWN_FRAME

FIGURES = Path(__file__).parents[2] / "data" / "layout2017.json"


def test_layout_has_original_figures_to_last_bit() -> None:
    found = json.loads(json.dumps(asdict(gear2017())))
    for name, figures in json.loads(FIGURES.read_text()).items():
        # as texts, in which 0.0 and -0.0 differ
        assert repr(found[name]) == repr(figures), name


def test_layout_is_read_once() -> None:
    assert gear2017() is gear2017()


def test_trays_are_at_described_frames() -> None:
    for agv in LAYOUT.carriers:
        world_T_tray = agv.home @ agv.home_T_tray
        assert world_T_tray.position == pytest.approx(agv.tray_frame.position, abs=1e-6)
        assert world_T_tray.yaw == pytest.approx(agv.tray_frame.yaw)


def test_bins_are_turned_by_90_deg() -> None:
    assert LAYOUT.reference_frames["bin7::link"].position == (-0.3, 0.23, 0.0)
    assert LAYOUT.reference_frames["bin7::link"].yaw == pytest.approx(math.pi / 2, abs=1e-5)


def test_load_points_are_at_original_positions() -> None:
    assert LAYOUT.carrier("agv1").load_point.position == pytest.approx((0.3, 3.3, 0.75))
    assert LAYOUT.carrier("agv2").load_point.position == pytest.approx((0.3, -3.3, 0.75))


def test_spawn_frame_is_just_above_belt() -> None:
    x, y, z = SPAWN_FRAME.transform((0.0, 0.0, 0.1))
    assert (x, y) == pytest.approx((1.21, 5.0))
    assert z - BELT_SURFACE == pytest.approx(0.0057, abs=1e-4)
    assert SPAWN_FRAME.rotate((1.0, 0.0, 0.0)) == pytest.approx((0.0, -1.0, 0.0), abs=1e-5)
