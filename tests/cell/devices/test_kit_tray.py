"""Reports and locks of a tray, in the running cell."""

import math

import pytest

from cellwright.cell.devices.kit_tray import KitTray
from cellwright.cell.model.parts import PART_TYPES, part_type
from cellwright.engine.snapshot import restore_snapshot, take_snapshot
from cellwright.util.errors import CellwrightError
from cellwright.util.pose import Pose
from tests.cell.devices.floor import MM, Floor, down, named
from tests.support.places import TRAY_SURFACE

TRAY_1, TRAY_2 = (0.3, 3.15), (0.3, -3.15)


@pytest.fixture
def tray(floor: Floor) -> KitTray:
    return floor.cell.trays[1]


def lay(floor: Floor, kind: str, dx: float = 0.0, dy: float = 0.0, yaw: float = 0.0, tray: int = 1) -> str:
    x, y = TRAY_1 if tray == 1 else TRAY_2
    floor.lay(named(kind), x + dx, y + dy, TRAY_SURFACE, yaw)
    return named(kind)


def names(tray: KitTray) -> list[str]:
    return [each.name for each in tray.contents]


@pytest.mark.slow
@pytest.mark.parametrize("kind", PART_TYPES)
def test_part_on_plate_is_reported_awake_and_asleep(floor: Floor, tray: KitTray, kind: str) -> None:
    name = lay(floor, kind, 0.02, 0.03)
    floor.run(1.0)
    assert names(tray) == [name]
    floor.run(5.0)
    assert floor.asleep(floor.part(name).body)
    assert names(tray) == [name]


def test_reported_poses_are_in_tray_frame(floor: Floor) -> None:
    lay(floor, "gear_part", 0.1, 0.2, yaw=0.3)
    lay(floor, "disk_part", 0.1, 0.2, yaw=0.3, tray=2)
    floor.run(1.0)
    gear, disk = (floor.cell.trays[number].contents[0].pose for number in (1, 2))
    assert gear.position == pytest.approx((-0.1, -0.2, 0.0051), abs=0.05 * MM)  # AGV 1 faces the other way
    assert math.remainder(gear.yaw - (0.3 - math.pi), math.tau) == pytest.approx(0.0, abs=1e-4)
    assert disk.position == pytest.approx((0.1, 0.2, 0.005), abs=0.05 * MM)
    assert disk.yaw == pytest.approx(0.3, abs=1e-4)


def test_tray_reports_once_per_second(floor: Floor, tray: KitTray) -> None:
    times: list[int] = []
    tray.on_report.append(lambda _: times.append(floor.simulation.now))
    try:
        floor.run(0.5)
        name = lay(floor, "gear_part")
        assert names(tray) == []
        floor.run(0.498)
        assert names(tray) == []
        floor.run(0.002)
        assert names(tray) == [name]
        floor.run(2.5)
    finally:
        tray.on_report.pop()
    assert times == [1_000_000_000, 2_000_000_000, 3_000_000_000]


def test_part_on_other_part_is_not_reported(floor: Floor, tray: KitTray) -> None:
    lower = lay(floor, "pulley_part")
    upper = named("gear_part")
    floor.lay(upper, *TRAY_1, TRAY_SURFACE + part_type("pulley_part").top)
    for _ in range(3):
        floor.run(1.0)
        assert names(tray) == [lower]
    assert floor.pose(upper).position[2] > TRAY_SURFACE + 0.07


def test_part_on_rim_is_not_reported(floor: Floor, tray: KitTray) -> None:
    name = named("part1")  # 0.3 m long, across a corner of the tray
    inward = 0.12 / math.sqrt(2)
    across = Pose.from_rpy((0.55 - inward, 3.5 - inward, 0.7754 + 0.0076), (0.0, 0.0, -math.pi / 4))
    floor.place(name, across)
    floor.run(1.0)
    assert floor.pose(name).position[2] == pytest.approx(0.7754 + 0.0075, abs=0.5 * MM)
    assert names(tray) == []


def test_part_beside_below_or_held_above_tray_is_not_reported(floor: Floor, tray: KitTray) -> None:
    lay(floor, "gear_part")
    floor.lay(named("disk_part"), TRAY_1[0] - 0.45, TRAY_1[1], 0.0)
    floor.put_arm((2.0, 1.5, -0.27, 1.02, 4.0, -1.51, 0.0))
    floor.put_arm(floor.reach(down(TRAY_1[0] - 0.1, TRAY_1[1] - 0.1, TRAY_SURFACE + 0.02)))
    floor.lay(named("part2"), TRAY_1[0] - 0.1, TRAY_1[1] - 0.1, TRAY_SURFACE + 0.0095)
    floor.gripper.set_enabled(True)
    floor.gripper.counter = 5
    floor.cell.step()
    assert floor.gripper.attached
    floor.run(1.0)
    assert names(tray) == [named("gear_part")]


def test_locked_part_stays_reported_and_in_place(floor: Floor, tray: KitTray) -> None:
    name = lay(floor, "gasket_part", 0.05, 0.02)
    floor.run(1.0)
    before = floor.pose(name)
    tray.lock()
    tray.lock()
    dof = floor.part(name).dof
    floor.simulation.data.qvel[dof : dof + 3] = (0.0, 0.0, 1.0)  # a jolt upward
    floor.run(1.0)
    assert names(tray) == [name]
    assert math.dist(floor.pose(name).position, before.position) < 0.1 * MM


def test_unlocked_part_is_moved_by_same_jolt(floor: Floor) -> None:
    name = lay(floor, "gasket_part", 0.05, 0.02)
    floor.run(1.0)
    dof = floor.part(name).dof
    floor.simulation.data.qvel[dof : dof + 3] = (0.0, 0.0, 1.0)
    floor.run(0.1)
    assert floor.pose(name).position[2] > TRAY_SURFACE + 0.04


def test_lock_holds_only_reported_parts(floor: Floor, tray: KitTray) -> None:
    first = lay(floor, "gear_part", -0.1)
    floor.run(1.0)
    late = lay(floor, "disk_part", 0.1)
    floor.run(0.5)
    tray.lock()
    tray.clear()
    assert floor.cell.parts.in_play.isdisjoint({first})
    assert late in floor.cell.parts.in_play
    assert names(tray) == [late]


def test_lock_skips_reported_part_that_left(floor: Floor, tray: KitTray) -> None:
    name = lay(floor, "gear_part")
    floor.run(1.0)
    floor.cell.parts.put_away(floor.part(name))
    tray.lock()
    floor.run(0.5)
    assert floor.pose(name).position[1] < -30.0
    assert not floor.simulation.data.eq_active.any()


def test_trays_lock_and_clear_independently(floor: Floor) -> None:
    gear, disk = lay(floor, "gear_part"), lay(floor, "disk_part", tray=2)
    floor.run(1.0)
    floor.cell.trays[1].lock()
    floor.cell.trays[2].lock()
    floor.cell.trays[2].clear()
    assert names(floor.cell.trays[1]) == [gear]
    assert names(floor.cell.trays[2]) == []
    assert disk not in floor.cell.parts.in_play


def test_remove_all_takes_locked_and_unlocked_parts_and_reports(floor: Floor, tray: KitTray) -> None:
    lay(floor, "gear_part", -0.1)
    floor.run(1.0)
    tray.lock()
    lay(floor, "disk_part", 0.1)
    floor.run(0.1)
    counts: list[int] = []
    tray.on_report.append(lambda each: counts.append(len(each.contents)))
    try:
        tray.remove_all()
    finally:
        tray.on_report.pop()
    assert counts == [0]
    floor.run(1.0)
    assert floor.pose(named("gear_part")).position[1] < -30.0
    assert floor.pose(named("disk_part")).position[1] < -30.0


def test_snapshot_restores_contents_and_locks(floor: Floor, tray: KitTray) -> None:
    lay(floor, "gear_part", 0.1, 0.1, 0.7)
    floor.run(1.0)
    tray.lock()
    snapshot, contents = take_snapshot(floor.simulation), tray.contents
    floor.run(1.5)
    expected = floor.cell.state_hash()
    tray.remove_all()
    floor.run(0.1)
    restore_snapshot(floor.simulation, snapshot)
    assert tray.contents == contents
    floor.run(1.5)
    assert floor.cell.state_hash() == expected


def test_unknown_event_is_refused(tray: KitTray) -> None:
    with pytest.raises(CellwrightError, match="does not know the event 'wash'"):
        tray.handle("wash", ())
