import pytest

from cellwright.engine.rate_control import RealTimePacer
from cellwright.util.errors import UsageError
from tests.engine.scene import make_simulation


class WallClock:
    """Wall clock that moves during sleep and work."""

    def __init__(self, work: float) -> None:
        self.time = 0.0
        self.work = work
        self.slept = 0.0

    def read(self) -> float:
        self.time += self.work
        return self.time

    def sleep(self, duration: float) -> None:
        self.time += duration
        self.slept += duration


@pytest.mark.parametrize("speed", [0.5, 1.0, 4.0])
def test_pacer_keeps_requested_speed(speed: float) -> None:
    simulation, wall = make_simulation(), WallClock(work=1e-5)
    simulation.reset()
    pacer = RealTimePacer(simulation, speed, clock=wall.read, sleep=wall.sleep)
    while simulation.now < 2 * 10**9:
        pacer.step()
    assert wall.time == pytest.approx(2.0 / speed, rel=0.01)
    assert wall.slept > 0


def test_pacer_does_not_catch_up_after_long_delay() -> None:
    simulation, wall = make_simulation(), WallClock(work=0.0)
    simulation.reset()
    pacer = RealTimePacer(simulation, 1.0, clock=wall.read, sleep=wall.sleep)
    pacer.step()
    wall.time += 10.0
    pacer.step()
    before = wall.slept
    for _ in range(500):
        pacer.step()
    assert wall.slept - before == pytest.approx(1.0, abs=0.01)


def test_pacer_does_not_catch_up_time_before_begin() -> None:
    simulation, wall = make_simulation(), WallClock(work=0.0)
    simulation.reset()
    pacer = RealTimePacer(simulation, 1.0, clock=wall.read, sleep=wall.sleep)
    wall.time += 0.4
    pacer.begin()
    for _ in range(500):
        pacer.step()
    assert wall.slept == pytest.approx(1.0, abs=0.01)
    assert pacer.factor == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan"), float("inf")])
def test_pacer_refuses_speed_not_above_zero(speed: float) -> None:
    with pytest.raises(UsageError, match="speed"):
        RealTimePacer(make_simulation(), speed)


def test_real_time_factor_counts_up_to_newest_tick() -> None:
    simulation, wall = make_simulation(), WallClock(work=0.0)
    simulation.reset()
    pacer = RealTimePacer(simulation, 2.0, clock=wall.read, sleep=wall.sleep)
    assert pacer.factor == 0.0
    for _ in range(50):
        pacer.step()
    wall.time += 10.0  # work after the run does not count
    assert pacer.factor == pytest.approx(2.0)


def test_real_time_factor_is_below_one_on_slow_host() -> None:
    simulation, wall = make_simulation(), WallClock(work=0.004)
    simulation.reset()
    pacer = RealTimePacer(simulation, 1.0, clock=wall.read, sleep=wall.sleep)
    for _ in range(50):
        pacer.step()
    assert pacer.factor == pytest.approx(0.5, rel=0.05)
    assert pacer.max_lateness > 0.0
