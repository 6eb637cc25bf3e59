"""Places of parts on the tray."""

import math
from collections.abc import Callable, Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.agents.kitter import kits
from cellwright.clients.agents.kitter.kits import PART_GAP, RIM_GAP, TraySpot
from cellwright.clients.agents.kitter.part_figures import Catalogue, Disc, PartFigures
from cellwright.config.footprints import PART_TYPES
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.places import HALF

figures = Catalogue().figures
TRAY_HALF_X, TRAY_HALF_Y = HALF


def find_place(
    kind: PartFigures, goal: Pose, others: Sequence[Disc], is_reachable: Callable[[Pose], bool] = lambda _: True
) -> TraySpot | None:
    return kits.find_place(kind, goal, HALF, others, is_reachable)


def find_turning_spot(
    kind: PartFigures,
    goal: Pose,
    others: Sequence[Disc],
    lying: Sequence[Disc],
    is_reachable: Callable[[Pose, float], bool] = lambda _pose, _direction: True,
) -> TraySpot | None:
    return kits.find_turning_spot(kind, goal, HALF, others, lying, is_reachable)


def fits(part: Sequence[Disc], others: Sequence[Disc], rim_gap: float, part_gap: float) -> bool:
    return kits.fits(part, HALF, others, rim_gap, part_gap)


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


def test_smaller_tray_has_less_room() -> None:
    part, goal = figures("part1"), on_tray(0.0, 0.0)
    assert kits.find_place(part, goal, (0.18, 0.1), ()) is not None
    assert kits.find_place(part, goal, (0.1, 0.1), ()) is None


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


PULLEY = figures("pulley_part")
HAND = ((0.03, 0.0), (0.03, 0.04), (0.08, 0.05), (0.12, 0.055), (0.16, 0.055), (0.18, 0.04), (0.195, 0.0))
"""Outline of the hand, drawn back: distances [m] behind the part's side, and of its edge from the middle."""


def points_of_hand(place: Pose, direction: float) -> list[tuple[float, float]]:
    """Return points of the tray under the hand that points at the side of a pulley."""
    x, y, _ = place.position
    cos, sin = math.cos(direction), math.sin(direction)
    edges = [(-(PULLEY.side + back), side * half) for back, half in HAND for side in (-1.0, 1.0)]
    return [(x + along * cos - across * sin, y + along * sin + across * cos) for along, across in edges]


@given(st.floats(-0.3, 0.3), st.floats(-0.4, 0.4), st.floats(-3.0, 3.0))
def test_part_rolled_about_direction_has_ordered_yaw(x: float, y: float, yaw: float) -> None:
    spot = find_turning_spot(PULLEY, on_tray(x, y, yaw), (), ())
    assert spot is not None
    assert spot.direction is not None
    place = spot.tray_T_part
    axis = Pose.from_rpy(place.position, (0.0, 0.0, spot.direction))
    roll = axis @ Pose.from_rpy((0.0, 0.0, 0.0), (math.pi, 0.0, 0.0)) @ axis.inverse()
    after = roll @ place @ PULLEY.other_side
    assert after.position[:2] == pytest.approx(place.position[:2], abs=1e-9)
    assert after.rotate((0.0, 0.0, 1.0)) == pytest.approx((0.0, 0.0, 1.0), abs=1e-9)
    assert math.remainder(after.yaw - yaw, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)


@given(st.floats(-0.3, 0.3), st.floats(-0.4, 0.4), st.floats(-3.0, 3.0))
def test_turning_spot_has_hand_and_part_inside_rims(x: float, y: float, yaw: float) -> None:
    goal = on_tray(x, y, yaw)
    spot = find_turning_spot(PULLEY, goal, (), ())
    assert spot is not None
    assert spot.direction is not None
    assert fits(PULLEY.covers(spot.tray_T_part), (), 0.0, 0.0)
    for px, py in points_of_hand(spot.tray_T_part, spot.direction):
        assert abs(px) < TRAY_HALF_X
        assert abs(py) < TRAY_HALF_Y
    if spot.is_ordered:
        assert spot.tray_T_part.position[:2] == pytest.approx(goal.position[:2])
    else:
        assert fits(PULLEY.covers(spot.tray_T_part), (), RIM_GAP, 0.0)


def test_free_ordered_place_is_turning_spot() -> None:
    spot = find_turning_spot(PULLEY, on_tray(0.1, 0.1), (), ())
    assert spot is not None
    assert spot.is_ordered


@given(st.floats(-0.13, 0.13), st.floats(-0.23, 0.23), st.floats(-0.25, 0.25), st.floats(-0.35, 0.35))
def test_turning_spot_is_beside_other_parts(x: float, y: float, other_x: float, other_y: float) -> None:
    gear = figures("gear_part").covers(on_tray(other_x, other_y))
    spot = find_turning_spot(PULLEY, on_tray(x, y), gear, gear)
    if spot is None:
        return
    assert spot.direction is not None
    assert fits(PULLEY.covers(spot.tray_T_part), gear, 0.0, 0.0)
    for point in points_of_hand(spot.tray_T_part, spot.direction):
        assert math.dist(point, (other_x, other_y)) > gear[0].radius


def test_hand_avoids_only_parts_that_lie_there() -> None:
    """Parts that are ordered under it come later: only the part itself has to leave room for them."""
    goal = on_tray(0.1, 0.1)
    first = find_turning_spot(PULLEY, goal, (), ())
    assert first is not None
    assert first.direction is not None
    back = PULLEY.side + 0.1
    gear = Disc(0.1 - back * math.cos(first.direction), 0.1 - back * math.sin(first.direction), 0.0392)
    assert find_turning_spot(PULLEY, goal, [gear], ()) == first
    other = find_turning_spot(PULLEY, goal, [gear], [gear])
    assert other is not None
    assert other.is_ordered
    assert other.direction != first.direction


def test_turning_spot_out_of_reach_is_another_direction_or_place() -> None:
    goal = on_tray(0.1, 0.1)
    first = find_turning_spot(PULLEY, goal, (), ())
    assert first is not None
    other = find_turning_spot(PULLEY, goal, (), (), lambda _pose, direction: direction != first.direction)
    assert other is not None
    assert other.is_ordered
    assert other.direction != first.direction
    elsewhere = find_turning_spot(PULLEY, goal, (), (), lambda pose, _direction: pose.position[0] < 0.0)
    assert elsewhere is not None
    assert not elsewhere.is_ordered
    assert elsewhere.tray_T_part.position[0] < 0.0


def test_tray_without_room_for_hand_has_no_turning_spot() -> None:
    assert find_turning_spot(PULLEY, on_tray(0.0, 0.0), (), [Disc(0.0, 0.0, 1.0)]) is None
    assert find_turning_spot(PULLEY, on_tray(0.0, 0.0), [Disc(0.0, 0.0, 1.0)], ()) is None
    assert find_turning_spot(PULLEY, on_tray(0.0, 0.0), (), (), lambda _pose, _direction: False) is None
