"""Footprints: equal to the parts as built, with exact distances."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.model.parts import PART_TYPES, part_type
from cellwright.config.footprints import PART_FOOTPRINTS, PART_RADII, UNKNOWN_RADIUS, footprint
from cellwright.util.pose import Pose

TYPES = st.sampled_from(sorted(PART_FOOTPRINTS))
AWAY = st.floats(-0.5, 0.5)
TURNS = st.floats(-math.pi, math.pi)


def at(x: float = 0.0, y: float = 0.0, yaw: float = 0.0, roll: float = 0.0) -> Pose:
    return Pose.from_rpy((x, y, 0.7), (roll, 0.0, yaw))


@pytest.mark.parametrize("name", PART_TYPES)
def test_footprint_covers_part_as_built(name: str) -> None:
    (left, down, _), (right, up, _) = part_type(name).box
    covered = footprint(name, at())
    spans = [(patch.span(1, 0), patch.span(0, 1)) for patch in covered.patches]
    x = min(span[0][0] for span in spans), max(span[0][1] for span in spans)
    y = min(span[1][0] for span in spans), max(span[1][1] for span in spans)
    assert x == pytest.approx((left, right), abs=2e-4)
    assert y == pytest.approx((down, up), abs=2e-4)
    assert covered.radius == PART_RADII[name]


def test_footprint_gap_equals_distance_by_hand() -> None:
    gear = footprint("gear_part", at())
    assert gear.gap(footprint("gear_part", at(0.08)), 1.0) == pytest.approx(0.08 - 2 * 0.0392)
    assert gear.gap(footprint("gear_part", at(0.06, 0.08)), 1.0) == pytest.approx(0.1 - 2 * 0.0392)
    assert gear.gap(footprint("gear_part", at(0.07)), 1.0) == pytest.approx(0.07 - 2 * 0.0392)  # they overlap
    bar = footprint("part2", at())
    assert bar.gap(footprint("part2", at(0.1)), 1.0) == pytest.approx(0.04)
    assert bar.gap(footprint("part2", at(0.1, yaw=math.pi / 2)), 1.0) == pytest.approx(0.1 - 0.03 - 0.0075)
    assert bar.gap(footprint("part2", at(0.09, 0.055)), 1.0) == pytest.approx(
        math.hypot(0.03, 0.04)
    )  # corner to corner
    assert bar.gap(gear, 1.0) < 0.0


def test_footprint_of_upside_down_part_is_mirrored() -> None:
    rod, over = footprint("piston_rod_part", at()), footprint("piston_rod_part", at(roll=math.pi))
    assert max(patch.span(0, 1)[1] for patch in rod.patches) == pytest.approx(0.135)
    assert min(patch.span(0, 1)[0] for patch in over.patches) == pytest.approx(-0.135)


def test_footprint_of_tilted_or_unknown_part_is_disc() -> None:
    (tilted,) = footprint("piston_rod_part", at(roll=0.3)).patches
    assert (tilted.corners, tilted.radius) == (((0.0, 0.0),), PART_RADII["piston_rod_part"])
    assert footprint("an unknown type", at()).radius == UNKNOWN_RADIUS


def test_footprint_margin_in_square_is_signed() -> None:
    assert footprint("gear_part", at(0.1, -0.2)).margin(Pose(), (0.6, 0.6)) == pytest.approx(0.3 - 0.2392)
    assert footprint("gear_part", at(1.0, 0.0)).margin(Pose(), (0.6, 0.6)) == pytest.approx(0.3 - 1.0392)


@given(TYPES, TYPES, AWAY, AWAY, TURNS, TURNS)
def test_footprint_gap_is_symmetric_and_frame_independent(
    first: str, second: str, x: float, y: float, yaw: float, turn: float
) -> None:
    a, b = at(0.0, 0.0, yaw), at(x, y, turn)
    gap = footprint(first, a).gap(footprint(second, b), math.inf)
    assert footprint(second, b).gap(footprint(first, a), math.inf) == pytest.approx(gap, abs=1e-9)
    elsewhere = Pose.from_rpy((0.3, -0.2, 0.0), (0.0, 0.0, 1.0))
    moved = footprint(first, elsewhere @ a).gap(footprint(second, elsewhere @ b), math.inf)
    assert moved == pytest.approx(gap, abs=1e-9)


@given(TYPES, TYPES, AWAY, AWAY, TURNS, st.floats(0.0, 0.2))
def test_footprint_gap_above_enough_stays_above_enough(
    first: str, second: str, x: float, y: float, turn: float, cutoff: float
) -> None:
    a, b = footprint(first, at()), footprint(second, at(x, y, turn))
    exact, quick = a.gap(b, math.inf), a.gap(b, cutoff)
    assert quick == exact or min(quick, exact) > cutoff
