"""Privileged state of tasks: names and numbers of what each kind of condition is about."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from cellwright import Cell, load_trial
from cellwright.config.trial.gear2017 import load_trial as load_text
from cellwright.config.trial.task import Condition, Discarded, Held, KitBuilt, LinkAt, OnTray, Task, Turned
from cellwright.config.trial.trial import Trial
from cellwright.envs.privileged import PrivilegedState
from cellwright.util.pose import Pose
from tests.cell.arm_cells import TWO_ON_A_RAIL
from tests.cell.robot_cells import tandem_cell

POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")


def bin_trial() -> Trial:
    return load_trial("pick_from_bin")


def state_of(trial: Trial, *success: Condition) -> tuple[PrivilegedState, dict[str, float]]:
    """Return the state of a task with these conditions, and its numbers as a run begins, by name."""
    task = Task("Do it.", success)
    state, cell = PrivilegedState(trial, task), Cell(trial)
    return state, dict(zip(state.names, state.read(cell), strict=True))


def pose_in(numbers: dict[str, float], name: str) -> Pose:
    x, y, z, qw, qx, qy, qz = (numbers[f"{name}.{each}"] for each in POSE)
    return Pose((x, y, z), (qw, qx, qy, qz))


def test_a_part_to_hold_is_relative_to_the_cup() -> None:
    state, numbers = state_of(bin_trial(), Held("gear_part"))
    assert state.names == (
        "holds",
        *(f"tool.{each}" for each in POSE),
        "gear_part.present",
        *(f"gear_part.{e}" for e in POSE),
    )
    cell = Cell(bin_trial())
    cup = pose_in(numbers, "tool")
    poses = [cell.parts.pose(part) for part in cell.parts.all]
    nearest = min(poses, key=lambda pose: math.dist(pose.position, cup.position))
    assert (cup @ pose_in(numbers, "gear_part")).position == pytest.approx(nearest.position)
    assert numbers["holds"] == 0.0
    assert numbers["gear_part.present"] == 1.0
    assert numbers["gear_part.qw"] >= 0.0


def test_the_tool_is_where_the_cup_meets_a_part() -> None:
    _, numbers = state_of(bin_trial(), Held("gear_part"))
    cell = Cell(bin_trial())
    cell.simulation.refresh()
    body = cell.simulation.data.body("vacuum_gripper_link")
    assert np.linalg.norm(np.array(pose_in(numbers, "tool").position) - body.xpos) < 0.02


def test_types_that_are_not_there_have_zeros() -> None:
    _, numbers = state_of(bin_trial(), Turned("pulley_part"))
    assert [numbers[f"pulley_part.{each}"] for each in ("present", *POSE)] == [0.0] * 8


def test_a_kit_wants_as_many_parts_as_it_has_and_tells_its_places() -> None:
    trial = bin_trial()
    state, numbers = state_of(trial, KitBuilt())
    kit = trial.orders[0].kits[0]
    assert sum(name.endswith("present") for name in state.names) == len(kit.objects)
    tray = Cell(trial).trays[1].world_T_tray
    place = pose_in(numbers, "tool") @ pose_in(numbers, f"{kit.kit_type}/gear_part1")
    assert place.position == pytest.approx((tray @ kit.objects[0].pose).position, abs=1e-6)


def test_several_parts_of_a_type_come_in_the_order_of_their_distance() -> None:
    on_tray = (OnTray("gear_part", "tray1", (0.1, 0.0)), OnTray("gear_part", "tray1", (-0.1, 0.0)))
    _, numbers = state_of(bin_trial(), *on_tray)
    near = [math.hypot(*pose_in(numbers, f"gear_part{number}").position) for number in (1, 2)]
    assert all(a <= b for a, b in pairwise(near))
    assert near[0] > 0.1


def test_faulty_parts_have_a_slot_of_their_own() -> None:
    trial = bin_trial()
    faulty = replace(trial, faulty_parts=frozenset({trial.bin_parts[1].name.partition("|")[2]}))
    _, numbers = state_of(faulty, Discarded("tray1"))
    place = pose_in(numbers, "tool") @ pose_in(numbers, "faulty")
    cell = Cell(faulty)
    assert place.position == pytest.approx(cell.parts.pose(cell.parts.part(trial.bin_parts[1].name)).position)
    assert "tray1.x" in numbers


def test_links_of_robots_tell_the_way_to_their_goals() -> None:
    trial = tandem_cell()
    robot = trial.layout.robots[0]
    link = [*trial.robot_models[robot.name].robot.links][-1]
    state, numbers = state_of(trial, LinkAt(robot.name, link, (0.5, 0.0, 1.0)))
    cell = Cell(trial)
    cell.simulation.refresh()
    there = [numbers[f"{robot.name}/{link}.to_{axis}"] for axis in "xyz"]
    here = cell.simulation.data.body(f"{robot.name}/{link}").xpos
    assert np.add(here, there) == pytest.approx([0.5, 0.0, 1.0])
    assert state.names[-3:] == tuple(f"{robot.name}/{link}.to_{axis}" for axis in "xyz")


def test_belts_tell_their_speed_and_several_arms_their_names() -> None:
    trial = load_trial("lesson")
    state, numbers = state_of(trial, Held("gear_part"))
    cell = Cell(trial)
    belt = trial.layout.belts[0].name
    assert numbers[f"{belt}.speed"] == 0.0
    cell.conveyors[belt].set_power(50.0)
    assert state.read(cell)[-1] == pytest.approx(trial.layout.belts[0].speed / 2)
    two, _ = state_of(load_text(text=TWO_ON_A_RAIL).trial, Held("gear_part"))
    assert [name for name in two.names if name.endswith("holds")] == ["arm1:holds", "arm2:holds"]
