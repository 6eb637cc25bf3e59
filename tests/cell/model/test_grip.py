"""Weld that holds a part to the cup: its compliance, and its release."""

import math
from collections.abc import Callable

import mujoco
import numpy as np
import pytest

from cellwright.cell.model.build import WorldPart
from cellwright.cell.model.parts import PART_TYPES, part_type
from cellwright.config.arm import ArmSettings, ServoProfile
from cellwright.config.trial.trial import CellSettings, Part
from cellwright.config.ur10 import GRIPPER
from cellwright.util.pose import Pose
from tests.cell.model.arm_poses import ABOVE_BIN
from tests.cell.model.bench import MM, Bench, cell, distance

AWAKE = -11  # value of tree_asleep of a tree that was just woken


def holding(kind: str, servo: ServoProfile = "precise") -> tuple[Bench, WorldPart]:
    """Return an arm that has held a part under its cup for half a second."""
    settings = CellSettings(arm=ArmSettings(servo=servo))
    bench = Bench(cell(Part(kind, kind, Pose((0.0, 0.0, 2.0))), has_arm=True, settings=settings))
    bench.put_arm(ABOVE_BIN)
    part = bench.world.parts[0]
    bench.place(part, (30.0, 0.0, 2.0))
    bench.run(0.2)  # the servo takes the load
    world_T_gripper = bench.body_pose(GRIPPER)
    below = world_T_gripper @ Pose((0.0, 0.0, -0.005 - part_type(kind).top))
    bench.place(part, below.position, below.quaternion)
    bench.hold(part, part.grips["arm"], GRIPPER)
    bench.run(0.5)
    return bench, part


def swing(bench: Bench, amplitude: float, rate: float, seconds: float, on_step: Callable[[], None]) -> None:
    """Swing the shoulder back and forth."""
    timestep, start = bench.model.opt.timestep, ABOVE_BIN["shoulder_pan_joint"]
    for k in range(round(seconds / timestep)):
        position = start + amplitude * (1 - math.cos(rate * k * timestep))
        bench.command("shoulder_pan_joint", position, amplitude * rate * math.sin(rate * (k + 1) * timestep))
        mujoco.mj_step(bench.model, bench.data)
        on_step()


@pytest.mark.slow
@pytest.mark.parametrize("servo", ["original", "precise"])
@pytest.mark.parametrize("kind", PART_TYPES)
def test_held_part_slips_less_than_0_3_mm_in_swing(kind: str, servo: ServoProfile) -> None:
    bench, part = holding(kind, servo)
    rest = bench.relative(part, GRIPPER)
    slips: list[float] = []
    path: list[tuple[float, float, float]] = []

    def on_step() -> None:
        slips.append(distance(bench.relative(part, GRIPPER), rest))
        path.append(bench.body_pose(GRIPPER).position)

    swing(bench, 0.35, 7.2, 1.8, on_step)
    accelerations = np.linalg.norm(np.diff(np.array(path), 2, axis=0), axis=1) / bench.model.opt.timestep**2
    assert np.percentile(accelerations, 99) > 13.0
    assert max(slips) < 0.3 * MM


def test_load_on_grip_weld_is_weight_of_part() -> None:
    """A suction limit in newtons is compared with the first three rows of the weld's force."""
    bench, part = holding("pulley_part")
    bench.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)  # the weld alone, no push of the cup
    bench.run(0.5)
    equality = bench.data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
    rows = np.flatnonzero(equality & (bench.data.efc_id == part.grips["arm"]))
    assert len(rows) == 6
    assert np.linalg.norm(bench.data.efc_force[rows[:3]]) == pytest.approx(0.5 * 9.81, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("kind", PART_TYPES)
def test_part_released_in_mid_air_falls(kind: str) -> None:
    """The trap: held by a standing arm it is about to sleep, and would sleep in the air. Its count starts again."""
    bench, part = holding(kind)
    bench.run(1.0)
    start = bench.position(part)[2]
    bench.data.eq_active[part.grips["arm"]] = 0
    bench.data.tree_asleep[bench.tree(part)] = AWAKE
    bench.run(0.2)
    assert start - bench.position(part)[2] == pytest.approx(9.81 * 0.2**2 / 2, rel=0.05)


def test_part_held_by_standing_arm_stays_awake() -> None:
    bench, part = holding("gear_part")
    bench.run(1.0)
    assert not bench.asleep(part)
    assert bench.data.tree_asleep[bench.tree(part)] == -1  # ready to sleep: only the arm keeps it awake
