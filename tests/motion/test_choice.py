import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.motion import Joints, face, forward, is_usual, solve, tool_down
from cellwright.motion.kinematics import COMFORTABLE, discomfort, distance, rail_candidates
from cellwright.util.errors import UnreachableError
from cellwright.util.pose import Pose
from tests.motion.samples import ABOVE_BIN, INITIAL


@pytest.mark.slow
@given(st.floats(-0.6, 0.0), st.floats(-1.6, 1.3), st.floats(0.73, 1.1), st.floats(-3.1, 3.1))
def test_solve_reaches_every_place_over_near_bins(x: float, y: float, z: float, yaw: float) -> None:
    joints = solve(tool_down(x, y, z, yaw), INITIAL)
    assert math.dist(face(forward(joints)), (x, y, z)) < 1e-9
    assert joints.within_limits()
    assert is_usual(joints)
    assert discomfort(tool_down(x, y, z), joints.rail) < 0.02


def test_solve_keeps_present_posture() -> None:
    assert max(abs(a - b) for a, b in zip(solve(forward(ABOVE_BIN), ABOVE_BIN), ABOVE_BIN, strict=True)) < 1e-9


def test_solve_chooses_turns_nearest_to_present_posture() -> None:
    turned = ABOVE_BIN._replace(wrist_3=ABOVE_BIN.wrist_3 - 2 * math.pi)
    assert turned.within_limits()
    assert solve(forward(ABOVE_BIN), turned).wrist_3 == pytest.approx(turned.wrist_3)
    assert distance(turned, ABOVE_BIN) == pytest.approx(0.3 * 2 * math.pi)


def test_solve_uses_given_rail_positions() -> None:
    assert solve(tool_down(-0.3, 0.2, 0.9), INITIAL, rail=0.35).rail == 0.35
    assert solve(tool_down(-0.3, 0.2, 0.9), INITIAL, rail=(0.9, 0.3, 1.2)).rail == 0.3


def test_solve_accepts_uncomfortable_place_without_alternative() -> None:
    joints = solve(tool_down(0.3, 3.3, 0.8), INITIAL)
    assert joints.rail == 2.1
    assert discomfort(forward(joints), joints.rail) == pytest.approx(1.2 - COMFORTABLE[1])


def test_solve_accept_restricts_postures() -> None:
    pose = tool_down(-0.3, 0.23, 0.9)
    inward = solve(pose, INITIAL, accept=lambda joints: joints.wrist_2 > 0.0)
    assert inward.wrist_2 == pytest.approx(math.pi / 2)
    assert solve(pose, INITIAL).wrist_2 == pytest.approx(-math.pi / 2)
    with pytest.raises(UnreachableError, match="`accept` refuses"):
        solve(pose, INITIAL, accept=lambda joints: False)


def test_solve_gives_unusual_postures_only_on_request() -> None:
    def unusual(joints: Joints) -> bool:
        return not is_usual(joints)

    assert not is_usual(solve(tool_down(-0.3, 0.23, 1.1), INITIAL, usual=False, accept=unusual))
    with pytest.raises(UnreachableError, match="elbow down"):
        solve(Pose.from_rpy((-0.7, 0.1, 2.0), (math.pi, 0.8, math.pi / 2)), INITIAL, rail=0.0)


def test_solve_refuses_unreachable_pose_with_place_and_reason() -> None:
    with pytest.raises(UnreachableError, match=r"x 0\.500, y 3\.400, .*: .*mm out of reach .* rail at 2\.100 m"):
        solve(tool_down(0.5, 3.4, 0.76), INITIAL)
    with pytest.raises(UnreachableError, match="no rail position"):
        solve(tool_down(0.5, 3.0, 0.76), INITIAL, rail=())


@given(st.floats(-2, 2), st.floats(-4, 4), st.floats(-2.1, 2.1))
def test_rail_candidates_are_sorted_by_distance_on_rail(x: float, y: float, present: float) -> None:
    places = rail_candidates(tool_down(x, y, 1.0), present)
    assert places[0] == present
    assert all(abs(place) <= 2.1 for place in places)
    assert list(places) == sorted(places, key=lambda place: abs(place - present))
    assert len(set(places)) == len(places)
