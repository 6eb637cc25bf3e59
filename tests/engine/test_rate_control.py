"""Rate control: the ticks that it allows, and changes from other threads."""

from __future__ import annotations

from threading import Thread

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.engine.rate_control import RateControl, RealTimePacer
from cellwright.util.errors import UsageError
from tests.engine.scene import make_simulation
from tests.engine.test_pacing import WallClock


def test_ticks_pass_until_pause_and_after_resume() -> None:
    rate_control = RateControl()
    assert rate_control.take()
    rate_control.pause()
    assert not rate_control.take()
    rate_control.resume()
    assert rate_control.take()


def test_rate_control_may_start_paused() -> None:
    assert not RateControl(paused=True).take()


@given(st.lists(st.integers(1, 20), min_size=1, max_size=4))
def test_single_steps_pass_requested_number_of_ticks(requested: list[int]) -> None:
    rate_control = RateControl(paused=True)
    for ticks in requested:
        rate_control.step(ticks)
    taken = 0
    while rate_control.take():
        taken += 1
    assert taken == sum(requested)
    assert rate_control.is_paused


def test_step_while_running_pauses_after_one_tick() -> None:
    rate_control = RateControl()
    rate_control.step()
    assert [rate_control.take() for _ in range(3)] == [True, False, False]


def test_pause_discards_remaining_steps() -> None:
    rate_control = RateControl(paused=True)
    rate_control.step(100)
    rate_control.pause()
    assert not rate_control.take()


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan"), float("inf")])
def test_rate_control_refuses_speed_not_above_zero(speed: float) -> None:
    with pytest.raises(UsageError, match="speed"):
        RateControl(speed)
    rate_control = RateControl(2.0)
    with pytest.raises(UsageError, match="speed"):
        rate_control.set_speed(speed)
    assert rate_control.speed == 2.0


def test_step_of_less_than_one_tick_is_refused() -> None:
    with pytest.raises(UsageError, match="ticks must be at least 1"):
        RateControl().step(0)


def test_steps_from_several_threads_are_all_counted() -> None:
    rate_control, taken = RateControl(paused=True), 0

    def request_steps() -> None:
        for _ in range(200):
            rate_control.step()

    threads = [Thread(target=request_steps) for _ in range(4)]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads) or rate_control.ticks_left:
        taken += rate_control.take()
    assert taken == 800


def test_changed_speed_applies_without_catching_up() -> None:
    simulation, wall, rate_control = make_simulation(), WallClock(work=0.0), RateControl(0.1)
    simulation.reset()
    pacer = RealTimePacer(simulation, rate_control, clock=wall.read, sleep=wall.sleep)
    for speed, ticks in ((0.1, 50), (10.0, 500), (1.0, 100)):
        rate_control.set_speed(speed)
        started, since = wall.time, simulation.now
        for _ in range(ticks):
            pacer.step()
        assert wall.time - started == pytest.approx((simulation.now - since) / 1e9 / speed, rel=0.01)


def test_speed_none_never_waits() -> None:
    simulation, wall, rate_control = make_simulation(), WallClock(work=0.0), RateControl(1.0)
    simulation.reset()
    pacer = RealTimePacer(simulation, rate_control, clock=wall.read, sleep=wall.sleep)
    pacer.step()
    rate_control.set_speed(None)
    before = wall.slept
    assert [pacer.step() for _ in range(20)] == 20 * [False]
    assert wall.slept == before
    assert pacer.max_lateness == 0.0


def test_pause_is_not_caught_up_nor_counted() -> None:
    simulation, wall, rate_control = make_simulation(), WallClock(work=0.0), RateControl(1.0)
    simulation.reset()
    pacer = RealTimePacer(simulation, rate_control, clock=wall.read, sleep=wall.sleep)
    for pause in (0.3, 30.0):
        for _ in range(100):
            pacer.step()
        rate_control.pause()
        wall.time += pause
        rate_control.resume()
        assert pacer.step()
    assert pacer.max_lateness == 0.0
    assert pacer.factor == pytest.approx(1.0, rel=0.01)


def test_reset_is_not_counted_as_delay() -> None:
    simulation, wall, rate_control = make_simulation(), WallClock(work=0.0), RateControl(1.0)
    simulation.reset()
    pacer = RealTimePacer(simulation, rate_control, clock=wall.read, sleep=wall.sleep)
    for _ in range(500):
        pacer.step()
    simulation.reset()
    rate_control.restart_pace()
    for _ in range(500):
        pacer.step()
    assert pacer.max_lateness == 0.0
    assert pacer.factor == pytest.approx(1.0, rel=0.01)


def test_long_wait_ends_when_speed_changes() -> None:
    simulation, wall, rate_control = make_simulation(), WallClock(work=0.0), RateControl(0.001)
    simulation.reset()

    def sleep(duration: float) -> None:
        wall.sleep(duration)
        if wall.time > 0.2:
            rate_control.set_speed(1.0)

    RealTimePacer(simulation, rate_control, clock=wall.read, sleep=sleep).step()
    assert 0.2 < wall.time < 0.3
