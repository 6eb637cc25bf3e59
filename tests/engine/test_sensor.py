"""Common behaviour of sensors, shown on a sensor that reports the position of a gliding part."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

import pytest

from cellwright.engine.sensor import Reading, Sensor
from cellwright.engine.simulation import Simulation
from cellwright.engine.snapshot import restore_snapshot, take_snapshot
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose
from tests.cell.devices.scene import add_part, empty_spec, make_simulation, push

PART = "gear_part_0"
SPEED = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class Place(Reading):
    x: float
    noise: float


class Ruler(Sensor[Place]):
    default_period: ClassVar[Fraction] = Fraction(1, 20)
    measured = 0

    def measure(self, index: int) -> Place:
        self.measured += 1
        x = float(self.simulation.data.body(PART).xpos[0])
        return Place(time_ns=self.simulation.now, sample=index, x=x, noise=float(self.normal(index, 1)[0]))


def glide(*sensors: Ruler, timestep: Fraction = Fraction(1, 500), seed: int = 0) -> Simulation:
    spec = empty_spec()
    add_part(spec, PART, Pose())
    simulation = make_simulation(spec, *sensors, timestep=timestep, seed=seed)
    push(simulation, PART, (SPEED, 0.0, 0.0))
    return simulation


def ruler(**settings: Any) -> Ruler:
    return Ruler("ruler", Pose(), **settings)


TIMESTEPS = [Fraction(1, 500), Fraction(1, 240), Fraction(1, 1000), Fraction(4, 1000), Fraction(1, 60)]


@pytest.mark.parametrize("timestep", TIMESTEPS, ids=str)
@pytest.mark.parametrize("rate", [10, 20, 100])
def test_sensor_keeps_rate_in_simulation_time(timestep: Fraction, rate: int) -> None:
    sensor = ruler(period=Fraction(1, rate))
    simulation = glide(sensor, timestep=timestep)
    got: list[Place] = []
    sensor.listen(got.append)
    simulation.step_until(2 * 10**9)
    if timestep * rate <= 1:
        assert [reading.sample for reading in got] == list(range(1, 2 * rate + 1))
    else:  # at most one sample a tick
        assert len(got) == 2 / timestep
    for reading in got:
        due = reading.sample * 10**9 // rate
        assert 0 <= reading.time_ns - due < float(timestep) * 1e9
        tick = simulation.clock.first_tick_at(reading.time_ns)
        assert simulation.clock.time_of(tick) == reading.time_ns


def test_reading_shows_state_of_its_own_tick() -> None:
    sensor = ruler()
    simulation = glide(sensor)
    got: list[Place] = []
    sensor.listen(got.append)
    simulation.step_until(10**9)
    assert len(got) == 20
    for reading in got:
        assert reading.x == pytest.approx(SPEED * reading.time_ns / 1e9, abs=1e-12)


def test_sensor_without_listener_does_not_measure() -> None:
    sensor = ruler(latency=Fraction(1, 100))
    simulation = glide(sensor)
    simulation.step_until(10**9)
    assert sensor.measured == 0
    leave = sensor.listen(lambda _: None)
    simulation.step_until(2 * 10**9)
    assert sensor.measured == 20
    leave()
    leave()
    simulation.step_until(3 * 10**9)
    assert sensor.measured == 20


def test_listeners_share_one_measurement() -> None:
    sensor = ruler()
    simulation = glide(sensor)
    one: list[Place] = []
    other: list[Place] = []
    sensor.listen(one.append)
    leave = sensor.listen(other.append)
    simulation.step_until(500_000_000)
    leave()
    simulation.step_until(10**9)
    assert sensor.measured == len(one) == 20
    assert other == one[:10]


@pytest.mark.parametrize(("latency", "timestep"), [(0.001, 500), (0.03, 500), (0.05, 240), (0.12, 1000), (0.0333, 240)])
def test_latency_delays_delivery_and_not_measurement(latency: float, timestep: int) -> None:
    sensor = ruler(latency=Fraction(str(latency)))
    simulation = glide(sensor, timestep=Fraction(1, timestep))
    got: list[tuple[int, Place]] = []
    sensor.listen(lambda reading: got.append((simulation.now, reading)))
    simulation.step_until(10**9)
    assert len(got) == 20 - int(latency * 20) - (1 if latency * 20 % 1 else 0)
    for delivered, reading in got:
        due = reading.time_ns + round(latency * 1e9)
        assert delivered == simulation.clock.time_of(simulation.clock.first_tick_at(due))
        assert reading.x == pytest.approx(SPEED * reading.time_ns / 1e9, abs=1e-12)


@pytest.mark.parametrize("latency", [Fraction(0), Fraction(7, 100)])
def test_readings_do_not_depend_on_other_listeners(latency: Fraction) -> None:
    def late_listener(*, with_others: bool) -> list[Place]:
        sensor = ruler(latency=latency)
        simulation = glide(sensor)
        others: Callable[[], None] = sensor.listen(lambda _: None) if with_others else (lambda: None)
        simulation.step_until(326_000_000)
        got: list[Place] = []
        sensor.listen(got.append)
        simulation.step_until(600_000_000)
        others()
        simulation.step_until(10**9)
        return got

    alone = late_listener(with_others=False)
    assert alone == late_listener(with_others=True)
    assert alone[0].sample == 7


def test_noise_depends_on_sample_number() -> None:
    early, late = ruler(), ruler()
    first, second = glide(early), glide(late)
    a: dict[int, float] = {}
    b: dict[int, float] = {}
    early.listen(lambda reading: a.update({reading.sample: reading.noise}))
    first.step_until(10**9)
    second.step_until(480_000_000)
    late.listen(lambda reading: b.update({reading.sample: reading.noise}))
    second.step_until(10**9)
    assert len(set(a.values())) == 20
    assert b == {sample: a[sample] for sample in range(10, 21)}


def test_noise_differs_between_seeds_and_names_and_scales() -> None:
    def noise_of(name: str, seed: int, factor: float) -> float:
        sensor = Ruler(name, Pose(), noise=factor)
        glide(sensor, seed=seed)
        return sensor.read().noise

    one = noise_of("a", 0, 1.0)
    assert noise_of("a", 0, 1.0) == one
    assert len({one, noise_of("b", 0, 1.0), noise_of("a", 1, 1.0)}) == 3
    assert noise_of("a", 0, 2.5) == 2.5 * one
    assert noise_of("a", 0, 0.0) == 0.0


def test_read_equals_reading_of_a_listener() -> None:
    sensor = ruler()
    simulation = glide(sensor)
    assert sensor.read().sample == 0
    got: list[Place] = []
    sensor.listen(got.append)
    simulation.step_until(250_000_000)
    assert sensor.read() == got[-1]
    simulation.step_until(260_000_000)
    assert sensor.read().sample == 5
    assert sensor.read().x > got[-1].x


@pytest.mark.parametrize("latency", [Fraction(0), Fraction(7, 100)])
def test_disabled_sensor_gives_no_readings(latency: Fraction) -> None:
    sensor = ruler(latency=latency)
    simulation = glide(sensor)
    got: list[Place] = []
    sensor.listen(got.append)
    simulation.step_until(500_000_000)
    before = len(got)
    sensor.enabled = False
    simulation.step_until(10**9)
    assert len(got) == before
    with pytest.raises(UsageError, match="'ruler' is switched off"):
        sensor.read()
    sensor.enabled = True
    simulation.step_until(2 * 10**9)
    assert got[before].sample == 21


def test_state_hash_covers_switch_and_not_listeners() -> None:
    sensor = ruler()
    simulation = glide(sensor)
    quiet = simulation.state_hash()
    leave = sensor.listen(lambda _: None)
    assert simulation.state_hash() == quiet
    leave()
    assert simulation.state_hash() == quiet
    sensor.enabled = False
    assert simulation.state_hash() != quiet


def test_reset_restores_the_switch_and_keeps_listeners() -> None:
    sensor = ruler(latency=Fraction(3, 100))
    simulation = glide(sensor)
    simulation.step_until(10**9)
    got: list[Place] = []
    sensor.listen(got.append)
    simulation.step_until(1_060_000_000)
    sensor.enabled = False
    simulation.reset()
    assert sensor.enabled
    simulation.step_until(200_000_000)
    assert [reading.sample for reading in got] == [1, 2, 3]
    assert [reading.time_ns for reading in got] == [50_000_000, 100_000_000, 150_000_000]


def test_sensor_created_disabled_is_disabled_after_reset() -> None:
    sensor = ruler(enabled=False)
    simulation = glide(sensor)
    assert not sensor.enabled
    sensor.enabled = True
    simulation.reset()
    assert not sensor.enabled


def test_restored_run_gives_same_readings() -> None:
    sensor = ruler(latency=Fraction(3, 100))
    simulation = glide(sensor)
    got: list[Place] = []
    sensor.listen(got.append)
    simulation.step_until(500_000_000)
    snapshot = take_snapshot(simulation)
    sensor.enabled = False
    restore_snapshot(simulation, snapshot)
    assert sensor.enabled
    got.clear()
    simulation.step_until(10**9)
    first = got.copy()
    restore_snapshot(simulation, snapshot)
    got.clear()
    simulation.step_until(10**9)
    assert got == first
    assert first[0].sample == 10  # it was on its way at the snapshot
    assert first[-1].sample == 19


def test_listener_may_leave_within_its_callback() -> None:
    sensor = ruler()
    simulation = glide(sensor)
    got: list[Place] = []

    def once(reading: Place) -> None:
        got.append(reading)
        leave()

    leave = sensor.listen(once)
    second: list[Place] = []
    sensor.listen(second.append)
    simulation.step_until(200_000_000)
    assert len(got) == 1
    assert len(second) == 4


def test_close_removes_all_listeners() -> None:
    sensor = ruler()
    simulation = glide(sensor)
    got: list[Place] = []
    leave = sensor.listen(got.append)
    simulation.close()
    simulation.step_until(200_000_000)
    assert not got
    leave()


def test_invalid_sensor_settings_are_refused() -> None:
    for settings in (
        {"period": Fraction(0)},
        {"latency": Fraction(-1, 10)},
        {"noise": -1.0},
        {"noise": float("nan")},
        {"noise": float("inf")},
    ):
        with pytest.raises(UsageError):
            ruler(**settings)
    with pytest.raises(UsageError, match="must be finite"):
        Ruler("ruler", Pose((float("nan"), 0.0, 0.0)))
    with pytest.raises(UsageError, match="not been added"):
        ruler().listen(lambda _: None)


def test_sensor_settings_are_readable() -> None:
    sensor = ruler(period=Fraction(1, 30), latency=Fraction(1, 100))
    assert (sensor.period, sensor.latency, sensor.frame) == (Fraction(1, 30), Fraction(1, 100), "ruler_frame")
    assert ruler().period == Ruler.default_period


def test_sensor_of_unknown_form_is_described_and_not_read_for_viewers() -> None:
    sensor = ruler()
    glide(sensor)
    described = sensor.describe()
    assert (described["name"], described["form"]) == ("ruler", "other")
    assert (described["position"], described["quaternion"]) == ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    assert sensor.overlay() is None
    assert sensor.measured == 0
