"""Belt: parts ride at its speed, start and stop with it."""

import mujoco
import numpy as np
import pytest

from cellwright.cell.model.parts import PART_TYPES
from tests.cell.model.bench import MM, Bench, cell, part_on
from tests.support.places import BELT_SURFACE

SPEED = 0.2


@pytest.fixture
def bench() -> Bench:
    """One part of each type at rest and asleep on the belt."""
    parts = (part_on(k, 1.21, 3.0 + 0.6 * n, BELT_SURFACE, name=k) for n, k in enumerate(PART_TYPES))
    bench = Bench(cell(*parts))
    bench.run(0.5)
    assert all(bench.asleep(part) for part in bench.world.parts)
    return bench


def start(bench: Bench, speed: float = SPEED) -> None:
    bench.set_belt(speed)
    for part in bench.world.parts:
        bench.wake(part)


def poses(bench: Bench) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    return np.array([bench.pose(part) for part in bench.world.parts])


def settling_time(bench: Bench, goal: float) -> float:
    """Return the time [s] until every part keeps to the speed `goal` along -y within 1 % of the belt's."""
    late = 0
    for tick in range(100):
        mujoco.mj_step(bench.model, bench.data)
        speeds = np.array([-bench.velocity(part)[1] for part in bench.world.parts])
        if np.abs(speeds - goal).max() > 0.01 * SPEED:
            late = tick + 1
    return (late + 1) * float(bench.model.opt.timestep)


@pytest.mark.slow
def test_parts_move_at_belt_speed_without_drift(bench: Bench) -> None:
    start(bench)
    bench.run(0.2)
    before = poses(bench)
    bench.run(10.0)
    moved = poses(bench) - before
    assert moved[:, 1] == pytest.approx(-SPEED * 10.0, rel=1e-4)
    assert np.abs(moved[:, 0]).max() < 0.01 * MM  # nothing strays
    assert np.abs(moved[:, 2]).max() < 0.01 * MM
    assert np.abs(moved[:, 3:]).max() < 1e-4  # nothing turns


def test_half_belt_speed_moves_parts_at_half_speed(bench: Bench) -> None:
    start(bench, SPEED / 2)
    bench.run(0.2)
    before = poses(bench)
    bench.run(2.0)
    assert (poses(bench) - before)[:, 1] == pytest.approx(-SPEED, rel=1e-4)


def test_parts_start_and_stop_with_belt(bench: Bench) -> None:
    start(bench)
    assert settling_time(bench, SPEED) <= 0.05
    before = poses(bench)[:, 1]
    bench.set_belt(0.0)
    assert settling_time(bench, 0.0) <= 0.05
    assert np.abs(poses(bench)[:, 1] - before).max() < 2.5 * MM


def test_starting_belt_wakes_no_part(bench: Bench) -> None:
    """The trap: the engine does not detect a change of the surface velocity."""
    before = poses(bench)
    bench.set_belt(SPEED)
    bench.run(0.3)
    assert all(bench.asleep(part) for part in bench.world.parts)
    assert (poses(bench) == before).all()


def test_velocity_of_minus_zero_wakes_parts_only(bench: Bench) -> None:
    before = poses(bench)
    start(bench)
    assert (poses(bench) == before).all()
    mujoco.mj_step(bench.model, bench.data)
    assert not any(bench.asleep(part) for part in bench.world.parts)


def test_model_has_surface_velocity_flag() -> None:
    """The belt stands still in the specification; without the flag the engine would ignore later changes."""
    assert bool(Bench(cell()).model.flg_surfacevel)
