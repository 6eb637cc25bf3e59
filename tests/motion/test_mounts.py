import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.motion.kinematics import rail_candidates
from cellwright.motion.mounts import FixedMount, RailMount
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose

COORDINATES = st.floats(-3.0, 3.0)
RING = (0.45, 1.0)


def test_fixed_mount_has_one_place() -> None:
    base = Pose((1.0, 2.0, 0.5))
    assert list(FixedMount(base).places(Pose(), 0.7)) == [(0.0, base)]


@given(COORDINATES, COORDINATES, COORDINATES, st.floats(-2.1, 2.1), st.floats(-3.0, 3.0))
def test_turned_and_moved_rail_has_same_positions(x: float, y: float, z: float, present: float, yaw: float) -> None:
    placed = Pose.from_rpy((0.7, -1.2, 0.3), (0.0, 0.0, yaw))
    rail = RailMount(placed @ Pose((0.3, 0.0, 1.0)), (0.0, 1.0, 0.0), -2.1, 2.1, RING)
    positions = [position for position, _ in rail.places(placed @ Pose((x, y, z)), present)]
    # rounding may make two of one, or one of two, where places meet
    for one, others in (
        (positions, rail_candidates(Pose((x, y, z)), present)),
        (rail_candidates(Pose((x, y, z)), present), positions),
    ):
        assert all(min(abs(position - other) for other in others) < 1e-6 for position in one)


@given(COORDINATES, COORDINATES, st.floats(-1.0, 1.0))
def test_places_carry_base_along_axis_nearest_first(x: float, y: float, present: float) -> None:
    base = Pose.from_rpy((0.1, 0.2, 0.3), (0.0, 0.0, 0.4))
    rail = RailMount(base, (0.8, 0.6, 0.0), -1.0, 1.0, RING)
    places = list(rail.places(Pose((x, y, 0.5)), present))
    for position, world_T_base in places:
        assert world_T_base.position == pytest.approx(base.transform((0.8 * position, 0.6 * position, 0.0)))
        assert -1.0 <= position <= 1.0
    distances = [abs(position - present) for position, _ in places]
    assert distances == sorted(distances)


def test_edges_of_comfortable_ring_are_among_places() -> None:
    rail = RailMount(Pose(), (1.0, 0.0, 0.0), -3.0, 3.0, RING)
    tool = Pose((0.313, 0.3, 0.2))
    positions = rail.positions(tool, 0.0)
    for radius in RING:
        assert any(math.hypot(0.313 - each, 0.3) == pytest.approx(radius) and each > 0.313 for each in positions)


def test_vertical_rail_has_places_along_its_range() -> None:
    rail = RailMount(Pose(), (0.0, 0.0, 1.0), 0.0, 0.25, RING)
    assert rail.positions(Pose((1.0, 0.0, 0.0)), 0.1) == pytest.approx((0.1, 1 / 12, 1 / 6, 0.0, 0.25))


@pytest.mark.parametrize(
    ("axis", "lower", "upper", "text"),
    [
        ((0.0, 2.0, 0.0), 0.0, 1.0, "unit vector"),
        ((0.0, 1.0, 0.0), 1.0, 0.0, "rise"),
        ((0.0, 1.0, 0.0), 0.0, math.inf, "finite"),
    ],
)
def test_bad_rail_is_refused(axis: tuple[float, float, float], lower: float, upper: float, text: str) -> None:
    with pytest.raises(UsageError, match=text):
        RailMount(Pose(), axis, lower, upper, RING)
