"""Sleep: which bodies fall asleep, what wakes them, the time saved, and the traps."""

import mujoco
import numpy as np
import pytest

from cellwright.cell.model.parts import PART_TYPES
from cellwright.config.trial.trial import BeltPart, Options, Part, Trial
from cellwright.config.ur10 import GRIPPER
from cellwright.util.pose import Pose
from tests.cell.model.arm_poses import PICK, READY
from tests.cell.model.bench import Bench, cell, part_on
from tests.support.places import BELT_SURFACE, BIN_CENTRES, BIN_SURFACE, SPAWN_FRAME

POOL = tuple(BeltPart(float(n), kind, Pose()) for n, kind in enumerate(PART_TYPES))


def pooled(cycles: int = 1) -> Bench:
    return Bench(Trial("pool", belt_parts=POOL, options=Options(belt_population_cycles=cycles)))


def test_parts_at_rest_sleep_within_quarter_second() -> None:
    parts = (
        part_on(kind, *BIN_CENTRES[f"bin{n % 8 + 1}"], BIN_SURFACE + 0.2 * (n // 8), name=kind, above=0.002)
        for n, kind in enumerate(PART_TYPES[:8])
    )
    bench = Bench(cell(*parts))
    bench.run(0.25)
    assert all(bench.asleep(part) for part in bench.world.parts)


def test_arm_does_not_sleep() -> None:
    bench = Bench(cell(has_arm=True))
    bench.run(1.0)
    assert bench.data.tree_asleep[bench.model.body_treeid[bench.model.body(GRIPPER).id]] < 0


def test_arm_wakes_only_parts_that_it_touches() -> None:
    touched = Part("touched", "piston_rod_part", Pose.from_rpy((-0.3, 0.03, BIN_SURFACE), (0, 0, 0.785)))
    bench = Bench(cell(touched, part_on("gear_part", -0.1, 0.4, BIN_SURFACE, name="far"), has_arm=True))
    bench.put_arm(READY)
    bench.run(0.5)
    part, far = bench.part("touched"), bench.part("far")
    assert bench.asleep(part)
    assert bench.asleep(far)
    for name, value in PICK.items():
        bench.command(name, value)
    for _ in range(500):
        mujoco.mj_step(bench.model, bench.data)
        if not bench.asleep(part):
            break
    near = {int(bench.model.geom_bodyid[g]) for c in bench.data.contact for g in (c.geom1, c.geom2)}
    assert not bench.asleep(part)
    assert part.body in near
    assert bench.asleep(far)


def test_falling_part_wakes_part_that_it_hits() -> None:
    lower = part_on("disk_part", 1.21, 0.0, BELT_SURFACE, name="lower")
    upper = part_on("gear_part", 1.21, 0.02, BELT_SURFACE + 0.2, name="upper")
    bench = Bench(cell(lower, upper))
    bench.run(0.15)
    assert bench.asleep(bench.part("lower"))
    bench.run(0.1)
    assert not bench.asleep(bench.part("lower"))
    bench.run(1.0)
    assert bench.asleep(bench.part("lower"))
    assert bench.asleep(bench.part("upper"))


def test_pooled_parts_sleep_above_floor() -> None:
    """The trap: a part parked below an infinite floor is thrown out of it."""
    bench = pooled(3)
    before = np.array([bench.position(part) for part in bench.world.bodies])
    bench.run(1.0)
    after = np.array([bench.position(part) for part in bench.world.bodies])
    assert len(after) == 3 * len(PART_TYPES)
    assert all(bench.asleep(part) for part in bench.world.bodies)
    assert np.abs(after - before).max() < 3e-4
    assert after[:, 2].min() > 0.4


@pytest.mark.slow
def test_placed_part_wakes() -> None:
    bench = pooled()
    bench.run(0.5)
    part = bench.world.bodies[0]
    appears = SPAWN_FRAME @ Pose((0.0, 0.0, 0.1))
    bench.place(part, appears.position, appears.quaternion)
    bench.run(0.02)
    assert not bench.asleep(part)
    assert sum(not bench.asleep(other) for other in bench.world.bodies) == 1
    bench.run(0.5)
    assert bench.asleep(part)
    assert bench.position(part)[2] == pytest.approx(BELT_SURFACE, abs=2e-4)


def test_part_placed_on_its_slot_sleeps_there() -> None:
    bench = pooled()
    part = bench.world.bodies[4]
    bench.place(part, (1.21, 0.0, BELT_SURFACE + 0.1))
    bench.run(0.3)
    bench.place(part, part.shelf.position, part.shelf.quaternion)
    bench.run(0.3)
    assert bench.asleep(part)
    assert bench.position(part) == pytest.approx(part.shelf.position, abs=3e-4)


@pytest.mark.slow
def test_sleep_does_not_change_where_part_lands() -> None:
    """With and without sleep a part lands in the same place, apart from the creep under 1 mm/s that sleep stops."""
    ends = []
    for sleep in (True, False):
        bench = Bench(cell(Part("p", "part3", Pose.from_rpy((1.21, 0.0, 1.2), (0.3, 0.2, 0.0)))), sleep=sleep)
        bench.run(2.0)
        ends.append(bench.position(bench.world.parts[0]))
    assert ends[0] == pytest.approx(ends[1], abs=2e-4)
