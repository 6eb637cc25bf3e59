import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.motion import DEFAULT_LIMITS, MovingPart, Rendezvous, forward, intercept, solve, tool_down, track
from cellwright.util.errors import UnreachableError, UsageError
from cellwright.util.pose import Pose
from tests.motion.samples import ABOVE_BELT

GEAR_T_GRIPPER = tool_down(0.0, 0.0, 0.012)
"""The cup on the top of a gear (height 11.9 mm)."""

VELOCITY = (0.0, -0.2, 0.0)
SEEN = MovingPart(Pose((1.21, 3.5, 0.907)), 10.0, VELOCITY)
WINDOW = (-1.0, 2.5)


def test_moving_part_moves_evenly() -> None:
    assert SEEN.at(10.0) == SEEN.world_T_part
    assert SEEN.at(15.0).position == pytest.approx((1.21, 2.5, 0.907))
    assert SEEN.time_at_y(2.5) == pytest.approx(15.0)
    assert SEEN.at(SEEN.time_at_y(0.7)).position[1] == pytest.approx(0.7)


@settings(max_examples=15)
@given(st.floats(1.0, 1.4), st.floats(1.5, 4.5), st.floats(-3.0, 3.0), st.floats(0.0, 3.0), st.floats(0.05, 0.2))
def test_gripper_stays_on_part_during_dwell(x: float, y: float, yaw: float, late: float, v: float) -> None:
    part = MovingPart(Pose.from_rpy((x, y, 0.907), (0.0, 0.0, yaw)), 10.0, (0.0, -v, 0.0))
    plan = intercept(part, GEAR_T_GRIPPER, ABOVE_BELT, 10.0 + late, window=WINDOW)
    assert plan.departs == 10.0 + late
    assert plan.motion.start == ABOVE_BELT
    assert plan.arrives + 0.3 <= plan.sets_off + 1e-9
    assert WINDOW[0] - 1e-9 <= plan.world_T_grasp.position[1] <= WINDOW[1] + 1e-9
    assert plan.touches == pytest.approx(plan.sets_off + 1.0)
    assert plan.ends == pytest.approx(plan.rises + 1.0)
    assert plan.motion.strain(DEFAULT_LIMITS) < 1.1
    for step in range(21):
        time = plan.touches + (plan.rises - plan.touches) * step / 20
        gripper = forward(plan.motion.at(time - plan.departs).positions)
        assert math.dist(gripper.position, (part.at(time) @ GEAR_T_GRIPPER).position) < 2e-4
    # while descending and rising it is straight above the part
    for time in (plan.touches - 0.25, plan.rises + 0.25):
        gripper = forward(plan.motion.at(time - plan.departs).positions)
        grasp = part.at(time) @ GEAR_T_GRIPPER
        assert math.dist(gripper.position[:2], grasp.position[:2]) < 2e-4
        assert 0.02 < gripper.position[2] - grasp.position[2] < 0.08


def test_arm_waits_above_part_before_descent() -> None:
    plan = intercept(SEEN, GEAR_T_GRIPPER, ABOVE_BELT, 10.0, window=WINDOW)
    for time in (plan.arrives, (plan.arrives + plan.sets_off) / 2, plan.sets_off):
        point = plan.motion.at(time - plan.departs)
        assert max(map(abs, point.velocities)) < 1e-9
        assert forward(point.positions).position[2] == pytest.approx(plan.world_T_grasp.position[2] + 0.1)
    rails = {joints.rail for t, joints in zip(plan.motion.times, plan.motion.positions, strict=True) if t > 4.0}
    assert len(rails) == 1


def test_intercept_takes_earliest_place() -> None:
    early = intercept(SEEN, GEAR_T_GRIPPER, ABOVE_BELT, 10.0, window=WINDOW)
    assert early.world_T_grasp.position[1] == pytest.approx(2.5)
    late = intercept(SEEN, GEAR_T_GRIPPER, ABOVE_BELT, 16.0, window=WINDOW)
    assert late.world_T_grasp.position[1] < 2.0
    assert late.sets_off - late.arrives < 0.3 + 0.1 / 0.2 + 0.5


def test_intercept_keeps_longer_lead() -> None:
    plan = intercept(SEEN, GEAR_T_GRIPPER, ABOVE_BELT, 14.0, window=WINDOW, timing=Rendezvous(lead=2.0))
    assert plan.sets_off - plan.arrives >= 2.0 - 1e-9


def test_impossible_interception_is_refused_with_reason() -> None:
    with pytest.raises(UnreachableError, match="too soon"):
        intercept(SEEN, GEAR_T_GRIPPER, ABOVE_BELT, 60.0, window=WINDOW)
    with pytest.raises(UnreachableError, match="too late"):
        intercept(SEEN, GEAR_T_GRIPPER, ABOVE_BELT._replace(rail=-2.0), 14.0, window=(2.2, 2.5), rail=1.5)
    with pytest.raises(UnreachableError, match="the gripper cannot reach"):
        intercept(SEEN, GEAR_T_GRIPPER, ABOVE_BELT, 10.0, window=(2.4, 2.5), rail=-2.0)
    swift = MovingPart(SEEN.world_T_part, 10.0, (0.0, -3.0, 0.0))
    with pytest.raises(UnreachableError, match=r"limits allow|reach|jump"):
        track(swift, GEAR_T_GRIPPER, ABOVE_BELT, 10.5)


@pytest.mark.parametrize(
    "wrong",
    [
        {"part": MovingPart(Pose(), 0.0, (0.1, 0.0, 0.0))},
        {"now": math.nan},
        {"window": (0.0, math.inf)},
        {"part": MovingPart(Pose((math.nan, 0.0, 0.0)), 0.0, VELOCITY)},
    ],
)
def test_intercept_refuses_invalid_arguments(wrong: dict[str, object]) -> None:
    arguments = {"part": SEEN, "part_T_gripper": GEAR_T_GRIPPER, "near": ABOVE_BELT, "now": 10.0, "window": WINDOW}
    with pytest.raises(UsageError):
        intercept(**{**arguments, **wrong})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "wrong", [{"ramp": 0.0}, {"descent": -1.0}, {"dwell": math.inf}, {"hover": -0.1}, {"lead": math.nan}]
)
def test_rendezvous_refuses_invalid_timings(wrong: dict[str, float]) -> None:
    with pytest.raises(UsageError):
        Rendezvous(**wrong)  # type: ignore[arg-type]


def test_track_corrects_second_sighting_during_ramp() -> None:
    sets_off = 15.0
    timing = Rendezvous()
    above = solve(SEEN.at(sets_off + timing.lead_time(0.0)) @ tool_down(0.01, 0.02, 0.112), ABOVE_BELT)
    motion = track(SEEN, GEAR_T_GRIPPER, above, sets_off)
    assert motion.start == above
    time = timing.before + 0.3
    gripper = forward(motion.at(time).positions)
    assert math.dist(gripper.position, (SEEN.at(sets_off + time) @ GEAR_T_GRIPPER).position) < 2e-4


@given(st.floats(0.1, 2.0), st.floats(0.1, 2.0), st.floats(0.1, 2.0), st.floats(0.0, 1.0))
def test_rendezvous_is_symmetric_in_time(ramp: float, descent: float, dwell: float, share: float) -> None:
    timing = Rendezvous(0.1, ramp, descent, dwell)
    since, before_end = share * timing.duration, (1.0 - share) * timing.duration
    assert timing.height(since) == pytest.approx(timing.height(before_end), abs=1e-9)
    assert timing.lead_time(since) == pytest.approx(-timing.lead_time(before_end), abs=1e-9)
    assert timing.height(0.0) == timing.height(ramp) == 0.1
    assert timing.height(timing.before) == pytest.approx(0.0, abs=1e-12)
    assert timing.lead_time(0.0) == pytest.approx(ramp / 2)
    # the speed over ground, belt speed 1, is never backward and never above the belt's
    step = 1e-4
    speed = 1.0 + (timing.lead_time(since + step) - timing.lead_time(since)) / step
    assert -1e-3 <= speed <= 1.0 + 1e-3
