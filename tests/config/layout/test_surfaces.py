"""Surfaces of a layout."""

import math

import pytest

from cellwright.config.layout.gear2017 import gear2017
from cellwright.config.layout.surfaces import surfaces
from cellwright.config.trial.gear2017 import load_trial


def test_each_place_for_parts_has_its_surface() -> None:
    found = {each.name: each for each in surfaces(gear2017())}
    assert [*found] == [*(f"bin{n}" for n in range(1, 9)), "belt", "agv1", "agv2"]
    assert found["belt"].middle.position == pytest.approx((1.21, 3.0, 0.90691))
    assert found["belt"].middle.yaw == pytest.approx(-math.pi / 2)
    assert found["agv2"].middle.position == pytest.approx((0.3, -3.15, 0.755))
    assert [name for name, each in found.items() if each.is_belt] == ["belt"]


def test_fixed_tray_has_a_surface() -> None:
    layout = load_trial(text="cell: {trays: {tray1: {at: [1, 2], surface: 0.8, size: [0.3, 0.4]}}}").trial.layout
    surface = surfaces(layout)[-1]
    assert (surface.middle.position, surface.size) == ((1.0, 2.0, 0.8), (0.3, 0.4))
