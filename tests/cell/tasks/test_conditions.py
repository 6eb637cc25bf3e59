"""Conditions of tasks: whether they hold, and how near they are."""

import math

import pytest

from cellwright import Cell
from cellwright.cell.tasks.conditions import CARRIED, REACHED, near
from cellwright.util.pose import Pose
from tests.cell.robot_cells import AT_BIN, tandem_cell
from tests.cell.tasks.cells import go, task_cell

GEAR, OTHER_GEAR, PULLEY = "bin1|gear_part_1", "bin1|gear_part_2", "bin1|pulley_part_1"


def holding(success: str) -> Cell:
    return task_cell(success, "  start: {holding: gear_part}\n")


def put(cell: Cell, name: str, tray: int, place: Pose) -> None:
    cell.parts.place(cell.parts.part(name), cell.trays[tray].world_T_tray @ place)


def judged(cell: Cell) -> tuple[bool, float]:
    """Return success and potential of a cell's task now."""
    assert cell.task is not None
    return cell.task.success, cell.task.potential()


def test_near_falls_from_one_to_nothing() -> None:
    assert near(0.0) == near(-1.0) == 1.0
    assert near(0.1) > near(0.2) > near(1.0) > 0.0


def test_held_part_counts_from_the_height_at_the_start() -> None:
    cell = holding("{held: {part: gear_part}}")
    part = cell.parts.part(GEAR)
    rise = cell.parts.pose(part).position[2] - part.start.position[2]
    assert judged(cell) == (True, 1.0)
    assert judged(holding(f"{{held: {{part: gear_part, lifted: {rise - 1e-6}}}}}"))[0]
    done, share = judged(holding(f"{{held: {{part: gear_part, lifted: {2 * rise}}}}}"))
    assert not done
    assert share == pytest.approx(0.75)


def test_part_that_nothing_holds_is_not_held() -> None:
    cell = task_cell("{held: {part: gear_part, lifted: 0.1}}")
    done, before = judged(cell)
    cell.parts.place(cell.parts.part(GEAR), Pose((0.0, 0.0, 3.0)))
    assert not done
    assert not judged(cell)[0]
    assert 0.0 < before < 0.5


def test_held_asks_for_the_type() -> None:
    done, share = judged(holding("{held: {part: pulley_part}}"))
    assert not done
    assert share < 0.5


def test_belt_part_is_lifted_from_the_belt() -> None:
    cell = task_cell("{held: {part: disk_part, lifted: 0.1}}")
    go(cell, 2.0)
    disk = next(part for part in cell.parts.all if part.type == "disk_part" and part.name in cell.parts.in_play)
    assert cell.task is not None
    start = cell.task.view.start_of(disk)
    assert start.position[2] == pytest.approx(cell.parts.pose(disk).position[2], abs=0.01)


def test_part_lies_on_the_tray_within_tolerances() -> None:
    at = "{on_tray: {part: gear_part, tray: tray1, at: [0.1, 0.1], yaw: 1.0, tolerance: 0.02, turn_tolerance: 0.1}}"

    def placed(x: float, yaw: float, name: str = GEAR, tray: int = 1) -> bool:
        cell = task_cell(at)
        put(cell, name, tray, Pose.from_rpy((x, 0.1, 0.001), (0.0, 0.0, yaw)))
        go(cell, 0.5)
        return judged(cell)[0]

    assert placed(0.115, 1.05)
    assert placed(0.085, 1.0 - 2 * math.pi)
    assert not placed(0.125, 1.0)
    assert not placed(0.1, 1.2)
    assert not placed(0.1, 1.0, name=PULLEY)
    assert not placed(0.1, 1.0, tray=2)


def test_falling_part_does_not_lie_on_the_tray() -> None:
    cell = task_cell("{on_tray: {part: gear_part, tray: tray1}}")
    put(cell, GEAR, 1, Pose((0.0, 0.0, 0.05)))
    go(cell, 0.05)
    assert not judged(cell)[0]
    go(cell, 1.0)
    assert judged(cell) == (True, 1.0)


def test_carried_part_is_nearer_than_a_lying_one() -> None:
    success = "{on_tray: {part: gear_part, tray: tray1}}"
    lying, carried = judged(task_cell(success))[1], judged(holding(success))[1]
    assert lying <= REACHED <= carried < CARRIED


def test_kit_counts_without_submission() -> None:
    cell = task_cell("{kit: full}")
    go(cell, 0.1)
    assert judged(cell) == (False, 0.0)
    put(cell, OTHER_GEAR, 1, Pose((0.0, 0.0, 0.001)))
    go(cell, 0.5)
    done, share = judged(cell)
    assert not done
    assert share == pytest.approx(2 / 3)  # present, and nothing else: not in its place
    assert cell.competition.score().total == 0.0
    put(cell, OTHER_GEAR, 1, Pose((0.1, 0.1, 0.001)))
    go(cell, 0.5)
    assert judged(cell) == (True, 1.0)


def test_kit_on_another_tray_than_its_own_counts_for_nothing() -> None:
    cell = task_cell("{kit: 1}")
    put(cell, OTHER_GEAR, 2, Pose((0.1, 0.1, 0.001)))
    go(cell, 0.5)
    assert judged(cell) == (False, 0.0)


def test_score_counts_submitted_kits() -> None:
    cell = task_cell("{score: 3}")
    go(cell, 0.1)
    put(cell, OTHER_GEAR, 1, Pose((0.1, 0.1, 0.001)))
    go(cell, 1.1)
    assert judged(cell) == (False, 0.0)
    cell.senders["tray1"].send("order_0_kit_0")
    go(cell, 15.0)
    assert judged(cell) == (True, 1.0)


def test_faulty_part_is_discarded_beside_the_tray() -> None:
    cell = task_cell("{discarded: {tray: tray1}}")
    assert judged(cell)[0]
    put(cell, GEAR, 1, Pose((0.0, 0.0, 0.001)))
    assert judged(cell) == (True, 0.0)  # success is as of the tick
    go(cell, 0.1)
    assert judged(cell) == (False, 0.0)
    cell.parts.place(cell.parts.part(GEAR), Pose((1.0, -1.9, 0.1)))
    go(cell, 0.1)
    assert judged(cell) == (True, 1.0)


def test_held_faulty_part_is_not_discarded() -> None:
    assert judged(holding("{discarded: {tray: tray1}}")) == (False, 0.0)


def test_turned_part_lies_on_its_other_side() -> None:
    cell = task_cell("{turned: {part: pulley_part}}")
    go(cell, 0.2)
    before = judged(cell)
    x, y, z = cell.parts.pose(cell.parts.part(PULLEY)).position
    cell.parts.place(cell.parts.part(PULLEY), Pose.from_rpy((x, y, z + 0.1), (math.pi, 0.0, 0.0)))
    go(cell, 1.0)
    assert before[0] is False
    assert before[1] < REACHED
    assert judged(cell) == (True, 1.0)


def test_link_is_at_a_point() -> None:
    text = AT_BIN + "task: {sentence: Reach., success: {link_at: {robot: tandem, link: right_tip, at: [%s, %s, %s]}}}"
    cell = Cell(tandem_cell(text % (0, 0, 9)))
    x, y, z = cell.simulation.data.body("tandem/right_tip").xpos.tolist()
    far = judged(cell)
    assert far[0] is False
    assert judged(Cell(tandem_cell(text % (x, y, z + 0.019)))) == (True, 1.0)
    done, share = judged(Cell(tandem_cell(text % (x, y, z + 0.03))))
    assert not done
    assert share == pytest.approx(near(0.01), abs=1e-6)
    assert share > far[1]
