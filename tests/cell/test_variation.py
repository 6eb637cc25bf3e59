"""Variation: within its bounds, the same everywhere, without overlaps, and with a valid cell."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace
from itertools import combinations, pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.cell.cell import Cell
from cellwright.cell.devices.vacuum_gripper import VacuumGripper
from cellwright.cell.variation import CLEARANCE, Bounds, vary, vary_parts
from cellwright.config.footprints import footprint
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import BeltPart, Circumstances, Part, Trial
from cellwright.util.errors import UnknownNameError, UsageError
from cellwright.util.pose import Pose
from tests.support.cells import ROD_IN_REACH, WHOLE, is_sound, run, start
from tests.support.places import BIN_CENTRES, LAYOUT
from tests.support.waiting import TIMEOUT

SEEDS = st.integers(0, 2**63 - 1)
LESSON = load_trial([find_trial("lesson")]).trial


def grid(kind: str, number: int, spacing: float, *, where: str = "bin6", yaw: float = 0.0) -> tuple[Part, ...]:
    """Return number x number parts around the middle of a bin."""
    cx, cy = BIN_CENTRES[where]
    steps = [spacing * (n - (number - 1) / 2) for n in range(number)]
    places = [(cx + dx, cy + dy) for dx in steps for dy in steps]
    return tuple(
        Part(f"{where}|{kind}_{n}", kind, Pose.from_rpy((x, y, 0.725), (0.0, 0.0, yaw)))
        for n, (x, y) in enumerate(places, start=1)
    )


def turned(before: Part, after: Part) -> float:
    return math.remainder(after.pose.rpy[2] - before.pose.rpy[2], 2 * math.pi)


def min_gap(parts: tuple[Part, ...]) -> float:
    covered = [footprint(part.type, part.pose) for part in parts]
    return min(a.gap(b, 0.01) for a, b in combinations(covered, 2))


@pytest.mark.slow
@given(SEEDS)
@settings(max_examples=25)
def test_variation_stays_within_bounds(seed: int) -> None:
    varied = vary(LESSON, seed)
    for before, after in zip(LESSON.bin_parts, varied.bin_parts, strict=True):
        assert (after.name, after.type, after.frame) == (before.name, before.type, before.frame)
        dx, dy, dz = (b - a for a, b in zip(before.pose.position, after.pose.position, strict=True))
        assert abs(dx) <= Bounds().shift + 1e-9 >= abs(dy)
        assert dz == 0.0
        assert abs(turned(before, after)) <= Bounds().turn + 1e-9
    found = varied.circumstances
    assert Bounds().min_friction <= found.friction <= Bounds().max_friction
    assert 0.0 <= found.belt_delay <= 6.0  # a gear comes every six seconds
    assert found.gripper_phase is not None
    assert 0.0 <= found.gripper_phase <= 0.1
    assert found.seed == seed
    assert replace(varied, bin_parts=LESSON.bin_parts, circumstances=Circumstances()) == LESSON


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "number", "spacing", "yaw"),
    [
        ("gear_part", 5, 0.08, 0.0),
        ("gear_part", 5, 0.1, 0.3),
        ("disk_part", 4, 0.126, 0.0),
        ("piston_rod_part", 3, 0.17, math.pi / 4),
        ("gasket_part", 3, 0.19, 0.2),
        ("pulley_part", 2, 0.23, 0.0),
    ],
)
def test_varied_parts_of_dense_grid_do_not_overlap(kind: str, number: int, spacing: float, yaw: float) -> None:
    parts = grid(kind, number, spacing, yaw=yaw)
    for seed in range(8):
        varied = vary_parts(parts, LAYOUT, seed)
        assert min_gap(varied) >= min(CLEARANCE, min_gap(parts)) - 1e-12
        assert sum(a != b for a, b in zip(parts, varied, strict=True)) >= len(parts) / 2


def test_part_without_room_stays_in_place() -> None:
    tight = grid("gear_part", 3, 2 * 0.0392)
    order = (tight[4], *tight[:4], *tight[5:])  # the one in the middle first: its neighbours have not been moved yet
    for seed in range(8):
        varied = vary_parts(order, LAYOUT, seed)
        assert varied[0] == tight[4]
        assert min_gap(varied) >= min_gap(tight) - 1e-12


def test_varied_overlapping_parts_come_no_nearer() -> None:
    pile = grid("pulley_part", 2, 0.2)
    for seed in range(8):
        for before, after in zip(combinations(pile, 2), combinations(vary_parts(pile, LAYOUT, seed), 2), strict=True):
            assert min_gap(after) >= min(CLEARANCE, min_gap(before)) - 1e-12


def test_varied_parts_stay_on_floor_of_bin() -> None:
    cx, cy = BIN_CENTRES["bin6"]
    corner = Part("bin6|gear_part_1", "gear_part", Pose((cx + 0.26, cy + 0.26, 0.725)))
    for seed in range(20):
        (varied,) = vary_parts([corner], LAYOUT, seed)
        x, y, _ = varied.pose.position
        assert max(x - cx, y - cy) + 0.0392 <= 0.3


def test_variation_moves_only_parts_in_bins() -> None:
    elsewhere = (
        Part("floor|gear_part_1", "gear_part", Pose((3.0, 0.0, 0.0))),
        Part("tray|gear_part_2", "gear_part", Pose(), "agv1::kit_tray_1::kit_tray_1::tray"),
        Part("bin6|other_1", "a user-defined type", Pose((-0.3, -0.535, 0.725))),
    )
    assert vary_parts(elsewhere, LAYOUT, 1) == elsewhere
    in_frame = Part("bin8|gear_part_1", "gear_part", Pose((0.1, 0.05, 0.725)), "bin8::link")
    (varied,) = vary_parts([in_frame], LAYOUT, 1)
    assert varied.frame == "bin8::link"
    assert 0.0 < math.dist(varied.pose.position, in_frame.pose.position) < 0.009


def test_variation_of_part_is_independent_of_other_parts() -> None:
    parts = grid("gear_part", 3, 0.15)
    alone = [vary_parts([part], LAYOUT, 7)[0] for part in parts]
    assert list(vary_parts(parts, LAYOUT, 7)) == alone
    shifts = {part.pose.position for part in vary_parts(parts, LAYOUT, 8)} | {part.pose.position for part in alone}
    assert len(shifts) == 18


def test_variation_is_same_in_any_process() -> None:
    program = (
        "from cellwright.config.trial.catalogue import find_trial\n"
        "from cellwright.config.trial.gear2017 import load_trial\n"
        "from cellwright.cell.variation import vary\n"
        "print(vary(load_trial([find_trial('lesson')]).trial, 12))"
    )
    process = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=TIMEOUT
    )
    assert process.stdout.strip() == str(vary(LESSON, 12))


def test_zero_bounds_give_no_variation() -> None:
    still = Bounds(shift=0.0, turn=0.0, min_friction=1.0, belt_delay=0.0, gripper_phase=0.0)
    varied = vary(LESSON, 3, still)
    assert varied.circumstances == Circumstances(gripper_phase=0.0, seed=3)
    for before, after in zip(LESSON.bin_parts, varied.bin_parts, strict=True):
        assert after.pose.position == before.pose.position
        assert after.pose.quaternion == pytest.approx(before.pose.quaternion)


@pytest.mark.parametrize(
    "bounds",
    [
        {"shift": -0.001},
        {"shift": math.nan},
        {"turn": 4.0},
        {"min_friction": 0.0},
        {"min_friction": 1.1},
        {"max_friction": math.inf},
        {"belt_delay": -1.0},
        {"gripper_phase": 1.5},
    ],
)
def test_invalid_bounds_are_refused(bounds: dict[str, float]) -> None:
    with pytest.raises(UsageError, match=f"{next(iter(bounds))} of a variation must be from"):
        Bounds(**bounds)


def test_unknown_frame_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="frame 'nowhere'"):
        vary(Trial("t", extra_parts=(Part("a|gear_part_1", "gear_part", Pose(), "nowhere"),)), 0)


@pytest.mark.parametrize("seed", [0, 1])
def test_varied_parts_come_to_rest_in_their_bins(seed: int) -> None:
    parts = (
        *grid("gear_part", 5, 0.08, where="bin5"),
        *grid("piston_rod_part", 3, 0.17, where="bin6", yaw=math.pi / 4),
        *grid("pulley_part", 2, 0.24, where="bin8"),
    )
    cell = Cell(vary(Trial("bins", bin_parts=parts), seed))
    begin = {part.name: part.start.position for part in cell.world.parts}
    run(cell, 1.0)
    assert is_sound(cell)
    for part in cell.world.parts:
        at = cell.simulation.data.qpos[part.qpos : part.qpos + 3]
        assert math.dist(at[:2], begin[part.name][:2]) < 0.002
        assert at[2] == pytest.approx(0.725, abs=0.002)
        assert abs(cell.simulation.data.qvel[part.dof : part.dof + 6]).max() < 0.01


def test_cell_applies_friction_belt_delay_and_gripper_phase() -> None:
    found = Circumstances(friction=0.7, belt_delay=0.5, gripper_phase=0.034)
    plain, varied = Cell(WHOLE), Cell(replace(WHOLE, circumstances=found))
    assert {float(plain.world.model.geom_friction[g, 0]) for part in plain.world.parts for g in part.geoms} == {1.0}
    assert {float(varied.world.model.geom_friction[g, 0]) for part in varied.world.parts for g in part.geoms} == {0.7}
    assert first_belt_part(varied) - first_belt_part(plain) == pytest.approx(0.5)
    assert isinstance(varied.gripper, VacuumGripper)
    varied.gripper.set_enabled(True)
    looks = [varied.gripper.next_look]
    while len(looks) < 4:
        varied.step()
        if varied.gripper.next_look != looks[-1]:
            looks.append(varied.gripper.next_look)
    assert {look % 100_000_000 for look in looks} == {34_000_000}


def test_belt_delay_applies_to_first_round_only() -> None:
    belt = (BeltPart(0.5, "gear_part", Pose((0.0, 0.0, 0.1))),)
    trial = replace(WHOLE, belt_parts=belt, circumstances=Circumstances(belt_delay=0.2))
    cell = Cell(trial)
    start(cell)
    begun = cell.simulation.time
    times: list[float] = []
    while len(times) < 3:
        before = on_belt(cell)
        cell.step()
        if on_belt(cell) > before:
            times.append(cell.simulation.time - begun)
    assert times[0] == pytest.approx(0.7, abs=0.01)
    assert [b - a for a, b in pairwise(times)] == pytest.approx([0.5, 0.5], abs=0.005)


def test_varied_cell_has_reproducible_state_hash() -> None:
    def state() -> str:
        cell = Cell(vary(WHOLE, 4), seed=4)
        start(cell)
        run(cell, 1.0)
        return cell.state_hash()

    assert state() == state()
    assert vary(WHOLE, 4).bin_parts[0] != ROD_IN_REACH


def on_belt(cell: Cell) -> int:
    return sum(name in cell.parts.in_play for name, _ in cell.world.clones)


def first_belt_part(cell: Cell) -> float:
    start(cell)
    while not on_belt(cell):
        cell.step()
    return cell.simulation.time
