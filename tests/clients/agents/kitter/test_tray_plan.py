"""Places of parts on the tray."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.agents.kitter.kits import PART_GAP, RIM_GAP, find_place, fits
from cellwright.clients.agents.kitter.part_figures import Catalogue, Disc
from cellwright.clients.agents.kitter.perception import TRAY_HALF_X, TRAY_HALF_Y
from cellwright.config.layout import PART_TYPES
from cellwright.util.pose import Pose

figures = Catalogue().figures


def on_tray(x: float, y: float, yaw: float = 0.0) -> Pose:
    return Pose.from_rpy((x, y, 0.0), (0.0, 0.0, yaw))


def test_free_ordered_pose_is_used_unchanged() -> None:
    goal = on_tray(0.1, -0.2, 0.3)
    place = find_place(figures("piston_rod_part"), goal, ())
    assert place is not None
    assert place.is_ordered
    assert place.tray_T_part.position == pytest.approx(goal.position)
    assert place.tray_T_part.yaw == pytest.approx(0.3)


def test_ordered_height_and_tilt_are_ignored() -> None:
    place = find_place(figures("gear_part"), Pose.from_rpy((0.1, 0.0, -0.21), (math.pi, 0.0, 0.0)), ())
    assert place is not None
    assert place.tray_T_part.rpy == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert place.tray_T_part.position[2] == 0.0


def test_pose_off_tray_is_moved_to_its_edge() -> None:
    place = find_place(figures("gear_part"), on_tray(0.74, -0.14), ())
    assert place is not None
    assert not place.is_ordered
    x, y, _ = place.tray_T_part.position
    nearest_x = TRAY_HALF_X - 0.0392 - RIM_GAP
    assert nearest_x - 0.01 <= x <= nearest_x
    assert y == pytest.approx(-0.14, abs=0.011)


def test_places_of_parts_do_not_overlap() -> None:
    gears: list[Disc] = []
    for y in (-0.17, -0.14, -0.15, -0.16):
        place = find_place(figures("gear_part"), on_tray(0.74, y), gears)
        assert place is not None
        (disc,) = figures("gear_part").covers(place.tray_T_part)
        assert all(math.dist((disc.x, disc.y), (g.x, g.y)) >= 2 * 0.0392 + PART_GAP for g in gears)
        gears.append(disc)


def test_blocked_yaw_is_replaced_by_free_yaw() -> None:
    # a wall of discs leaves a lane 0.14 m wide along y: too narrow for a 0.3 m long part across it
    walls = [Disc(x, 0.01 * row, 0.02) for x in (-0.1, 0.1) for row in range(-35, 36)]
    place = find_place(figures("part1"), on_tray(0.0, 0.0, 0.0), walls, lambda pose: abs(pose.position[0]) < 0.05)
    assert place is not None
    assert abs(math.sin(place.tray_T_part.yaw)) > 0.9


def test_place_out_of_reach_is_moved() -> None:
    place = find_place(figures("gear_part"), on_tray(0.1, 0.0), (), lambda pose: pose.position[0] < 0.0)
    assert place is not None
    assert not place.is_ordered
    assert place.tray_T_part.position[0] == pytest.approx(-0.01)


def test_full_tray_has_no_place() -> None:
    assert find_place(figures("gear_part"), on_tray(0.0, 0.0), [Disc(0.0, 0.0, 1.0)]) is None


@pytest.mark.slow
@given(
    st.sampled_from(sorted(PART_TYPES)),
    st.floats(-1.0, 1.0),
    st.floats(-1.0, 1.0),
    st.floats(-3.0, 3.0),
    st.lists(st.builds(Disc, st.floats(-0.25, 0.25), st.floats(-0.35, 0.35), st.floats(0.01, 0.1)), max_size=3),
)
def test_any_ordered_pose_gives_free_place_on_tray(
    part_type: str, x: float, y: float, yaw: float, others: list[Disc]
) -> None:
    place = find_place(figures(part_type), on_tray(x, y, yaw), others)
    if place is None:
        return
    part = figures(part_type).covers(place.tray_T_part)
    assert fits(part, others, 0.0, 0.0)
    assert all(abs(disc.x) + disc.radius <= TRAY_HALF_X and abs(disc.y) + disc.radius <= TRAY_HALF_Y for disc in part)
