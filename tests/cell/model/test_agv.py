"""AGVs: their load, their sleep, and pushes against them."""

import mujoco
import numpy as np
import pytest

from cellwright.cell.model.parts import part_type
from cellwright.cell.model.tray import plate_name
from cellwright.config.trial.trial import Part
from cellwright.util.pose import Pose
from tests.cell.model.bench import MM, Bench, cell, distance
from tests.support.places import LAYOUT, TRAY_IDS

TRAY = TRAY_IDS["agv1"]
KIT = {
    "gear_part": (-0.15, -0.25),
    "disk_part": (0.1, -0.25),
    "gasket_part": (-0.1, -0.1),
    "piston_rod_part": (0.15, -0.1),
    "pulley_part": (-0.1, 0.12),
    "part2": (0.15, 0.1),
    "part4": (0.15, 0.2),
}


@pytest.fixture
def bench() -> Bench:
    """Return a bench with a kit at rest and asleep on the tray of AGV 1."""
    parts = (Part(k, k, Pose((x, y, 0.0051 - part_type(k).bottom)), TRAY) for k, (x, y) in KIT.items())
    bench = Bench(cell(*parts))
    bench.run(0.5)
    return bench


def tree_of(bench: Bench, agv: str) -> int:
    return int(bench.model.body_treeid[bench.model.body(agv).id])


def wake(bench: Bench, agv: str) -> None:
    first = int(bench.model.joint(f"{agv}_x").dofadr[0])
    bench.data.qvel[first : first + 2] = -0.0


def drive(bench: Bench, axis: str, way: float, speed: float, acceleration: float) -> float:
    """Drive AGV 1 `way` metres along an axis and stop; return the maximum slip [m] of any part on the way."""
    rest = {part.name: bench.relative(part, TRAY) for part in bench.world.parts}
    timestep, sign = bench.model.opt.timestep, np.sign(way)
    position = velocity = slip = 0.0
    tick = 0
    wake(bench, "agv1")
    while position < abs(way):
        braking = velocity**2 / (2 * acceleration) >= abs(way) - position - velocity * timestep
        faster = velocity + (-1 if braking else 1) * acceleration * timestep
        following = min(speed, max(faster, 0.01))
        bench.command(f"agv1_{axis}", sign * position, sign * following)
        position += (velocity + following) / 2 * timestep
        velocity = following
        mujoco.mj_step(bench.model, bench.data)
        tick += 1
        if tick % 5 == 0:
            slip = max(slip, *(distance(bench.relative(p, TRAY), rest[p.name]) for p in bench.world.parts))
    bench.command(f"agv1_{axis}", way)
    bench.run(0.5)
    return max(slip, *(distance(bench.relative(p, TRAY), rest[p.name]) for p in bench.world.parts))


@pytest.mark.slow
@pytest.mark.parametrize(("axis", "way"), [("x", -3.0), ("y", 2.0)])
@pytest.mark.parametrize("acceleration", [0.5, 2.0])
def test_kit_moves_with_agv_without_sliding(bench: Bench, axis: str, way: float, acceleration: float) -> None:
    before = bench.body_pose(TRAY).position
    assert drive(bench, axis, way, 0.5, acceleration) < 0.1 * MM
    moved = np.subtract(bench.body_pose(TRAY).position, before)
    assert moved == pytest.approx((way, 0, 0) if axis == "x" else (0, way, 0), abs=0.2 * MM)


def test_slides_of_both_agvs_run_along_world_axes() -> None:
    bench = Bench(cell())
    for agv in ("agv1", "agv2"):
        home = bench.body_pose(agv).position
        for axis in "xy":
            bench.command(f"{agv}_{axis}", 0.1)
        wake(bench, agv)
        bench.run(1.5)
        # it falls asleep when slower than 1 mm/s, a tenth of a millimetre before its goal at most
        assert np.subtract(bench.body_pose(agv).position, home) == pytest.approx((0.1, 0.1, 0.0), abs=0.1 * MM)


def test_agv_sleeps_with_its_kit(bench: Bench) -> None:
    """The trap: a tree with actuators would never sleep, nor would anything on it."""
    assert bench.data.tree_asleep[tree_of(bench, "agv1")] >= 0
    assert bench.data.tree_asleep[tree_of(bench, "agv2")] >= 0
    assert all(bench.asleep(part) for part in bench.world.parts)
    drive(bench, "x", -0.5, 0.5, 1.0)
    bench.run(0.5)
    assert bench.data.tree_asleep[tree_of(bench, "agv1")] >= 0
    assert all(bench.asleep(part) for part in bench.world.parts)


def test_sleeping_agv_ignores_setpoint_until_woken(bench: Bench) -> None:
    before = bench.body_pose("agv1").position
    bench.command("agv1_x", -0.2)
    bench.run(0.3)
    assert bench.body_pose("agv1").position == before
    wake(bench, "agv1")
    bench.run(1.0)
    assert bench.body_pose("agv1").position[0] - before[0] == pytest.approx(-0.2, abs=0.1 * MM)


def test_locked_kit_stays_through_jerk(bench: Bench) -> None:
    """Lock welds hold where friction would not: the AGV departs at 0.4 m/s without warning."""
    for part in bench.world.parts:
        bench.hold(part, part.locks[1], TRAY)
    bench.run(0.1)
    rest = {part.name: bench.relative(part, TRAY) for part in bench.world.parts}
    wake(bench, "agv1")
    timestep = bench.model.opt.timestep
    slip = 0.0
    for k in range(500):
        bench.command("agv1_x", -0.4 * k * timestep, -0.4)
        mujoco.mj_step(bench.model, bench.data)
        slip = max(slip, *(distance(bench.relative(p, TRAY), rest[p.name]) for p in bench.world.parts))
    assert slip < 1.0 * MM


def test_push_of_arm_does_not_move_agv() -> None:
    bench = Bench(cell(), sleep=False)
    body = bench.model.body("agv1").id
    bench.data.xfrc_applied[body][0] = 500.0
    before = bench.body_pose("agv1").position[0]
    bench.run(1.0)
    assert abs(bench.body_pose("agv1").position[0] - before) < 0.05 * MM


def test_agvs_and_trays_have_original_masses_and_plates() -> None:
    model = Bench(cell()).model
    for agv in LAYOUT.carriers:
        tray = agv.tray_link
        assert model.body(agv.name).mass[0] == pytest.approx(50.0)
        assert model.body(tray).mass[0] == pytest.approx(1.0)
        plate = model.geom(plate_name(agv))
        assert model.geom_bodyid[plate.id] == model.body(tray).id
        assert plate.size[:2] == pytest.approx((0.25, 0.35))
    assert plate_name(LAYOUT.carrier("agv2")) == "kit_tray_2_plate"
