"""Demonstration tray in the running cell."""

import math

import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.devices.kit_tray import DemoTray
from cellwright.config.trial.trial import Kit, KitObject, Options, Order, Trial
from cellwright.util.errors import CellwrightError
from cellwright.util.pose import Pose

KIT = (
    KitObject("gear_part", Pose.from_rpy((0.1, -0.2, 0.0), (0.0, 0.0, 0.5))),
    KitObject("disk_part", Pose((-0.1, 0.2, 0.3))),
    KitObject("gear_part", Pose((-0.1, -0.1, 0.0))),
)
ORDERS = (Order("order_0", (Kit("order_0_kit_0", KIT),), start_time=0.0),)
NAMES = [f"populate_kit_tray_1|{name}" for name in ("gear_part_clone_0", "disk_part_clone_0", "gear_part_clone_1")]


@pytest.fixture
def cell() -> Cell:
    return Cell(Trial("demo", orders=ORDERS, options=Options(fill_demo_tray=True), time_limit=None))


def demo(cell: Cell) -> DemoTray:
    assert cell.demo_tray is not None
    return cell.demo_tray


def in_play(cell: Cell) -> list[str]:
    return [name for name in NAMES if name in cell.parts.in_play]


def test_cell_without_option_has_no_demo_tray() -> None:
    assert Cell(Trial("none", orders=ORDERS)).demo_tray is None


def test_fill_drops_one_part_per_step(cell: Cell) -> None:
    for _ in range(5):
        cell.step()
    assert in_play(cell) == []
    demo(cell).fill()
    for count in (1, 2, 3, 3):
        cell.step()
        assert in_play(cell) == NAMES[:count]


def test_part_is_dropped_over_ordered_place(cell: Cell) -> None:
    demo(cell).fill()
    cell.step()
    cell.step()
    tray_T_disk = cell.trays[1].world_T_tray.inverse() @ cell.parts.pose(cell.parts.part(NAMES[1]))
    assert tray_T_disk.position == pytest.approx((-0.1, 0.2, 0.1), abs=1e-9)


def test_dropped_parts_come_to_rest_as_ordered(cell: Cell) -> None:
    demo(cell).fill()
    cell.simulation.step_until(2_000_000_000)
    tray = cell.trays[1]
    assert [each.name for each in tray.contents] == NAMES
    places = {each.name: each.pose for each in tray.contents}
    for name, ordered in zip(NAMES, KIT, strict=True):
        assert math.dist(places[name].position[:2], ordered.pose.position[:2]) < 0.005
        assert places[name].position[2] == pytest.approx(0.005, abs=2e-4)
        assert places[name].yaw == pytest.approx(ordered.pose.yaw, abs=0.02)


def test_demo_tray_is_filled_at_start_of_each_competition(cell: Cell) -> None:
    for _ in range(2):
        cell.reset()
        cell.competition.start()
        cell.simulation.step_until(100_000_000)
        assert in_play(cell) == NAMES


def test_unknown_event_is_refused(cell: Cell) -> None:
    with pytest.raises(CellwrightError, match="does not know the event 'lift'"):
        demo(cell).handle("lift", ())
