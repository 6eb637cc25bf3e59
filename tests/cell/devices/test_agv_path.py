from fractions import Fraction
from math import dist, hypot

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.devices.agv import agv_path
from cellwright.config.layout.layout import KeyFrames
from cellwright.mechanism.joint_trajectory import Segment, Trajectory
from tests.support.places import AGVS

MILLISECOND = 1_000_000
OUT, BACK = AGVS[1].out, AGVS[1].back
PATHS = [(OUT, agv_path(OUT), 0.08), (BACK, agv_path(BACK), 0.2)]
times = st.integers(-MILLISECOND, 10_100 * MILLISECOND)


def times_of(frames: KeyFrames) -> list[int]:
    return [round(Fraction(time) * 1_000_000_000 / Fraction("1.2")) for time, _, _ in frames]


def original_position(frames: KeyFrames, time: int) -> tuple[float, float]:
    """Return the position on the original's spline: tangents by key frame number, interpolated within each interval."""
    key_times, points = times_of(frames), [(x, y) for _, x, y in frames]
    i = max(k for k in range(len(frames) - 1) if key_times[k] <= time)
    u = (time - key_times[i]) / (key_times[i + 1] - key_times[i])
    last = len(points) - 1

    def coordinate(axis: int) -> float:
        def tangent(k: int) -> float:
            return 0.5 * (points[min(k + 1, last)][axis] - points[max(k - 1, 0)][axis])

        h = (2 * u**3 - 3 * u**2 + 1, u**3 - 2 * u**2 + u, -2 * u**3 + 3 * u**2, u**3 - u**2)
        return h[0] * points[i][axis] + h[1] * tangent(i) + h[2] * points[i + 1][axis] + h[3] * tangent(i + 1)

    return coordinate(0), coordinate(1)


@pytest.mark.parametrize(("frames", "route", "tolerance"), PATHS)
def test_path_passes_key_frames_on_time(frames: KeyFrames, route: Trajectory, tolerance: float) -> None:
    for time, (_, x, y) in zip(times_of(frames), frames, strict=True):
        assert route.positions(time) == [x, y]


@pytest.mark.parametrize(("frames", "route", "tolerance"), PATHS)
def test_path_between_key_frames_stays_close_to_original(
    frames: KeyFrames, route: Trajectory, tolerance: float
) -> None:
    differences = [
        dist(route.positions(time), original_position(frames, time)) for time in range(0, route.end, 20 * MILLISECOND)
    ]
    assert tolerance / 2 < max(differences) < tolerance


def test_paths_have_original_durations_and_join_up() -> None:
    out, back = agv_path(OUT), agv_path(BACK)
    assert out.end == 8_333_333_333
    assert back.end == 10_000_000_000
    assert out.positions(out.end) == back.positions(0) == [-4.2, 8.3]
    assert back.positions(back.end) == out.positions(0) == [0.3, 3.3]


@given(times, st.sampled_from(PATHS))
def test_velocity_is_derivative_of_position_without_jumps(time: int, case: tuple[KeyFrames, Trajectory, float]) -> None:
    _, route, _ = case
    step = MILLISECOND // 10
    before, after = route.positions(time - step), route.positions(time + step)
    slope = [(b - a) / (2 * step * 1e-9) for a, b in zip(before, after, strict=True)]
    assert dist(slope, route.velocities(time)) < 2e-4
    assert dist(route.velocities(time - step), route.velocities(time + step)) < 2.6 * 2e-4


@given(times, st.sampled_from(["out", "back"]))
def test_path_of_agv_2_mirrors_agv_1(time: int, way: str) -> None:
    one, two = (agv_path(getattr(AGVS[number], way)) for number in (1, 2))
    x, y = one.positions(time)
    assert two.positions(time) == [x, -y]


def ends(segment: Segment) -> tuple[float, float]:
    """Return the accelerations at start and end of a cubic, in between which it is linear in time."""
    _, _, square, cube, _, _ = segment.coefficients
    return 2.0 * square, 2.0 * square + 6.0 * cube * (segment.end - segment.start) * 1e-9


@pytest.mark.parametrize(("route", "peak"), [(agv_path(OUT), 2.541), (agv_path(AGVS[2].back), 1.637)])
def test_peak_acceleration_is_as_computed(route: Trajectory, peak: float) -> None:
    sampled = max(hypot(*route.accelerations(time)) for time in range(0, route.end, MILLISECOND))
    exact = max(hypot(ends(x)[end], ends(y)[end]) for x, y in zip(*route.joints, strict=True) for end in (0, 1))
    assert exact == pytest.approx(peak, abs=1e-3)
    assert sampled == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize("time", [-5, 0])
def test_agv_stands_still_before_and_after_path(time: int) -> None:
    route = agv_path(AGVS[2].out)
    assert route.positions(time) == [0.3, -3.3]
    assert route.velocities(time) == [0.0, 0.0]
    assert route.positions(route.end - time) == [-4.2, -8.3]
    assert route.velocities(route.end - time) == [0.0, 0.0]
