"""Gripper in the running cell: when it grips, why it does not, how it holds, how it releases."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from cellwright.cell.model.parts import PART_TYPES, part_type
from cellwright.config.trial.trial import DropRegion
from cellwright.engine.snapshot import restore_snapshot, take_snapshot
from cellwright.util.pose import Pose
from tests.cell.devices.floor import MILLISECOND, MM, Floor, down, named, one_of_each
from tests.support.places import BELT_SURFACE, BIN_SURFACE, TRAY_SURFACE

OVER_BIN = (-0.45, 0.23, 1.15)
TO_NOWHERE = DropRegion("drop", "gear_part", (-1.0, 0.0, 0.9), (0.0, 0.5, 2.0), Pose((-2.5, -2.0, 0.5)))


@pytest.fixture(scope="module")
def precise() -> Floor:
    return Floor(one_of_each(), "precise")


@pytest.fixture(scope="module")
def original() -> Floor:
    return Floor(one_of_each(), "original")


@pytest.fixture
def floor(precise: Floor) -> Iterator[Floor]:
    yield precise.reset()
    set_phase(precise, None)


def set_phase(floor: Floor, phase: int | None) -> None:
    floor.gripper.phase = phase


def top_of(kind: str) -> float:
    return BIN_SURFACE + part_type(kind).top - part_type(kind).bottom


def lift(floor: Floor) -> None:
    floor.swing(floor.reach(down(*OVER_BIN)), 1.0)
    floor.run(1.2)


@pytest.mark.slow
@pytest.mark.parametrize("phase", [None, 0, 30 * MILLISECOND, 99 * MILLISECOND])
@pytest.mark.parametrize("kind", PART_TYPES)
def test_part_under_cup_is_gripped_within_200_ms(floor: Floor, kind: str, phase: int | None) -> None:
    set_phase(floor, phase)
    floor.lay(named(kind), -0.3, 0.23, BIN_SURFACE)
    floor.set_cup(down(-0.3, 0.23, top_of(kind) - 0.5 * MM))
    floor.run(0.3)
    assert not floor.gripper.attached
    floor.gripper.set_enabled(True)
    duration = floor.run_until(lambda: floor.gripper.attached, 0.202)
    assert 0.1 <= duration <= (0.102 if phase is None else 0.202)
    assert floor.gripper.part == named(kind)
    assert floor.gripper.reason == ""


def test_gripper_with_phase_checks_at_its_phase(floor: Floor) -> None:
    set_phase(floor, 30 * MILLISECOND)
    floor.run(0.25)
    floor.grasp("gear_part")
    assert floor.simulation.now == 430 * MILLISECOND


@pytest.mark.parametrize("depth", [0.5, 1.5, 2.5])
def test_mark_that_meets_bevel_is_gripped(floor: Floor, depth: float) -> None:
    floor.lay(named("disk_part"), -0.3, 0.23, BIN_SURFACE)
    floor.set_cup(down(-0.3, 0.23, top_of("disk_part") - depth * MM))
    floor.gripper.set_enabled(True)
    floor.run_until(lambda: floor.gripper.attached, 0.21)


def test_gripper_above_part_without_contact_does_not_attach(floor: Floor) -> None:
    floor.lay(named("gear_part"), -0.3, 0.23, BIN_SURFACE)
    floor.set_cup(down(-0.3, 0.23, top_of("gear_part") + 1.5 * MM))
    floor.gripper.set_enabled(True)
    floor.run(0.5)
    assert (floor.gripper.attached, floor.gripper.reason) == (False, "no contact")


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("degrees", "taken"), [(15.0, True), (17.0, True), (20.0, False), (33.69, False)])
def test_tilted_cup_attaches_up_to_limit(floor: Floor, degrees: float, side: float, taken: bool) -> None:
    tilt = math.radians(degrees) * side
    floor.lay(named("part1"), -0.3, 0.23, BIN_SURFACE)
    lowest = 0.038 * math.sin(abs(tilt))
    floor.set_cup(down(-0.3, 0.23, top_of("part1") + lowest - 0.3 * MM, tilt))
    floor.gripper.set_enabled(True)
    floor.run(0.25)
    assert floor.gripper.attached is taken
    if not taken:
        assert floor.gripper.reason.startswith("tilted: ")
        assert float(floor.gripper.reason.split()[1]) == pytest.approx(degrees, abs=1.5)


def test_gripper_on_bin_does_not_attach(floor: Floor) -> None:
    floor.set_cup(down(-0.3, 0.23, BIN_SURFACE - 0.3 * MM))
    floor.gripper.set_enabled(True)
    floor.run(0.5)
    assert (floor.gripper.attached, floor.gripper.reason) == (False, "contact with something fixed: bin7")


@pytest.mark.parametrize(
    ("x", "y", "surface", "name"),
    [(0.35, 2.9, TRAY_SURFACE, "kit_tray_1_plate"), (1.2, 0.5, BELT_SURFACE, "conveyor_belt")],
)
def test_gripper_on_tray_or_belt_counts_contact_without_attaching(
    floor: Floor, x: float, y: float, surface: float, name: str
) -> None:
    floor.put_arm((y - 0.16 if name == "conveyor_belt" else 2.0, 0.0 if x > 1.0 else 1.5, -0.7, 1.65, 3.7, -1.57, 0.0))
    floor.put_arm(floor.reach(down(x, y, surface - 0.3 * MM)))
    floor.gripper.set_enabled(True)
    floor.run(0.25)
    assert (floor.gripper.attached, floor.gripper.reason) == (False, f"contact with {name}, which is no part")
    assert floor.gripper.counter == 3


def test_reason_before_first_and_second_check_is_waiting(floor: Floor) -> None:
    floor.lay(named("gear_part"), -0.3, 0.23, BIN_SURFACE)
    floor.set_cup(down(-0.3, 0.23, top_of("gear_part") - 0.5 * MM))
    floor.run(0.1)
    assert floor.gripper.reason == "disabled"
    floor.gripper.set_enabled(True)
    assert floor.gripper.reason == "waiting for the first check"
    floor.cell.step()
    assert floor.gripper.reason == "waiting for a second check"


def test_gripper_enabled_again_attaches_at_once(floor: Floor) -> None:
    floor.grasp("gear_part")
    floor.run(0.5)
    floor.gripper.set_enabled(False)
    assert (floor.gripper.attached, floor.gripper.reason, floor.gripper.lost_reason) == (False, "disabled", "released")
    floor.run(0.1)
    floor.gripper.set_enabled(True)
    floor.cell.step()
    assert floor.gripper.attached


def test_listener_receives_every_change(floor: Floor) -> None:
    heard: list[tuple[bool, bool]] = []
    floor.gripper.on_change.append(lambda gripper: heard.append((gripper.enabled, gripper.attached)))
    try:
        floor.grasp("gear_part")
        floor.gripper.set_enabled(True)
        floor.run(0.3)
        floor.gripper.set_enabled(False)
        floor.gripper.set_enabled(False)
    finally:
        floor.gripper.on_change.pop()
    assert heard == [(True, False), (True, True), (False, False)]


@pytest.mark.slow
@pytest.mark.parametrize("kind", PART_TYPES)
def test_held_part_stays_at_cup_in_fast_swing(precise: Floor, original: Floor, kind: str) -> None:
    for floor in (precise.reset(), original.reset()):
        name = floor.grasp(kind)
        lift(floor)
        before = floor.cup().inverse() @ floor.pose(name)
        track, slips = [], []
        for _ in range(2):
            goal = floor.arm.controller.positions(floor.simulation.now)
            floor.swing([goal[0], goal[1] + 1.6, *goal[2:]], 0.7)
            for _ in range(400):
                floor.cell.step()
                world_T_cup = floor.cup()
                track.append(world_T_cup.position)
                now = world_T_cup.inverse() @ floor.pose(name)
                slips.append(math.dist(now.position, before.position))
        places = np.array(track)
        accelerations = np.linalg.norm((places[10:] - 2 * places[5:-5] + places[:-10]) / 0.01**2, axis=1)
        assert accelerations.max() > 13.0
        assert max(slips) < 0.3 * MM
        assert floor.gripper.part == name


def test_arm_sags_more_with_held_part(original: Floor) -> None:
    heights = []
    for kind in ("part2", "nothing"):
        floor = original.reset()
        if kind != "nothing":
            floor.grasp(kind)
        lift(floor)
        floor.run(1.0)
        heights.append(floor.cup().position[2])
    assert 0.3 * MM < heights[1] - heights[0] < 1.5 * MM


@pytest.mark.slow
@pytest.mark.parametrize("kind", PART_TYPES)
@pytest.mark.parametrize("wait", [0.0, 2.0])
def test_released_part_falls_at_once(floor: Floor, kind: str, wait: float) -> None:
    name = floor.grasp(kind)
    lift(floor)
    floor.run(wait)
    height = floor.pose(name).position[2]
    floor.gripper.set_enabled(False)
    floor.run(0.2)
    fallen = height - floor.pose(name).position[2]
    assert fallen == pytest.approx(0.5 * 9.81 * 0.2**2, abs=3 * MM)
    assert floor.gripper.lost_reason == "released"


@pytest.mark.slow
@pytest.mark.parametrize("kind", PART_TYPES)
def test_part_dropped_into_bin_stays_in_it(floor: Floor, kind: str) -> None:
    name = floor.grasp(kind)
    lift(floor)
    floor.swing(floor.reach(down(-0.3, 0.23, 1.15)), 0.6)
    floor.run(1.0)
    floor.gripper.set_enabled(False)
    floor.run(2.0)
    assert floor.asleep(floor.part(name).body)
    x, y, z = floor.pose(name).position
    assert abs(x + 0.3) < 0.3175
    assert abs(y - 0.23) < 0.3175
    assert z == pytest.approx(BIN_SURFACE - part_type(kind).bottom, abs=0.2 * MM)


def test_held_part_that_is_put_away_is_lost(floor: Floor) -> None:
    name = floor.grasp("gear_part")
    changes: list[bool] = []
    floor.gripper.on_change.append(lambda gripper: changes.append(gripper.attached))
    try:
        floor.cell.parts.put_away(floor.part(name))
    finally:
        floor.gripper.on_change.pop()
    assert changes == [False]
    assert (floor.gripper.enabled, floor.gripper.part, floor.gripper.lost_reason) == (True, None, "taken away")
    floor.run(0.15)
    assert floor.pose(name).position[1] < -30.0
    assert floor.gripper.reason == "no contact"


def test_part_in_drop_region_is_lost_once_per_type() -> None:
    floor = Floor(replace(one_of_each(), drop_regions=(TO_NOWHERE,)), "precise")
    name = floor.grasp("gear_part")
    floor.swing(floor.reach(down(*OVER_BIN)), 1.0)
    before = floor.run_until(lambda: not floor.gripper.attached, 1.2)
    assert before < 1.1
    assert floor.gripper.enabled
    assert floor.gripper.lost_reason == "forced drop"
    assert math.dist(floor.pose(name).position, (-2.5, -2.0, 0.5)) < 1 * MM
    floor.run(0.3)
    assert floor.pose(name).position[2] < 0.2
    floor.gripper.set_enabled(False)
    floor.grasp("gear_part")
    lift(floor)
    assert floor.gripper.part == name
    floor.reset()
    assert floor.gripper.lost_reason == ""
    floor.grasp("gear_part")
    floor.swing(floor.reach(down(*OVER_BIN)), 1.0)
    floor.run_until(lambda: not floor.gripper.attached, 1.2)


def test_part_of_other_type_passes_drop_region() -> None:
    floor = Floor(replace(one_of_each(), drop_regions=(TO_NOWHERE,)), "precise")
    name = floor.grasp("disk_part")
    lift(floor)
    assert floor.gripper.part == name


def test_snapshot_with_held_part_resumes_bit_for_bit(floor: Floor) -> None:
    floor.grasp("piston_rod_part")
    floor.swing(floor.reach(down(*OVER_BIN)), 1.0)
    floor.run(0.5)
    snapshot = take_snapshot(floor.simulation)
    hashes = []
    for _ in range(2):
        floor.run(0.8)
        floor.gripper.set_enabled(False)
        floor.run(1.0)
        hashes.append(floor.cell.state_hash())
        restore_snapshot(floor.simulation, snapshot)
        assert floor.gripper.part == named("piston_rod_part")
    assert hashes[0] == hashes[1]


def test_repeated_run_has_same_state_hash(floor: Floor) -> None:
    hashes = []
    for each in (floor, floor, Floor(one_of_each(), "precise")):
        each.reset()
        hashes.append(each.cell.state_hash())
        each.grasp("piston_rod_part")
        lift(each)
        each.gripper.set_enabled(False)
        each.run(1.0)
        hashes.append(each.cell.state_hash())
    assert hashes[:2] == hashes[2:4] == hashes[4:]
    assert hashes[0] != hashes[1]
