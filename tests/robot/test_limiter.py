"""Target limiter: applied positions stay within limits of position, speed and acceleration."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.robot.limiter import NO_SOURCE, TargetLimiter
from cellwright.robot.safety import Guard, SafetySettings
from cellwright.robot.servos import MAX_POSITION, Array
from cellwright.util.errors import RejectedCommandError

JOINTS = ("turn", "slide", "wheel")
LOWER, UPPER = np.array([-2.0, 0.0, -np.inf]), np.array([2.0, 0.4, np.inf])
SPEEDS = np.array([3.0, 0.5, 10.0])
ALL = np.arange(3)
TICK = 1 / 240

targets = st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=3, max_size=3).map(np.array)


def make_limiter(safety: SafetySettings | None = None, at: tuple[float, ...] = (0.0, 0.1, 0.0)) -> TargetLimiter:
    limiter = TargetLimiter(JOINTS, LOWER, UPPER, SPEEDS, safety or SafetySettings())
    limiter.begin(np.array(at))
    return limiter


def at(*positions: float) -> Array:
    return np.array(positions)


def test_limiter_without_speed_limits_applies_targets_at_once() -> None:
    limiter = make_limiter()
    assert not limiter.advance(TICK), "no target yet"
    limiter.follow(0, ALL, at(1.0, 0.2, 5.0), lambda: at(0, 0, 0))
    assert limiter.advance(TICK)
    assert limiter.applied.tolist() == [1.0, 0.2, 5.0]
    assert not limiter.advance(TICK)


@pytest.mark.slow
@given(st.lists(targets, min_size=1, max_size=8))
def test_applied_targets_stay_within_position_and_speed_limits(requested: list[Array]) -> None:
    limiter = make_limiter(SafetySettings(max_speeds=(("*", 1.0), ("wheel", 100.0))))
    reach = np.array([1.0, 0.5, 10.0]) * TICK  # never faster than the robot itself
    for each in requested:
        limiter.follow(0, ALL, each, lambda: at(0, 0, 0))
        for _ in range(3):
            before = limiter.applied.copy()
            limiter.advance(TICK)
            assert (np.abs(limiter.applied - before) <= reach * (1 + 1e-9) + 1e-12).all()
            assert (limiter.applied >= np.maximum(LOWER, -MAX_POSITION)).all()
            assert (limiter.applied <= np.minimum(UPPER, MAX_POSITION)).all()


@given(targets, st.integers(1, 30))
def test_limiter_arrives_and_rests(requested: Array, count: int) -> None:
    limiter = make_limiter(SafetySettings(max_speeds=(("*", 1e6),)))
    limiter.follow(0, ALL, requested, lambda: at(0, 0, 0))
    limiter.advance(1e6)
    assert (limiter.applied == limiter.desired).all()
    assert not any(limiter.advance(TICK) for _ in range(count))


@given(targets, targets)
def test_hold_discards_earlier_targets(requested: Array, measured: Array) -> None:
    limiter = make_limiter(SafetySettings(max_speeds=(("*", 1.0),)))
    limiter.follow(0, ALL, requested, lambda: measured)
    limiter.advance(TICK)
    limiter.hold(measured)
    within = np.clip(measured, limiter.lower, limiter.upper)
    for _ in range(3):
        limiter.advance(TICK)
        assert (limiter.applied == within).all()
    assert (limiter.source == NO_SOURCE).all()


def test_first_target_after_hold_is_approached_slowly() -> None:
    limiter = make_limiter(SafetySettings(resume_speed=0.5))
    limiter.hold(at(0.0, 0.1, 0.0))
    limiter.follow(0, ALL, at(0.1, 0.1, 0.0), lambda: at(0, 0, 0))
    limiter.advance(TICK)
    assert limiter.applied[0] == pytest.approx(0.5 * TICK)
    for _ in range(60):
        limiter.advance(TICK)
    assert limiter.applied[0] == 0.1
    limiter.follow(0, ALL, at(1.5, 0.1, 0.0), lambda: at(0, 0, 0))
    limiter.advance(TICK)
    assert limiter.applied[0] == 1.5, "full speed after catching up"


def test_slow_joint_resumes_at_its_own_speed() -> None:
    limiter = make_limiter(SafetySettings(resume_speed=2.0))
    limiter.hold(at(0.0, 0.1, 0.0))
    limiter.follow(0, ALL, at(1.0, 0.4, 0.0), lambda: at(0, 0, 0))
    limiter.advance(0.1)
    assert limiter.applied.tolist() == pytest.approx([0.2, 0.15, 0.0])


class TestGuard:
    def test_guard_refuses_far_first_target_whole(self) -> None:
        limiter = make_limiter(SafetySettings(start_guard=0.3))
        with pytest.raises(RejectedCommandError, match="turn would jump by 1 at the start"):
            limiter.follow(0, ALL, at(1.0, 0.2, 0.0), lambda: at(0.0, 0.1, 0.0))
        assert limiter.desired.tolist() == [0.0, 0.1, 0.0]
        limiter.follow(0, ALL, at(0.2, 0.2, 0.0), lambda: at(0.0, 0.1, 0.0))
        limiter.follow(0, ALL, at(1.0, 0.2, 0.0), lambda: at(0.0, 0.1, 0.0))
        assert limiter.desired[0] == 1.0, "only the first target is guarded"

    def test_guard_blend_approaches_far_first_target_slowly(self) -> None:
        limiter = make_limiter(SafetySettings(start_guard=0.3, guard=Guard.BLEND, resume_speed=0.5))
        limiter.follow(0, ALL, at(1.0, 0.2, 0.0), lambda: at(0.0, 0.1, 0.0))
        limiter.advance(0.1)
        assert limiter.applied.tolist() == pytest.approx([0.05, 0.2, 0.0]), "only the jumping joint is slow"

    def test_guard_applies_to_first_target_of_another_source(self) -> None:
        limiter = make_limiter(SafetySettings(start_guard=0.3))
        limiter.follow(0, ALL, at(0.1, 0.1, 0.0), lambda: at(0.0, 0.1, 0.0))
        with pytest.raises(RejectedCommandError):
            limiter.follow(1, ALL, at(1.0, 0.1, 0.0), lambda: at(0.1, 0.1, 0.0))

    def test_guard_and_clutch_ignore_unguarded_targets(self) -> None:
        limiter = make_limiter(SafetySettings(start_guard=0.1, clutch=True))
        limiter.follow(0, ALL, at(1.5, 0.4, 0.0), lambda: at(0.0, 0.1, 0.0), guarded=False)
        assert limiter.desired.tolist() == [1.5, 0.4, 0.0]


class TestClutch:
    @given(targets, targets)
    def test_clutch_first_target_does_not_move_joints(self, first: Array, standing: Array) -> None:
        limiter = make_limiter(SafetySettings(clutch=True))
        limiter.hold(standing)
        before = limiter.applied.copy()
        limiter.follow(0, ALL, first, lambda: standing)
        limiter.advance(TICK)
        largest = np.abs(first) + np.abs(before)
        assert (np.abs(limiter.applied - before) <= 1e-15 * largest + 1e-12).all()

    def test_clutch_follows_differences_of_targets(self) -> None:
        limiter = make_limiter(SafetySettings(clutch=True))
        limiter.follow(0, ALL, at(1.0, 0.0, 0.0), lambda: at(0, 0, 0))
        limiter.follow(0, ALL, at(1.3, 0.1, -2.0), lambda: at(0, 0, 0))
        assert limiter.desired.tolist() == pytest.approx([0.3, 0.2, -2.0])
        limiter.hold(at(0.25, 0.15, -1.0))
        limiter.follow(0, ALL, at(-1.0, 0.3, 7.0), lambda: at(0, 0, 0))
        limiter.follow(0, ALL, at(-1.1, 0.3, 7.0), lambda: at(0, 0, 0))
        assert limiter.desired.tolist() == pytest.approx([0.15, 0.15, -1.0])


def test_limiter_restored_from_json_continues_identically() -> None:
    safety = SafetySettings(max_speeds=(("turn", 0.7),), clutch=True)
    first, second = make_limiter(safety), make_limiter(safety)
    first.hold(at(0.5, 0.1, 0.0))
    first.follow(2, ALL, at(1.0, 0.2, 0.0), lambda: at(0, 0, 0))
    first.follow(2, ALL, at(1.6, 0.3, 0.1), lambda: at(0, 0, 0))
    first.advance(TICK)
    second.set_state(json.loads(json.dumps(first.get_state())))
    for _ in range(5):
        assert first.advance(TICK) == second.advance(TICK)
        assert first.applied.tolist() == second.applied.tolist()
    assert first.get_state() == second.get_state()


ACCELERATIONS = np.array([8.0, 2.0, np.inf])
AT_ONCE = ACCELERATIONS * TICK * TICK


def make_accelerated_limiter(safety: SafetySettings | None = None) -> TargetLimiter:
    limiter = TargetLimiter(JOINTS, LOWER, UPPER, SPEEDS, safety or SafetySettings(), ACCELERATIONS)
    limiter.begin(at(0.0, 0.1, 0.0))
    return limiter


def motions(limiter: TargetLimiter, steps: int) -> Array:
    """Return the motions of all joints in each of some steps (steps, joints) [rad; m]."""
    places = [limiter.applied.copy()]
    for _ in range(steps):
        limiter.advance(TICK)
        places.append(limiter.applied.copy())
    return np.diff(np.array(places), axis=0)


@pytest.mark.slow
@given(st.lists(st.tuples(targets, st.integers(1, 200)), min_size=1, max_size=8))
def test_applied_targets_keep_acceleration_limits(requested: list[tuple[Array, int]]) -> None:
    limiter = make_accelerated_limiter()
    newest = np.zeros(3)
    for each, steps in requested:
        limiter.follow(0, ALL, each, lambda: at(0, 0, 0))
        found = motions(limiter, steps)
        changes = np.abs(np.diff(np.vstack([newest, found]), axis=0))[:, :2]
        assert (changes <= AT_ONCE[:2] * (1 + 1e-6) + 1e-12).all()
        assert (np.abs(found)[:, :2] <= SPEEDS[:2] * TICK * (1 + 1e-9)).all()
        assert (limiter.applied[:2] >= LOWER[:2] - 1e-12).all()
        assert (limiter.applied[:2] <= UPPER[:2] + 1e-12).all()
        newest = found[-1]
    assert limiter.applied[2] == limiter.desired[2], "a joint without limit moves at once"


@pytest.mark.slow
@given(st.floats(-2.0, 2.0), st.floats(0.0, 0.4))
def test_accelerated_target_stops_without_overshoot(turn: float, slide: float) -> None:
    limiter = make_accelerated_limiter()
    limiter.follow(0, ALL, at(turn, slide, 0.0), lambda: at(0, 0, 0))
    started = limiter.applied.copy()
    for _ in range(round(4.0 / TICK)):
        if not limiter.advance(TICK):
            break
        done = (limiter.applied - started) * np.sign(limiter.desired - started)
        assert (done <= np.abs(limiter.desired - started) + 1e-12).all()
    assert limiter.applied.tolist() == limiter.desired.tolist() == [turn, slide, 0.0]
    assert not limiter.advance(TICK), "still moving at the target"


def test_step_takes_minimum_time_of_acceleration_limit() -> None:
    """1 rad with 8 rad/s^2 up and down takes 2 sqrt(1 / 8) s; its speed stays below the joint's 3 rad/s."""
    limiter = make_accelerated_limiter()
    limiter.follow(0, ALL, at(1.0, 0.1, 0.0), lambda: at(0, 0, 0))
    found = motions(limiter, round(2 * np.sqrt(1 / 8) / TICK) + 2)
    assert found[:, 0].sum() == pytest.approx(1.0, abs=1e-9)
    assert found[:, 0].max() / TICK == pytest.approx(np.sqrt(8.0), rel=0.02)
    assert found[-4, 0] > 0.0, "faster than the limit allows"


def test_hold_stops_at_once_and_next_target_starts_at_rest() -> None:
    limiter = make_accelerated_limiter()
    limiter.follow(0, ALL, at(1.0, 0.1, 0.0), lambda: at(0, 0, 0))
    motions(limiter, 40)
    stopped = limiter.applied.copy()
    limiter.hold(stopped)
    assert not motions(limiter, 3).any()
    limiter.release()
    limiter.follow(0, ALL, at(1.0, 0.1, 0.0), lambda: at(0, 0, 0))
    assert motions(limiter, 1)[0, 0] == pytest.approx(AT_ONCE[0])


def test_limiter_with_acceleration_limits_restores_its_state() -> None:
    one, other = make_accelerated_limiter(), make_accelerated_limiter()
    one.follow(0, ALL, at(1.5, 0.3, 1.0), lambda: at(0, 0, 0))
    motions(one, 30)
    other.set_state(json.loads(json.dumps(one.get_state())))
    assert motions(one, 200).tolist() == motions(other, 200).tolist()
    assert "moved" not in make_limiter().get_state(), "state of a limiter without acceleration limits"
