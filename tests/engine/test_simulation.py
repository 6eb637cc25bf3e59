from fractions import Fraction
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from cellwright.engine.device import Device
from cellwright.util.errors import SimulationError, UnknownNameError, UsageError
from tests.engine.scene import SCENE, Shaker, make_simulation


def test_tick_runs_phases_in_fixed_order() -> None:
    simulation, got = make_simulation(), []

    class Clerk(Device):
        def before_step(self) -> None:
            got.append("before")

        def after_step(self) -> None:
            got.append("after")

        def handle(self, kind: str, arguments: tuple[Any, ...]) -> None:
            got.append(kind)

    clerk = Clerk("clerk")
    simulation.add(clerk)
    simulation.reset()
    simulation.schedule(clerk, "event", at=2_000_000)
    simulation.watch("watch", Fraction(1, 500), lambda _: got.append("watch"))
    simulation.inbox.put(lambda: got.append("inbox"))
    simulation.step()
    assert got == ["inbox", "before", "after", "event", "watch"]


def test_devices_not_stepping_are_not_called() -> None:
    simulation, got = make_simulation(), []

    class Sleepy(Device):
        def after_step(self) -> None:
            got.append(simulation.clock.tick)
            self.set_stepping(False)

    sleepy = Sleepy("sleepy")
    simulation.add(sleepy)
    simulation.reset()
    for _ in range(3):
        simulation.step()
    sleepy.set_stepping(True)
    simulation.step()
    assert got == [1, 4]


def test_events_run_at_first_tick_when_due() -> None:
    simulation = make_simulation(Fraction(1, 240))
    shaker = Shaker()
    simulation.add(shaker)
    simulation.reset()
    simulation.step_until(10**9)
    due = 0
    for time, _ in shaker.log:
        due += 50_000_000
        assert 0 <= time - due < 4_166_668
        due = time
    assert simulation.now == 10**9


def test_duplicate_and_unknown_device_names_are_refused() -> None:
    simulation = make_simulation()
    simulation.add(Device("belt"))
    with pytest.raises(UsageError, match="two devices have the name 'belt'"):
        simulation.add(Device("belt"))
    with pytest.raises(UnknownNameError, match="did you mean belt"):
        simulation.device("bel")
    with pytest.raises(UsageError, match="not been added"):
        _ = Device("lost").simulation
    with pytest.raises(UsageError, match="does not know the event"):
        simulation.device("belt").handle("dance", ())


def test_added_device_does_not_change_streams_of_others() -> None:
    first, second = make_simulation(seed=5), make_simulation(seed=5)
    second.add(Device("another"))
    for simulation in (first, second):
        simulation.add(Shaker())
        simulation.reset()
        simulation.step_until(10**9)
    assert np.array_equal(first.data.qpos, second.data.qpos)


def test_same_seed_and_reset_give_same_run() -> None:
    hashes = []
    for seed in (1, 1, 2):
        simulation = make_simulation(seed=seed)
        simulation.add(Shaker())
        for _ in range(2):
            simulation.reset()
            simulation.step_until(10**9)
            hashes.append(simulation.state_hash())
    assert hashes[0] == hashes[1] == hashes[2] == hashes[3]
    assert hashes[4] == hashes[5] != hashes[0]


def test_state_hash_covers_device_state_and_additions() -> None:
    simulation = make_simulation()
    shaker = Shaker()
    simulation.add(shaker)
    simulation.reset()
    before = simulation.state_hash()
    assert before == simulation.state_hash()
    assert before != simulation.state_hash({"score": 1})
    shaker.pushes += 1
    assert before != simulation.state_hash()


def test_watch_does_not_change_state() -> None:
    hashes = []
    for watched in (False, True):
        simulation = make_simulation()
        simulation.add(Shaker())
        simulation.reset()
        if watched:
            direction = np.array([0.0, 0.0, -1.0])

            def look(_: int) -> None:
                simulation.refresh()  # noqa: B023
                mujoco.mj_ray(
                    simulation.model,  # noqa: B023
                    simulation.data,  # noqa: B023
                    np.array([0.0, 0.0, 1.0]),
                    direction,  # noqa: B023
                    None,
                    1,
                    -1,
                    np.zeros(1, np.int32),
                    None,
                )

            simulation.watch("each", None, look)
            simulation.watch("rate", Fraction(1, 30), look)
        simulation.step_until(2 * 10**9)
        hashes.append(simulation.state_hash())
    assert hashes[0] == hashes[1]


def test_refresh_updates_positions_once_per_tick() -> None:
    simulation = make_simulation()
    simulation.reset()
    body = simulation.model.body("block2").id
    address = simulation.model.jnt_qposadr[simulation.model.body_jntadr[body]]
    for _ in range(20):
        simulation.step()
    assert not np.array_equal(simulation.data.xpos[body], simulation.data.qpos[address : address + 3])
    simulation.refresh()
    assert np.array_equal(simulation.data.xpos[body], simulation.data.qpos[address : address + 3])
    simulation.data.qpos[address] += 0.01
    simulation.touch()
    simulation.refresh()
    assert np.array_equal(simulation.data.xpos[body], simulation.data.qpos[address : address + 3])


def test_unstable_state_ends_run_without_log_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.chdir(tmp_path)
    simulation = make_simulation()
    simulation.reset()
    simulation.data.qvel[0] = np.nan
    with pytest.raises(SimulationError, match="unstable"):
        simulation.step()
    assert "unstable" in caplog.text
    assert list(tmp_path.iterdir()) == []
    simulation.reset()
    simulation.step_until(10**8)


def larger_model() -> mujoco.MjModel:
    """Return the model of the scene with two more blocks, behind the others."""
    spec = mujoco.MjSpec.from_string(SCENE)
    for number in (4, 5):
        block = spec.worldbody.add_body(name=f"block{number}", pos=(0.3 * number, 1.0, 0.05))
        block.add_freejoint()
        block.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=(0.05, 0.05, 0.05))
    return spec.compile()


@pytest.mark.parametrize("tick", [0, 3, 100, 400])
def test_grown_simulation_moves_as_before(tick: int) -> None:
    """Block 2 tumbles at first; later all blocks sleep."""
    simulation, other = make_simulation(), make_simulation()
    for each in (simulation, other):
        each.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
        each.add(Shaker())
        each.reset()
        each.step_until(tick * 2_000_000)
    other.grow(larger_model())
    count = simulation.model.nq
    assert other.data.tree_asleep[-2:].tolist() == [other.model.ntree - 2, other.model.ntree - 1]
    assert other.data.qpos[count:].tolist() == other.model.qpos0[count:].tolist()
    for _ in range(500):
        assert np.array_equal(other.data.qpos[:count], simulation.data.qpos)
        assert np.array_equal(other.data.tree_asleep[:-2] >= 0, simulation.data.tree_asleep >= 0)
        for each in (simulation, other):
            each.step()
    assert other.data.time == simulation.data.time
    assert (other.data.tree_asleep[-2:] >= 0).all()


def test_new_body_of_grown_simulation_falls_asleep_and_wakes() -> None:
    simulation = make_simulation()
    simulation.reset()
    simulation.step()
    simulation.grow(larger_model())
    body = simulation.model.body("block5").id
    address = simulation.model.joint(simulation.model.body_jntadr[body]).qposadr[0]
    simulation.data.qpos[address + 2] = 0.5
    simulation.keep_awake(body)
    simulation.step_until(10**9)
    assert simulation.data.qpos[address + 2] == pytest.approx(0.05, abs=1e-3)
    assert simulation.data.tree_asleep[-1] >= 0


def test_reset_after_growth_uses_first_model_as_it_was() -> None:
    simulation = make_simulation()
    simulation.reset()
    first, begin = simulation.model, simulation.state_hash()
    simulation.model.geom_surfacevel[0] = 1.0
    simulation.model.body_contype[2] = 0
    simulation.grow(larger_model())
    assert simulation.model.geom_surfacevel[0].tolist() == [1.0] * 6
    simulation.reset()
    assert simulation.model is first is simulation.first_model
    assert first.body_contype[2] == 1
    assert simulation.state_hash() == begin


def test_message_time_goes_on_over_reset_that_keeps_clock() -> None:
    simulation = make_simulation()
    simulation.add(Shaker())
    simulation.reset()
    found: list[tuple[int, int]] = []
    simulation.on_restart.append(lambda: found.append((simulation.now, simulation.clock.message_time())))
    simulation.step_until(10**8)
    expected = simulation.state_hash()
    for keeps_clock in (True, True, False):
        simulation.reset(keeps_clock=keeps_clock)
        simulation.step_until(10**8)
        assert simulation.state_hash() == expected
    assert found == [(0, 10**8), (0, 2 * 10**8), (0, 0)]
    assert simulation.clock.message_time() == simulation.now
