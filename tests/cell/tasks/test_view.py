"""View of a cell for the conditions of its task."""

import math

import pytest

from cellwright import Cell
from cellwright.cell.tasks.view import TaskView
from cellwright.config.trial.gear2017 import load_trial
from cellwright.util.pose import Pose
from tests.cell.robot_cells import AT_BIN
from tests.cell.tasks.cells import BASE, go, task_cell

LOW = "low: {from: [1.7, 2.0], to: [1.7, -2.0], width: 0.4, surface: 0.5, speed: 0.2}"
FLOW = "  - {type: disk_part, on: low, every: 10, after: 1, count: 2}\n"
TWO_BELTS = BASE.replace("speed: 0.2}}", f"speed: 0.2}}, {LOW}}}").replace("faulty_parts:", f"{FLOW}faulty_parts:")


def view(cell: Cell) -> TaskView:
    assert cell.task is not None
    return cell.task.view


def test_parts_of_a_type_are_those_in_play() -> None:
    cell = task_cell("{kit: full}")
    assert [part.name for part in view(cell).of_type("gear_part")] == ["bin1|gear_part_1", "bin1|gear_part_2"]
    assert [*view(cell).of_type("disk_part")] == []
    go(cell, 1.5)
    assert [part.name for part in view(cell).of_type("disk_part")] == ["populate_conveyor|disk_part_clone_0"]
    cell.parts.put_away(cell.parts.part("bin1|gear_part_1"))
    assert [part.name for part in view(cell).of_type("gear_part")] == ["bin1|gear_part_2"]


def test_clones_start_on_the_belt_that_brings_them() -> None:
    cell = Cell(load_trial(text=f"{TWO_BELTS}task: {{sentence: Do it., success: {{kit: full}}}}").trial)
    go(cell, 12.0)
    disks = [*view(cell).of_type("disk_part")]
    heights = {part.name.rpartition("_")[2]: view(cell).start_of(part).position[2] for part in disks}
    assert len(heights) == 4
    assert all(abs(heights[part.name.rpartition("_")[2]] - cell.parts.pose(part).position[2]) < 0.01 for part in disks)
    assert max(heights.values()) - min(heights.values()) == pytest.approx(0.4)


def test_moving_part_is_not_at_rest() -> None:
    cell = task_cell("{kit: full}")
    go(cell, 0.5)
    part = cell.parts.part("bin1|gear_part_1")
    assert view(cell).is_resting(part)
    cell.parts.place(part, Pose((0.0, 0.0, 2.0)))
    go(cell, 0.1)
    assert not view(cell).is_resting(part)


def test_lying_parts_are_those_of_the_referee_without_what_is_held() -> None:
    cell = task_cell("{kit: full}")
    part = cell.parts.part("bin1|gear_part_1")
    cell.parts.place(part, cell.trays[1].world_T_tray @ Pose((0.1, 0.0, 0.0)))
    go(cell, 1.1)
    assert view(cell).lying("tray1") == cell.competition.tray_objects(cell.trays[1])
    assert view(cell).lying("tray1")[0].is_faulty
    assert view(cell).lying("tray2") == ()


def test_distance_is_that_of_the_cup_named() -> None:
    cell = task_cell("{kit: full}")
    cell.simulation.refresh()
    x, y, z = cell.simulation.data.body("vacuum_gripper_link").xpos.tolist()
    assert view(cell).tool_distance((x, y, z + 1.0)) == pytest.approx(1.0, abs=0.02)
    assert view(cell).tool_distance((x, y, z), by="other") == math.inf


def test_hand_of_a_robot_is_a_tool() -> None:
    text = AT_BIN.replace("namespace: left}", "namespace: left, hands: {reach: 0.03}}")
    task = "task: {sentence: Reach., success: {held: {part: gear_part, by: tandem/right}}}"
    cell = Cell(load_trial(text=text + task).trial)
    place = view(cell).link("tandem", "right_tip")
    assert view(cell).tool_distance(place, by="tandem/right") == pytest.approx(0.0, abs=1e-9)
    assert view(cell).tool_distance(place, by="tandem/left") > 0.1
